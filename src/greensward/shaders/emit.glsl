// The only path into the G-buffer: every technique and pass fills a Surface and calls emitSurface.
#include "shaders/gbuffer.glsl"
#include "shaders/surface.glsl"

#ifdef SURFACE_IMAGES
layout(rgba8) writeonly uniform image2D colour_image;
layout(rgba16f) writeonly uniform image2D normal_image;
layout(rg32f) writeonly uniform image2D motion_image;
layout(rg32ui) writeonly uniform uimage2D surface_image;

// From a compute shader, for a surface that is nearer than what the pixel holds
void emitSurface(Surface s, ivec2 pixel, float depth_m) {
    imageStore(colour_image, pixel, packColour(s.baseColour, s.transmittance));
    imageStore(normal_image, pixel, packNormal(s.normal_ws, s.occlusion, s.roughness));
    imageStore(motion_image, pixel, vec4(packMotion(vec2(pixel) + 0.5, s.previousClip), 0.0, 0.0));
    imageStore(surface_image, pixel, uvec4(packSurface(s.surfaceClass, s.bladeNumber, depth_m), 0u, 0u));
}
#else
layout(location = 0) out vec4 colour_out;
layout(location = 1) out vec4 normal_out;
layout(location = 2) out vec2 motion_out;
layout(location = 3) out uvec2 surface_out;

// From a fragment shader whose geometry is not where the surface is
void emitSurface(Surface s, float depth_m) {
    colour_out = packColour(s.baseColour, s.transmittance);
    normal_out = packNormal(s.normal_ws, s.occlusion, s.roughness);
    motion_out = packMotion(gl_FragCoord.xy, s.previousClip);
    surface_out = packSurface(s.surfaceClass, s.bladeNumber, depth_m);
}

float fragmentDepth() {
    return view.eye_rs.w > 0.0 ? 1.0 / gl_FragCoord.w : view.parallel_depth_m.z + view.parallel_depth_m.w * gl_FragCoord.z;
}

void emitSurface(Surface s) { emitSurface(s, fragmentDepth()); }
#endif
