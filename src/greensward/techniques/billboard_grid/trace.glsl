// Ray-marched billboards, "Instant Animated Grass" (Habel, Wimmer & Jeschke 2007): a ray is followed below the tips of the grass, through a regular grid
// of billboards that stands on the ground, and is blended front to back with the over operator. The slides number no formulas.
#include "ground/march.glsl"
#include "culling/level_of_detail.glsl"
#include "motion/pose.glsl"
#include "techniques/blades/material.glsl"
#include "layout/BladeKind"

uniform sampler2DArray side_colour;
uniform sampler2DArray side_shape;
uniform usampler2DArray side_blade;
uniform sampler2DArray top_colour;
uniform sampler2DArray top_shape;
uniform usampler2DArray top_blade;

uniform vec2 turn;          // cosine and sine
uniform ivec2 first_cell;    // of the grid, in which the origin of relative space lies
uniform vec2 in_cell_m;      // and where in it
uniform ivec2 first_billboard;
uniform vec2 in_billboard;   // and on a billboard, in widths of one
uniform float spacing_m;
uniform float billboard_m;  // width
uniform float irregular;    // how far billboards stand off their places, in spacings
uniform float tall_m;       // of what the billboards show
uniform float layer_m;      // above which no grass is anywhere
uniform int steps;
uniform int layers;
uniform float opacity;      // from which on a point shows grass
uniform vec4 mean_material;      // colour of the billboards' upper blades, and how much light they let through
uniform vec2 mean_blade;     // stiffness and roughness
uniform float time_s;
uniform float previous_time_s;

const float STEEPEST = 0.5;  // normal's y on a slope of 60 degrees, beyond which a grid of upright billboards falls apart
const float SHARPER = 1.5;  // levels of detail, as jittered samples average what is left
const float FILLED = 0.35;   // how much what fills the rest shows blades apart, whose picture is a mean of many slabs
const int FARTHER = 6;       // times as many steps for rays that need not end in the grass
const float NOWHERE_M = 1e9;
// Of what grass hides from above, how much the lowest plane does
#ifdef MIDDLE_PLANE
const float LOWEST_PART = 0.5;
#else
const float LOWEST_PART = 1.0;
#endif

// What is the same along a ray, as wind and drifts change over more than it goes through the grass
struct Around {
    float dense, height, dryness;  // the sward's drifts, without its maps
    vec3 v1, v2, before1, before2;  // how a blade as tall as the billboards stands, now and a frame ago
};

struct Traced {
    vec4 colour;     // times opacity, which is w
    vec3 normal_ws;
    float high;      // of the height of the grass, and
    float along;     // of the blade's length, times opacity both
    float depth_m;   // where the threshold was reached, or NOWHERE_M
    uvec2 blade;     // its permanent id
    float rest;      // part of its height at which what shows there stands when nothing moves
    float coarse;    // 0 where a pixel shows one blade there, to 1 where it is wider than several
};

vec2 toGrid(vec2 xz) { return vec2(turn.x * xz.x + turn.y * xz.y, -turn.y * xz.x + turn.x * xz.y); }
vec2 fromGrid(vec2 g) { return vec2(turn.x * g.x - turn.y * g.y, turn.y * g.x + turn.x * g.y); }

// How far what stands at some part of the height moves, where a blade as tall leans this way
vec3 swayed(vec3 v1, vec3 v2, float rest) {
#ifdef SHEAR
    return vec3(rest, 0.0, rest) * v2;  // as published: offset grows with height, and nothing sinks
#else
    return 2.0 * rest * (1.0 - rest) * v1 + rest * rest * v2;
#endif
}

// A blade that stands for those around, and bobs with its neighbours, the less alike the farther they are
void bentAt(vec3 root, float tall, float time_s, out vec3 v1, out vec3 v2) {
    Blade b = Blade(root.x, root.y, root.z, 0.0, root.x, root.y + 0.5 * tall, root.z, tall, root.x, root.y + tall, root.z,
                    0.01, packSnorm2x16(octahedralEncode(vec3(0.0, 1.0, 0.0))), mean_blade.x, 0u, 0x80000000u);
    float neighbours = simplex(2.3 * inWorld(root.xz), 71u);
    Air air = windAt(root, neighbours, time_s);
#ifdef MASS
    air = forced(air, motion.mean_mass);
#endif
    if (FORM == NATURAL) {
        vec3 off;
        float swing = 3.5 * inversesqrt(max(tall, 0.02)) * time_s + 5.0 * neighbours + 2.0 * simplex(9.1 * inWorld(root.xz), 73u);
        bentByWindAtPhase(b, air, time_s, swing, off, v1, v2);
    } else {
        balance(b, air, forceOn(b, time_s), v1, v2);
    }
}

