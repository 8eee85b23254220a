// Decides per blade whether it is drawn, how finely, and how wide.
#include "culling/presence.glsl"
#include "shaders/bezier.glsl"
#include "block/BezierBlades"

layout(vertices = 1) out;

layout(std430, binding = 0) readonly buffer Blades { Blade blades[]; };
layout(std430, binding = 1) readonly buffer Postures { Posture postures[]; };

in uint patchBlade[];

patch out vec3 root;
patch out vec3 control;
patch out vec3 tip;
patch out vec3 side;            // unit, as it is drawn: turned to the viewer where the blade would vanish
patch out float width;
patch out float shape;
#ifndef SHADOW
patch out vec3 previousControl;
patch out vec3 previousTip;
patch out vec3 trueSide;        // unit, for the shading normal
patch out vec3 rootColour;
patch out vec3 tipColour;
patch out vec4 look;            // transmittance, roughness, height over the canopy's, 0 near to 1 far
patch out vec3 groundNormal_ws;
patch out uint bladeIndex;
#endif

// Whether the hull of the control points, grown by the width, lies outside one side of the view
bool outside(vec3 v0, vec3 v1, vec3 v2, float width_m) {
    vec4 a = view.clip_from_world * vec4(v0, 1.0);
    vec4 b = view.clip_from_world * vec4(v1, 1.0);
    vec4 c = view.clip_from_world * vec4(v2, 1.0);
    vec2 margin = width_m * vec2(length(view.clip_from_world[0].xyz) + 4.0);
    vec2 low = max(max(a.xy + a.w, b.xy + b.w), c.xy + c.w);
    vec2 high = min(min(a.xy - a.w, b.xy - b.w), c.xy - c.w);
    return any(lessThan(low, -margin)) || any(greaterThan(high, margin));
}

// Segments that keep a quadratic curve within an error of its chords: |v0 - 2 v1 + v2| / (4 n^2) <= error.
// The outline tapers by half the width over the blade, and bends likewise.
float segments(vec3 v0, vec3 v1, vec3 v2, float width_m, float pixel, float shape) {
    float bend = length(v0 - 2.0 * v1 + v2) + 0.5 * width_m;
    float n = ceil(sqrt(bend / (4.0 * bezierblades.error_px * pixel)));
    float least = shape > 5.5 ? 12.0 : 1.0;  // the lobes of a dandelion need them
    return clamp(n, least, max(least, bezierblades.max_level));
}

void main() {
    gl_TessLevelOuter[0] = gl_TessLevelOuter[1] = gl_TessLevelOuter[2] = gl_TessLevelOuter[3] = 0.0;
    gl_TessLevelInner[0] = gl_TessLevelInner[1] = 0.0;
    uint index = patchBlade[0];
    if (index == 0xffffffffu) return;
    Blade b = blades[index];
    vec3 v0 = bladeRoot(b);
    float away = distance(v0, view.camera_ws.xyz), widening;
    float here = presence(b, away, widening);
    if (here <= 0.0) return;

    vec3 v1, v2;
    unpackPosture(postures[index].now, v0, v1, v2);
    v1 = mix(v0, v1, here);
    v2 = mix(v0, v2, here);
    vec3 middle = bezierPoint(v0, v1, v2, 0.5);
    float pixel = view.pixel_m.x * max(dot(view.axis_ws.xyz, middle) + view.axis_ws.w, 0.02) + view.pixel_m.y;
    float natural = b.width * widening, least = bezierblades.min_width_px * pixel;
#ifdef SHADOW
    // a texel wide at least, but then fewer, or the shade of thin blades would grow
    if (bladeRandom(b) * least > natural) return;
#endif
    float wide = max(natural, least) * min(1.0, 2.0 * here);
    if (outside(v0, v1, v2, wide)) return;

    int kind = bladeSpecies(b);
    shape = species(kind, MIX).z;
    vec3 up = bladeUp(b), front, across;
    bladeFrame(up, b.facing, front, across);
    vec3 tangent = normalize(v2 - v0);
    across = normalize(across - tangent * dot(across, tangent));
    // seen edge-on, turn the drawn side into the plane of the screen
    vec3 toViewer = normalize(view.eye_ws.xyz - middle * view.eye_ws.w);
    vec3 screenSide = cross(tangent, toViewer);
    float edgeOn = length(screenSide);
    screenSide = edgeOn > 1e-3 ? screenSide / edgeOn : across;
    if (dot(screenSide, across) < 0.0) screenSide = -screenSide;
    float facing = abs(dot(cross(across, tangent), toViewer));
    side = normalize(mix(screenSide, across, smoothstep(0.05, 0.4, facing)));
    width = wide;
    root = v0; control = v1; tip = v2;

#ifndef SHADOW
    unpackPosture(postures[index].previous, v0, previousControl, previousTip);
    previousControl = mix(v0, previousControl, here);
    previousTip = mix(v0, previousTip, here);
    trueSide = across;
    vec4 rootRow = species(kind, ROOT), tipRow = species(kind, TIP);
    vec3 dry = species(kind, DRY).rgb;
    float dryness = bladeDryness(b), tint = bladeTint(b) - 0.5;
    vec3 shade = vec3(1.0 + 0.55 * tint, 1.0 + 0.38 * tint, 1.0 + 0.1 * tint);
    rootColour = shade * mix(rootRow.rgb, dry * 0.55, smoothstep(0.35, 1.0, dryness));
    tipColour = shade * mix(tipRow.rgb, dry, dryness);
    vec4 map = textureLod(vegetationMap, mapUv(v0.xz), 0.0);
    rootColour = mix(rootColour, shade * map.rgb * 0.6, map.a);
    tipColour = mix(tipColour, shade * map.rgb, map.a);
    // far blades stand for many: their contrast fades towards what those would show together
    float far = smoothstep(8.0, 90.0, away);
    tipColour = mix(tipColour, tipColour / shade, 0.7 * far);
    rootColour = mix(rootColour, 0.9 * tipColour, 0.85 * far);
    look = vec4(rootRow.w, mix(tipRow.w, 0.95, far), b.height / max(sward.canopy_m, 1e-3), far);
    groundNormal_ws = up;
    bladeIndex = index;
#endif

    float n = segments(v0, v1, v2, wide, pixel, shape);
    gl_TessLevelOuter[0] = gl_TessLevelOuter[2] = n;
    gl_TessLevelOuter[1] = gl_TessLevelOuter[3] = 1.0;
    gl_TessLevelInner[0] = 1.0;  // drivers promote it to 2 where n > 1: the middle column carries the fold
    gl_TessLevelInner[1] = n;
}
