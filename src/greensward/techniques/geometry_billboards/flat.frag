// A texture of lines in other colours, which is to look like grass from afar (Derstroff 2024, section 2.4, LOD 0).
#include "shaders/emit.glsl"
#include "shaders/hash.glsl"
#include "culling/level_of_detail.glsl"
#include "sowing/clearings.glsl"

uniform sampler2D tile_image;  // square roots of colours, or of half the factors of the sward's
uniform bool tile_painted;

in vec2 uv;
in vec2 place_xz;
in vec3 position_rs;
in vec3 up_ws;
in vec3 previousClip;
in vec4 material;
in float cover;
flat in uint bladeNumber;

// Seen at a slant, a level is taken that is sharper along the longer side of a pixel's footprint
vec3 texelAt(vec2 at) {
    vec3 root = texture(tile_image, at, -1.5).rgb;
    return root * root;
}

// The same lines, many times as large and each time turned: from afar tufts and drifts are told apart, not blades
float mottled() {
    const mat2 turn = mat2(0.8, 0.6, -0.6, 0.8);
    vec2 once = turn * uv, twice = turn * once;
    return 8.0 * texelAt(once / 5.3).g * texelAt(twice / 31.0).g * texelAt(turn * twice / 173.0).g;
}

// A blade's, turned at random on the side that the viewer sees; far away as a wall of blades, turned to the viewer as much as up
vec3 normalAt(float random, float away) {
    vec3 up = normalize(up_ws), toViewer = view.camera_ws.xyz - view.origin_ws.xyz - position_rs;
    vec3 level = normalize(toViewer - up * dot(toViewer, up)), side = cross(up, level);
    float angle = 3.14159265 * (random - 0.5);
    vec3 blade = cos(angle) * level + sin(angle) * side + 0.6 * up;
    return mix(blade, 0.8 * level + 0.75 * up, 0.8 * smoothstep(8.0, 90.0, away));
}

void main() {
    float away = distance(position_rs + view.origin_ws.xyz, view.camera_ws.xyz);
    // some of the ground shows where grass is thin, and at the end of its reach
    vec3 chance = unit(hash3(uvec3(ivec3(floor(16.0 * uv), bladeNumber))));
    float footprint_m = max(length(dFdx(place_xz)), length(dFdy(place_xz)));
    if (chance.x >= cover * openAt(place_xz, footprint_m) * (1.0 - farFade(away)) || away >= sward.blades_m) discard;
    Surface s;
    s.baseColour = tile_painted ? texelAt(uv) : 2.0 * texelAt(uv) * mottled() * material.rgb;
    s.transmittance = material.w;
    s.normal_ws = normalAt(chance.y, away);
    s.occlusion = 1.0;  // what shows are tips
    s.roughness = 0.95;
    s.surfaceClass = CLASS_GRASS;
    s.bladeNumber = bladeNumber;
    s.previousClip = previousClip.xyzz;
    emitSurface(s);
}