Around around(vec3 p) {
    Around a;
    Sward s = swardOn(vec3(inWorld(p.xz), 0.0).xzy, vec3(0.0, 1.0, 0.0));
    a.dense = s.density;
    a.height = s.height;
    a.dryness = s.dryness;
    float tall = tall_m * s.height;
    vec3 root = vec3(p.x, groundHeight(p.xz), p.z);
    bentAt(root, tall, time_s, a.v1, a.v2);
#ifndef SHADOW
    bentAt(root, tall, previous_time_s, a.before1, a.before2);
#endif
    return a;
}

// What presses the grass changes from one blade to the next
void bendUnderForces(inout Around a, vec3 p_ws) {
#ifndef NO_FORCES
    vec3 v1 = a.v1, v2 = a.v2;
    bentAt(vec3(p_ws.x, groundHeight(p_ws.xz), p_ws.z), tall_m * a.height, time_s, a.v1, a.v2);
    a.before1 += a.v1 - v1;
    a.before2 += a.v2 - v2;
#endif
}

// Part of the blades that grow here, and the height map's factor
vec2 shareAt(vec3 p_ws, Around a) {
    vec4 map = vec4(1.0);
#ifdef MAPPED
    map = textureLod(density_map, mapUv(p_ws.xz), 0.0);
    if (view.low_detail != 0 && map.g <= 0.0) map.r = 0.0;
#endif
    float away = distance(p_ws, view.camera_ws.xyz);
    float far = 1.0 - smoothstep(0.82, 1.0, away / sward.reach_m);
#ifdef FAR
    far *= farFade(away);
#endif
    bool outside = ground.beyond == 1 && any(greaterThan(abs(inWorld(p_ws.xz)), 0.5 * ground.size_m));
    return vec2(outside ? 0.0 : a.dense * map.r * greenAt(p_ws.xz, 0.5 * spacing_m) * openAt(p_ws.xz, 0.0) * far, map.b);
}

float groundUnderneath(vec2 xz) {
#ifdef LEVEL
    return relief_m.x;
#else
    return groundHeight(xz);
#endif
}

float pixelAt(float depth_m) { return view.pixel_m.x * depth_m + view.pixel_m.y; }

// How much of a texel stays where only some blades grow: near, whole blades; far, where a texel holds many, their share
float shareOfTexel(float rank, float share, float lod) {
    return mix(step(rank, share), share, smoothstep(0.5, 3.0, lod));
}

// Blades narrower than a pixel would be drawn a pixel wide, and hide as much more
float widened(float depth_m) {
#ifdef SHADOW
    return 1.0;
#else
    return max(pixelAt(depth_m) / sward.blade_m.y, 1.0);
#endif
}

// What is hidden by so many times as many blades
float hiddenBy(float opacity, float times) { return 1.0 - pow(1.0 - min(opacity, 1.0), times); }

void over(inout Traced t, vec4 colour, vec3 normal_ws, float high, float along) {
    float through = 1.0 - t.colour.a;
    t.colour += through * colour;
    t.normal_ws += through * colour.a * normal_ws;
    t.high += through * colour.a * high;
    t.along += through * colour.a * along;
}

float random_threshold;  // of this pixel and sample, 0 to 1

// Whether the threshold is reached now. Where texels are means of many blades it is drawn by lot, or fewer than half of them
// would never show; and always so in shadow maps, where thin grass must let light through whatever the size of a texel.
bool reached(inout Traced t, float depth_m, float lod) {
#ifdef SHADOW
    float coarse = 0.0, least = mix(0.35, 1.0, random_threshold);
#else
#ifdef CARRIER
    float coarse = 0.0, least = opacity;  // the rest is filled, and so is reached everywhere
#else
    float coarse = smoothstep(1.0, 3.5, lod), least = mix(opacity, random_threshold, coarse);
#endif
#endif
    if (t.depth_m < NOWHERE_M || t.colour.a <= least) return false;
    t.depth_m = depth_m;
    t.coarse = coarse;
    return true;
}

