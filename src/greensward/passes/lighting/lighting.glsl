// Deferred lighting: every pixel of the G-buffer once, the same for every technique.
#include "shaders/gbuffer.glsl"
#include "passes/sky/surroundings.glsl"
#include "ground/ground.glsl"
#ifdef PHONG
#include "passes/lighting/phong.glsl"
#include "sowing/sward.glsl"
#endif

uniform sampler2DShadow shadow_map0;
uniform sampler2DShadow shadow_map1;
uniform sampler2DShadow shadow_map2;
uniform sampler2DShadow shadow_map3;

float tap(int cascade, vec3 at) {
    switch (cascade) {
        case 0: return texture(shadow_map0, at);
        case 1: return texture(shadow_map1, at);
        case 2: return texture(shadow_map2, at);
        default: return texture(shadow_map3, at);
    }
}

const int TAPS = 6;
const float SPREAD = 1.8, UNDER_GRASS = 7.0;  // texels

// Interleaved gradient noise (Jimenez 2014), another pattern each sample
float ditherAt(ivec2 pixel) {
    vec2 p = vec2(pixel) + 5.588238 * float(light.sample_index & 63);
    return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715))));
}

// How far a blade is lifted towards the sun, in metres: what casts its shadow is wider than itself, and may be turned to the sun;
// and its taps lie beside it, where its plane is the farther the more it is turned from the sun. Never out of the sward.
float ownShadow(vec3 normal, float texel) {
    float along = abs(dot(normal, light.to_sun.xyz));
    return light.caster_m + min(SPREAD * texel * min(sqrt(1.0 - along * along) / max(along, 1e-3), 6.0), 0.25);
}

// Sunlight that arrives, from cascaded shadow maps by percentage-closer filtering (Reeves, Salesin & Cook 1987) over a disk of
// texels turned per pixel, of a radius of `spread`. On a surface broader than the taps, the depth compared with follows its plane
// from tap to tap (Isidoro 2006, "Shadow Mapping: GPU-based Tips and Techniques"), or a low sun would shade the ground with
// itself.
float sunlit(vec3 p, vec3 normal, uint kind, float spread, float turn) {
    bool broad = kind == CLASS_GROUND || kind == CLASS_OBJECT;
    vec3 sunny = dot(normal, light.to_sun.xyz) < 0.0 && !broad ? -normal : normal;
    for (int i = 0; i < light.cascades; i++) {
        float texel = light.shadow_texel_m[i], own = kind == CLASS_GRASS ? ownShadow(normal, texel) : 0.0;
        vec3 lifted = p + sunny * texel * 0.6 + light.to_sun.xyz * (texel * 0.5 + own);
        vec3 at = (light.shadow_from_world[i] * vec4(lifted, 1.0)).xyz;
        vec2 fromEdge = min(at.xy, 1.0 - at.xy);
        if (min(fromEdge.x, fromEdge.y) < 0.01 || at.z > 1.0) continue;
        vec2 slope = vec2(0.0);
        if (broad) {
            // the linear part scales axes that are at right angles, so dividing by squared lengths inverts it
            mat3 toLight = transpose(mat3(light.shadow_from_world[i]));
            vec3 inLight = vec3(dot(toLight[0], normal) / dot(toLight[0], toLight[0]),
                                dot(toLight[1], normal) / dot(toLight[1], toLight[1]),
                                dot(toLight[2], normal) / dot(toLight[2], toLight[2]));
            slope = clamp(-inLight.xy / min(inLight.z, -1e-4), vec2(-16.0), vec2(16.0)) * step(inLight.z, 0.0);
        }
        float sum = 0.0;
        float perTexel = 1.0 / float(textureSize(shadow_map0, 0).x);
        int taps = spread > SPREAD ? 2 * TAPS : TAPS;
        for (int k = 0; k < taps; k++) {
            float r = sqrt((float(k) + 0.5) / float(taps)) * spread * perTexel;
            float angle = 2.39996323 * float(k) + 6.2831853 * turn;
            vec2 aside = r * vec2(cos(angle), sin(angle));
            sum += tap(i, vec3(at.xy + aside, at.z + dot(slope, aside)));
        }
        return sum / float(taps);
    }
    return 1.0;
}

