// A picture through a lens that bends straight lines, gathered from pinhole pictures that are finer: its faces.
uniform sampler2D places;  // of each pixel: where it lies in its face, 0 to 1; the number of the face, -1 for none
uniform sampler2D radiance;
uniform float face;

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 place = texelFetch(places, pixel, 0).xyz;
    if (place.z != face) return false;
    result[0] = vec4(textureLod(radiance, place.xy, 0.0).rgb, 1.0);
    return true;
}