const uint ALONG_X = 0u, ALONG_Z = 1u, FROM_ABOVE = 2u, CLOSING = 3u;  // kinds of billboard; the last and one of the first two

// As sowing/identity.py joins it
uvec2 idOf(uint kind, int plane, int copy, uint number) {
    uint at = uint(copy) & 0x3ffffu;
    return uvec2(at << 18u | number & 0x3ffffu, BLADE_KIND_TRACED << 28u | kind << 25u | (uint(plane) & 0x1fffffu) << 4u | at >> 14u);
}

// The blade of a texel of the level that is shown, or of a coarser one where it has none: its number, and in how many billboards
// to each side it has its root
uvec3 bladeIn(usampler2DArray blades, vec2 uv, int layer, float lod) {
    ivec3 size = textureSize(blades, 0);
    int most = findMSB(min(size.x, size.y)), level = clamp(int(round(lod)), 0, most), row = 0;
    uint found = 0u;
    for (int k = 0; k <= most && found == 0u; k++) {
        ivec2 edge = size.xy >> k;
        ivec2 texel = min(ivec2(uv * vec2(edge)), edge - 1);
        // coarser levels lie below each other in the second half of the layers
        if (k >= level) found = texelFetch(blades, k == 0 ? ivec3(texel, layer) : ivec3(texel.x, row + texel.y, size.z / 2 + layer), 0).r;
        if (k > 0) row += edge.y;
    }
    uint move = (max(found, 1u) - 1u) % 9u;
    return uvec3((max(found, 1u) - 1u) / 9u + 1u, move % 3u, move / 3u);
}

// What is left transparent, at a part of the height, of an upright or a level plane
void fillUp(inout vec4 colour, inout vec4 shape, float rest, bool upright) {
#ifdef FILL_COLOUR
    colour = vec4(mean_material.rgb, 1.0);
    shape = vec4(0.5, upright ? 0.8 : 0.5, 0.0, 0.6);  // as a wall of blades, turned to the viewer as much as up
#else
    // what shows between tips is lit, between roots it is not
    colour.rgb += (1.0 - colour.a) * mix(0.5, 1.0, rest) * mean_material.rgb;
    shape += (1.0 - colour.a) * vec4(0.5, 0.5, 0.5, mix(0.3, 0.9, rest));
    colour.a = 1.0;
#endif
}