// GGX with Schlick's Fresnel and Smith's visibility (Heitz 2014; approximation of Hammon 2017)
float gloss(vec3 n, vec3 v, vec3 l, float roughness) {
    vec3 h = normalize(v + l);
    float nl = max(dot(n, l), 0.0), nv = abs(dot(n, v)) + 1e-4, nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
    float a = roughness * roughness, aa = a * a;
    float d = aa / (PI * pow(nh * nh * (aa - 1.0) + 1.0, 2.0));
    float visible = 0.5 / mix(2.0 * nl * nv, nl + nv, a);
    float f = 0.04 + 0.96 * pow(1.0 - vh, 5.0);
    return min(d * visible * f, 8.0) * nl;
}

#ifdef PHONG
// Area of leaves on a square metre of ground: blades, each two thirds of its length times its greatest width, as a parabola
float leafAreaAt(vec2 xz) {
    Sward s = swardAt(xz, 1.0);
    return sward.density_per_m2 * s.density * slopeShare(groundNormal(xz).y) * s.height * sward.grown * sward.blade_m.x * sward.blade_m.y / 1.5;
}
#endif

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 ray = normalize(rayThrough(pixel));
    if (classAt(pixel) == CLASS_SKY) {
        result[0] = vec4(skyFrom(view.camera_ws.y, ray), 1.0);
        return true;
    }
    vec3 p = worldAt(pixel);

    vec4 c = texelFetch(gbuffer_colour, pixel, 0), n4 = texelFetch(gbuffer_normal, pixel, 0);
    vec3 albedo = c.rgb * c.rgb, n = octahedralDecode(n4.xy);
    float transmittance = c.w, open = n4.z, roughness = n4.w;
    vec3 toSun = light.to_sun.xyz, sun = light.sun_here.rgb;
    float nl = dot(n, toSun);

    // far turf is shaded as a wall of blades, but lies as the ground does
    bool on_ground = classAt(pixel) == CLASS_GROUND;
    vec3 lie = on_ground ? groundNormal(p.xz) : n;
    // of single blades the map tells too coarsely what reaches the ground among them: stripes, where it should be nearly even
    float spread = on_ground ? mix(UNDER_GRASS, SPREAD, smoothstep(0.3, 1.0, open)) : SPREAD;
    float lit = sunlit(p, lie, classAt(pixel), spread, ditherAt(pixel));
    if (on_ground) lit *= smoothstep(-0.04, 0.2, dot(lie, toSun));
    lit *= throughClouds(p);
#ifdef PHONG
    float left = open < 1.0 ? ambientLeft(leafAreaAt(p.xz), depthBelowTips(open)) : 1.0;
    vec3 colour = phong(albedo, n, -ray, toSun, lit * sun, skylight.mean.rgb, left);
#else
    // the map is coarser than a blade: deep in the sward less sun arrives than it tells
    lit *= mix(0.35, 1.0, smoothstep(0.0, 0.75, open));

    // what passes through a leaf is warmer and greener than what it reflects, and strongest against the light
    vec3 through = transmittance * sqrt(albedo) * albedo * vec3(2.1, 2.25, 0.85);
    float against = pow(max(dot(ray, toSun), 0.0), 4.0);
    vec3 diffuse = albedo / PI * max(nl, 0.0) + through / PI * (max(-nl, 0.0) * (1.0 + 1.3 * against) + 0.18 * transmittance);
    vec3 colour = sun * lit * (diffuse + gloss(n, -ray, toSun, roughness) * mix(0.35, 1.0, open));

    vec3 sky = skyIrradiance(n);
    colour += (albedo * sky + through * skyIrradiance(-n) * 0.7) / PI * open;
#endif
    float away = depthAt(pixel) * length(rayThrough(pixel));
    // Jahrmann & Wimmer 2013, section 6.4: a penalty on the material with distance
    if (classAt(pixel) != CLASS_OBJECT) colour *= 1.0 - light.darkening * min(away / light.darkening_m, 1.0);
    result[0] = vec4(throughAir(colour, p, ray, away), 1.0);
    return true;
}
