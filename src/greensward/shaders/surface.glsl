// The one way into the picture: every technique and pass fills a Surface and calls emitSurface.
#include "shaders/gbuffer.glsl"

struct Surface {
    vec3 baseColour;      // linear, 0 to 1
    float transmittance;  // light let through, relative to what is reflected
    vec3 normal_ws;       // towards the viewer, of any length
    float occlusion;      // 1 open to the sky, 0 closed
    float roughness;
    uint surfaceClass;
    uint bladeId;         // 0 where no blade shows
    vec4 previousClip;    // this point of the surface one frame ago, without jitter
};

layout(location = 0) out vec4 gColour;
layout(location = 1) out vec4 gNormal;
layout(location = 2) out vec2 gMotion;
layout(location = 3) out uint gId;
layout(location = 4) out float gDepth;

void emitSurface(Surface s) {
    gColour = packColour(s.baseColour, s.transmittance);
    gNormal = packNormal(s.normal_ws, s.occlusion, s.roughness);
    vec2 now = gl_FragCoord.xy * view.size_px.zw * 2.0 - 1.0 - view.jitter;
    gMotion = 0.5 * (now - s.previousClip.xy / s.previousClip.w) * view.size_px.xy;
    gId = s.surfaceClass << 27u | s.bladeId;
    gDepth = 1.0 / gl_FragCoord.w;
}