// It stands for some `billboards`. `closing` is for the last that a ray meets: an opaque picture of the grass behind it all
void meetSide(inout Traced t, Around a, bool alongX, int plane, vec2 place_m, float above_m, vec2 direction, float depth_m, vec2 share,
              int billboards, bool closing) {
    if (share.x <= 0.0) return;
    vec3 v1 = a.v1 * share.y, v2 = a.v2 * share.y;
#ifdef SHEAR
    float rest = above_m / max(tall_m * a.height * share.y, 1e-6);
#else
    // up the leaning blade to this height
    float b = 2.0 * v1.y, rest = 2.0 * above_m / max(b + sqrt(max(b * b + 4.0 * (v2.y - b) * above_m, 0.0)), 1e-6);
#endif
    // what a ray meets last lies deeper among the blades than where it is followed no farther
    if (closing) rest = mix(0.3, 0.8, min(rest, 1.0));
    if (rest > 1.0) return;
    vec2 lean = toGrid(swayed(v1, v2, rest).xz);
    uvec3 random = hash3(uvec3(uint(plane), alongX ? 1u : 2u, sward.seed));
    int layer = closing ? layers : int(random.x % uint(layers));
    bool mirror = (random.z & 1u) != 0u;
    float along_m = alongX ? place_m.x - lean.x : place_m.y - lean.y;
    float u = (alongX ? in_billboard.x : in_billboard.y) + along_m / billboard_m + unit(random).y;
    vec2 uv = vec2(mirror ? -u : u, rest);
    vec2 size = vec2(textureSize(side_colour, 0).xy);
    // seen aslant a pixel spans more of it across; sharper than that, as other samples are jittered
    float slant = abs(alongX ? direction.y : direction.x) / max(length(direction), 1e-6);
    float lod = log2(max(pixelAt(depth_m) * size.x / billboard_m * inversesqrt(max(slant, 0.06)), 1e-6)) - (closing ? SHARPER + 1.0 : SHARPER);
    vec4 colour = textureLod(side_colour, vec3(uv, layer), lod), shape = textureLod(side_shape, vec3(uv, layer), lod);
    if (closing) {
        fillUp(colour, shape, rest, true);
    } else if (colour.a < 0.004) {
        return;
    } else {
        shape /= max(colour.a, 1e-3);
        float share = colour.a * shareOfTexel(shape.z, share.x, lod);
        colour *= hiddenBy(share, float(billboards) * widened(depth_m)) / colour.a;
    }
    vec2 tilt = clamp(2.0 * shape.xy - 1.0, -1.0, 1.0);
    float outwards = sqrt(max(1.0 - dot(tilt, tilt), 0.0)), flipped = mirror ? -1.0 : 1.0;
    // the same texture from both sides
    vec2 towards = alongX ? vec2(flipped * tilt.x, direction.y > 0.0 ? -outwards : outwards)
                          : vec2(direction.x > 0.0 ? -outwards : outwards, flipped * tilt.x);
    // turned half-way to the viewer: blades face all directions, and the two of the grid would show where one side takes over
    vec2 back = -normalize(fromGrid(direction)), xz = mix(fromGrid(towards), 0.8 * back, 0.5);
    // and what fills the rest wholly: it stands for all that a ray would meet
    if (closing) xz = outwards * back + flipped * tilt.x * vec2(-back.y, back.x);
    over(t, colour, vec3(xz.x, tilt.y, xz.y), (closing ? rest * tall_m : above_m) / max(sward.canopy_m, 1e-3), shape.w);
    if (reached(t, depth_m, lod + SHARPER)) {
        t.rest = rest;
        if (closing) t.coarse = max(t.coarse, FILLED);
#ifndef SHADOW
        int first = alongX ? first_billboard.x : first_billboard.y;
        uvec3 blade = bladeIn(side_blade, vec2(fract(uv.x), uv.y), layer, lod);
        int copy = int(floor(uv.x)) + (mirror ? -first : first) + int(blade.y) - 1;
        t.blade = idOf((alongX ? ALONG_X : ALONG_Z) + (closing ? CLOSING : 0u), plane, copy, blade.x);
#endif
    }
}

// A level plane, which shows grass from above; two of them share what there is of it. The upright ones show the same blades,
// and seen aslant a blade hides about the root of the sum of the squares of what it hides from the side and from above: where
// these are alike, the planes are left with the tangent of half the angle. `unmet` is how far a ray fell without a billboard, of
// the height of the grass: what would have been met on this way then shows on the lowest plane, or wide grids would have bare
// squares.
void meetTop(inout Traced t, Around a, vec2 place_m, float at, float part, float unmet, vec3 ray, float depth_m, vec2 share) {
    // from beneath the upright ones show these blades
    if (share.x <= 0.0 || ray.y >= 0.0) return;
    float far = length(ray), steep = -ray.y / (far + length(ray.xz));
    part = max(part * steep, smoothstep(0.3, 0.8, unmet) * far / max(-ray.y, 0.25 * far) - (1.0 - LOWEST_PART) * steep);
#ifdef CARRIER
    bool closing = at == 0.0;  // the ground plane, which is opaque
#else
    const bool closing = false;
#endif
    vec2 lean = toGrid(swayed(a.v1, a.v2, at).xz) * share.y;
    vec2 uv = in_billboard + (place_m - lean) / billboard_m;
    float lod = log2(max(pixelAt(depth_m) * float(textureSize(top_colour, 0).x) / billboard_m, 1e-6));
    vec4 colour = textureLod(top_colour, vec3(uv, 0.0), lod), shape = textureLod(top_shape, vec3(uv, 0.0), lod);
    if (closing) fillUp(colour, shape, 0.0, false);
    if (colour.a < 0.004) return;
    shape /= max(colour.a, 1e-3);
    // what leans hides more of the ground: blades of the picture lean by about a third of their length themselves
    part *= 1.0 + 2.0 * min(length(a.v2.xz) / tall_m, 1.0);
    float shown = hiddenBy(colour.a * shareOfTexel(shape.z, share.x, lod), part * widened(depth_m));
    vec2 tilt = clamp(2.0 * shape.xy - 1.0, -1.0, 1.0), xz = fromGrid(tilt);
    over(t, colour * (shown / colour.a), vec3(xz.x, sqrt(max(1.0 - dot(tilt, tilt), 0.0)), xz.y), at, shape.w);
    if (reached(t, depth_m, lod)) {
        t.rest = at;
#ifndef SHADOW
        uvec3 blade = bladeIn(top_blade, fract(uv), 0, lod);
        ivec2 copy = ivec2(floor(uv)) + first_billboard + ivec2(blade.yz) - 1;
        t.blade = idOf(FROM_ABOVE, copy.y, copy.x, blade.x);
#endif
    }
}

