// Phong's reflection model (Phong 1975, "Illumination for Computer Generated Pictures"; Tillman 2013, section 2.1.6).
#include "layout/Light"

// Ia ka A + Ip (kd (n . l) + ks (r . v)^s) for a colour in light: `sky` is the ambient radiance, `sun` the irradiance across
// the light's direction, of which a white surface that faces it shows sun / pi
vec3 phong(vec3 colour, vec3 n, vec3 v, vec3 l, vec3 sun, vec3 sky, float ambientLeft) {
    float facing = dot(n, l), highlight = pow(max(dot(2.0 * facing * n - l, v), 0.0), light.phong.w);
    vec3 shine = facing > 0.0 ? light.phong.y * facing * colour + light.phong.z * highlight : vec3(0.0);
    return light.phong.x * ambientLeft * sky * colour + 0.318309886 * sun * shine;
}

// Part of the ambient light that is left below leaves of an area index, at a depth from 0 at the tips to 1 at the roots. The
// source gives no formula; this is Monsi & Saeki 1953, "On the factor light in plant communities".
float ambientLeft(float leafArea, float depth) { return exp(-light.extinction * leafArea * depth); }

// Depth below the tips of what the G-buffer holds an occlusion of, as techniques/blades/material.glsl gives it near the viewer
float depthBelowTips(float open) { return sqrt(clamp((1.0 - open) / 0.8, 0.0, 1.0)); }
