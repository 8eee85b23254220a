#ifdef PICTURES
uniform sampler2DArray object_pictures;  // square root of the colour; alpha

in vec2 texel_uv;
flat in vec4 surface_of;  // layer or -1, alpha below which it is cut out, continuation along u and v

// Coordinate in 0..1 past the edges: repeated, mirrored or held at the last texel
float continued(float at, float way, float texels) {
    if (way > 1.5) return clamp(at, 0.5 / texels, 1.0 - 0.5 / texels);
    return way > 0.5 ? 1.0 - abs(mod(at, 2.0) - 1.0) : at;
}

vec4 picture() {
    vec2 texels = vec2(textureSize(object_pictures, 0).xy);
    float u = continued(texel_uv.x, surface_of.z, texels.x), v = continued(texel_uv.y, surface_of.w, texels.y);
    vec3 at = vec3(u, v, max(surface_of.x, 0.0));
    vec4 found = texture(object_pictures, at);
    // Sharp up to a level at which what is cut out is still told apart
    found.a = textureLod(object_pictures, at, min(textureQueryLod(object_pictures, at.xy).x, 3.0)).a;
    return surface_of.x < 0.0 ? vec4(1.0) : found;
}
#endif

#ifdef SHADOW
void main() {
#ifdef PICTURES
    if (picture().a < surface_of.y) discard;
#endif
}
#else
#include "shaders/noise.glsl"
#include "shaders/emit.glsl"

in vec3 local;
in vec3 normal_ws;
in vec4 colour;
in float worn;
in vec4 previousClip;
flat in uint number;

void main() {
    vec3 own = colour.rgb;
#ifdef PICTURES
    vec4 found = picture();
    if (found.a < surface_of.y) discard;
    own *= found.rgb * found.rgb;
#endif
#ifdef WEATHERED
    // streaks along the height, and blotches
    float streak = simplex(vec2(local.x + local.z * 1.7, local.y * 0.12) * 42.0, 3u);
    float blotch = octaves(local.xy * 3.0 + local.z * 2.0, 9u, 3, 0.6, 2.3);
    own *= 1.0 + worn * (0.14 * streak + 0.22 * blotch);
#endif
    Surface s;
    s.baseColour = own;
    s.transmittance = 0.0;
    s.normal_ws = normalize(normal_ws);
    s.occlusion = 0.9;
    s.roughness = colour.w;
    s.surfaceClass = CLASS_OBJECT;
    s.bladeNumber = number;
    s.previousClip = previousClip;
    emitSurface(s);
}
#endif
