// The one way into the picture: every technique and pass fills a Surface and calls emitSurface.
#include "shaders/octahedral.glsl"
#include "block/View"

const uint CLASS_SKY = 0u, CLASS_GROUND = 1u, CLASS_GRASS = 2u, CLASS_FLOWER = 3u, CLASS_OBJECT = 4u;

struct Surface {
    vec3 baseColour;      // linear, 0 to 1
    float transmittance;  // light let through, relative to what is reflected
    vec3 normal_ws;       // towards the viewer
    float occlusion;      // 1 open to the sky, 0 closed
    float roughness;
    uint surfaceClass;
    uint bladeId;         // 0 where no blade shows
    vec4 clip;            // this point now, without jitter
    vec4 previousClip;    // the same point of the blade one frame ago
};

layout(location = 0) out vec4 gColour;
layout(location = 1) out vec4 gNormal;
layout(location = 2) out vec2 gMotion;
layout(location = 3) out uint gId;
layout(location = 4) out float gDepth;

void emitSurface(Surface s) {
    // the square root keeps dark greens from banding in 8 bits
    gColour = vec4(sqrt(clamp(s.baseColour, 0.0, 1.0)), s.transmittance);
    gNormal = vec4(octahedralEncode(s.normal_ws), s.occlusion, s.roughness);
    vec2 moved = s.clip.xy / s.clip.w - s.previousClip.xy / s.previousClip.w;
    gMotion = 0.5 * moved * view.size_px.xy;
    gId = s.surfaceClass << 27u | s.bladeId;
    gDepth = s.clip.w;
}
