// The one way into the picture: every technique and pass fills a Surface and calls emitSurface.
#include "shaders/gbuffer.glsl"
#include "shaders/surface.glsl"

#ifdef SURFACE_IMAGES
layout(rgba8, binding = 0) writeonly uniform image2D colourImage;
layout(rgba16f, binding = 1) writeonly uniform image2D normalImage;
layout(rg32f, binding = 2) writeonly uniform image2D motionImage;
layout(r32ui, binding = 3) writeonly uniform uimage2D idImage;
layout(r32f, binding = 4) writeonly uniform image2D depthImage;

// From a compute shader, for a surface that is nearer than what the pixel holds
void emitSurface(Surface s, ivec2 pixel, float depth_m) {
    imageStore(colourImage, pixel, packColour(s.baseColour, s.transmittance));
    imageStore(normalImage, pixel, packNormal(s.normal_ws, s.occlusion, s.roughness));
    imageStore(motionImage, pixel, vec4(packMotion(vec2(pixel) + 0.5, s.previousClip), 0.0, 0.0));
    imageStore(idImage, pixel, uvec4(packId(s.surfaceClass, s.bladeId)));
    imageStore(depthImage, pixel, vec4(depth_m));
}
#else
layout(location = 0) out vec4 gColour;
layout(location = 1) out vec4 gNormal;
layout(location = 2) out vec2 gMotion;
layout(location = 3) out uint gId;
layout(location = 4) out float gDepth;

// From a fragment shader whose geometry is not where the surface is
void emitSurface(Surface s, float depth_m) {
    gColour = packColour(s.baseColour, s.transmittance);
    gNormal = packNormal(s.normal_ws, s.occlusion, s.roughness);
    gMotion = packMotion(gl_FragCoord.xy, s.previousClip);
    gId = packId(s.surfaceClass, s.bladeId);
    gDepth = depth_m;
}

void emitSurface(Surface s) { emitSurface(s, 1.0 / gl_FragCoord.w); }
#endif
