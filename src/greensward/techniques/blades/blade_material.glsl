// Material of a blade, from its species, its own variation and the place.
#include "techniques/blades/leaf.glsl"
#include "techniques/blades/material.glsl"

// Where less is drawn one sees deeper, and seen from low above that is farther: the factor back to where all would have
// shown. Depth as in material.glsl.
float nearer(Blade b, float share) {
    float above = max(dot(view.camera_ws.xyz - bladeRoot(b), groundUnder(b)), 1e-3);
    return max(1.0 - (1.0 - pow(share, 0.3333)) * sward.canopy_m * sward.grown / above, 0.5);
}

vec3 shadeOf(Blade b) { return shadeOf(bladeTint(b) - 0.5); }

void bladeColours(Blade b, vec3 shade, out vec3 root, out vec3 tip) {
    int kind = bladeSpecies(b);
    vec3 dry = species(kind, DRY).rgb;
    root = shade * mix(species(kind, ROOT).rgb, dry * 0.55, smoothstep(0.35, 1.0, bladeDryness(b)));
    tip = shade * mix(species(kind, TIP).rgb, dry, bladeDryness(b));
}

// Far away a blade is shaded as the wall of blades that it stands for, turned to the viewer as much as up
vec3 wallNormal(vec3 up, vec3 toViewer) { return normalize(0.8 * normalize(toViewer - up * dot(toViewer, up)) + 0.75 * up); }

Material materialOf(Blade b, BladeBounds h, bool on_ground) {
    int kind = bladeSpecies(b);
    vec3 up = bladeUp(b), toViewer = toViewerFrom(h.middle), shade = shadeOf(b), root, tip;
    bladeColours(b, shade, root, tip);
    vec4 map = on_ground ? paintedAt(bladeRoot(b).xz, 0.0) : vec4(0.0);
    root = mix(root, shade * map.rgb * 0.6, map.a);
    tip = mix(tip, shade * map.rgb, map.a);
    // far blades stand for many: their contrast fades towards what those would show together
    float share = coverageOf(b, h), far = smoothstep(8.0, 90.0, h.away * nearer(b, share));
    tip = mix(tip, tip / shade, 0.7 * far);
    root = mix(root, 0.9 * tip, 0.85 * far);
    return Material(vec4(root, species(kind, ROOT).w), vec4(tip, mix(species(kind, TIP).w, 0.95, far)), b.height / max(sward.canopy_m, 1e-3), far, share, wallNormal(up, toViewer), map.a);
}