// Where a plane of the grid stands: not quite evenly, or its rows would show
float standsAt(int plane, uint axis) {
    int of = axis == 1u ? first_cell.x : first_cell.y;
    return (float(plane) + irregular * (unit(hash3(uvec3(uint(plane + of), axis, sward.seed ^ 0x2545f491u))).x - 0.5)) * spacing_m;
}

// Height above the ground; of a ray through a carrier, `shell` holds where it enters and how it falls per depth, and its ground
// is level with the carrier, as published
float highAt(vec3 p_ws, float depth_m, vec2 shell) {
#ifdef CARRIER
    return layer_m + (depth_m - shell.x) * shell.y;
#else
    return p_ws.y - groundUnderneath(p_ws.xz);
#endif
}

// From one depth to another; `on_ground` tells whether the ground is what ends it. Returns the depth at which it left the grass
// upwards, else NOWHERE_M.
float follow(inout Traced t, inout Around a, vec3 eye_rs, vec3 ray, float from, float to, bool on_ground, bool filled, int most, vec2 shell) {
    vec2 direction = toGrid(ray.xz), start = in_cell_m + toGrid(eye_rs.xz), at = start + from * direction;
    direction = mix(direction, vec2(1e-9), equal(direction, vec2(0.0)));
    // the one before may stand on this side of the ray's beginning
    ivec2 plane = ivec2(round(at / spacing_m)), turnedTo = ivec2(sign(direction));
    plane -= turnedTo;
    vec2 next = (vec2(standsAt(plane.x, 1u), standsAt(plane.y, 2u)) - start) / direction;
    for (int k = 0; k < 2; k++) {
        if (next.x <= from) { plane.x += turnedTo.x; next.x = (standsAt(plane.x, 1u) - start.x) / direction.x; }
        if (next.y <= from) { plane.y += turnedTo.y; next.y = (standsAt(plane.y, 2u) - start.y) / direction.y; }
    }
    vec3 p_ws = view.origin_ws.xyz + eye_rs + ray * from;
    float before = from, above = highAt(p_ws, from, shell);
    vec2 share = shareAt(p_ws, a);
    int second = max(most / 2, 1), leap = 1;
#ifndef CARRIER
    // where there are more billboards along the ray than steps, each of the second half of the steps leaps over some
    float planes = on_ground ? (to - from) * (abs(direction.x) + abs(direction.y)) / spacing_m : 0.0;
    leap = max(int(ceil((planes - float(most - second)) / float(second))), 1);
#endif
    for (int k = 0; k < most; k++) {
        int billboards = k < most - second ? 1 : leap;
        bool acrossX = next.x < next.y;  // a plane of one x, on which z runs
        float depth_m = min(min(next.x, next.y), to);
        bool last = depth_m >= to;
        p_ws = view.origin_ws.xyz + eye_rs + ray * depth_m;
        float high = last && on_ground ? 0.0 : highAt(p_ws, depth_m, shell);
        share = shareAt(p_ws, a);
        if (t.depth_m == NOWHERE_M) bendUnderForces(a, p_ws);
#ifdef MIDDLE_PLANE
#ifdef CARRIER
        float middle = 0.5 * tall_m * a.height * share.y;
#else
        float middle = 0.5 * a.v2.y * share.y;
#endif
        if ((above - middle) * (high - middle) < 0.0) {
            float there = mix(before, depth_m, (above - middle) / (above - high));
            meetTop(t, a, toGrid(eye_rs.xz) + there * direction, 0.5, 0.5, 0.0, ray, there, share);
        }
#endif
        if (high <= 0.0) {
            float there = mix(before, depth_m, above / max(above - high, 1e-6));
            meetTop(t, a, toGrid(eye_rs.xz) + there * direction, 0.0, LOWEST_PART, above / max(tall_m * a.height * share.y, 1e-3), ray, there, share);
            return NOWHERE_M;
        }
        if (last) return NOWHERE_M;
        if (high > layer_m && high > above) return depth_m;
        meetSide(t, a, !acrossX, acrossX ? first_cell.x + plane.x : first_cell.y + plane.y, toGrid(eye_rs.xz) + depth_m * direction, high, direction,
                 depth_m, share, billboards, filled && k == most - 1 && share.x > 0.3);
#ifdef SHADOW
        if (t.depth_m < NOWHERE_M) return NOWHERE_M;
#elif defined EARLY_EXIT
        if (t.colour.a > 0.99) return NOWHERE_M;
#endif
        if (acrossX) { plane.x += turnedTo.x * billboards; next.x = (standsAt(plane.x, 1u) - start.x) / direction.x; }
        else { plane.y += turnedTo.y * billboards; next.y = (standsAt(plane.y, 2u) - start.y) / direction.y; }
        before = depth_m;
        above = high;
    }
    return NOWHERE_M;
}

// The ray from a point in relative space, to the depth of what is there already
bool trace(uvec2 pixel, vec3 eye_rs, vec3 ray, float end_m, bool on_ground, out Traced t, out Around a) {
    random_threshold = unit(hash3(uvec3(pixel, floatBitsToUint(view.jitter.x)))).x;
    t = Traced(vec4(0.0), vec3(0.0), 0.0, 0.0, NOWHERE_M, uvec2(0u), 0.0, 0.0);
    float nearest_m = range_m.x;
#ifdef FAR
    nearest_m = max(nearest_m, ENDING * sward.blades_m / length(ray));
    if (end_m <= nearest_m) return false;
#endif
    vec3 eye = view.origin_ws.xyz + eye_rs;
    // the source cannot have the camera in the grass; here rays begin there, and go farther
    float above_m = eye.y + ray.y * nearest_m - groundHeight(eye.xz + ray.xz * nearest_m);
    if (above_m < 0.0) return false;  // as rays of a parallel view may
    bool inside = above_m < layer_m;
#ifdef CARRIER
    if (inside) return false;  // as published the viewpoint cannot be in the grass
#endif
    float from = inside ? nearest_m : march(eye, ray, nearest_m, layer_m);
    if (from < range_m.x || from >= min(end_m, range_m.y)) return false;
    vec3 entry = eye + ray * from;
    if (distance(entry, view.camera_ws.xyz) > sward.reach_m) return false;
    vec3 slope = groundNormal(entry.xz);
    if (slope.y < STEEPEST || slopeShare(slope.y) <= 0.0) return false;
    a = around(entry);
    a.dense *= slopeShare(slope.y);
#ifdef CARRIER
    vec2 shell = vec2(from, ray.y + dot(slope.xz, ray.xz) / slope.y);
    if (shell.y >= -1e-5) return false;
    follow(t, a, eye_rs, ray, from, from - layer_m / shell.y, true, true, steps, shell);
    return t.depth_m < (on_ground ? NOWHERE_M : end_m);
#endif
#ifdef SHADOW
    follow(t, a, eye_rs, ray, from, NOWHERE_M, false, false, steps, vec2(0.0));
    return t.depth_m < NOWHERE_M;
#endif
    if (!on_ground) {
        follow(t, a, eye_rs, ray, from, end_m, false, inside, FARTHER * steps, vec2(0.0));
        return t.depth_m < NOWHERE_M;
    }
    // where it came down through the tips for the last time; between tips it may go far before that
    vec3 under = groundNormal((eye + ray * end_m).xz);
    float down = end_m - layer_m / max(-(ray.y + dot(under.xz, ray.xz) / under.y), 1e-4);
    bool through = inside || down - from > 0.5 * (end_m - down) + 4.0 * spacing_m;
    float left = follow(t, a, eye_rs, ray, from, end_m, true, true, through ? FARTHER * steps : steps, vec2(0.0));
    if (left < NOWHERE_M) {
        // where it comes down through the tips again, which may be far from where it left them
        down = march(eye, ray, left, layer_m);
        vec3 again = eye + ray * down;
        if (down >= left && down < end_m && distance(again, view.camera_ws.xyz) < sward.reach_m) {
            Around other = around(again);
            other.dense *= under.y < STEEPEST ? 0.0 : slopeShare(under.y);
            bool first = t.depth_m == NOWHERE_M;
            follow(t, other, eye_rs, ray, down, end_m, true, true, steps, vec2(0.0));
            if (first) a = other;
        }
    }
    return t.depth_m < NOWHERE_M;
}
