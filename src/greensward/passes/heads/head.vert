// Head of a blade: an instance of a mesh whose level of detail follows its size on the screen.
#include "culling/level_of_detail.glsl"
#include "culling/chunks.glsl"
#include "layout/HeadVertex"
#include "shaders/bezier.glsl"

layout(std430) readonly buffer Blades { Blade blades[]; };
layout(std430) readonly buffer Poses { Pose poses[]; };
layout(std430) readonly buffer Heads { uint heads[]; };
layout(std430) readonly buffer Meshes { HeadVertex mesh[]; };
#ifdef FULL_HEIGHT
layout(std430) readonly buffer Sown { Blade sown[]; };
#endif

const ivec2 levels[3] = ivec2[3](LEVELS);  // first vertex and vertices of each, the finest first
const int VERTICES = levels[2].x + levels[2].y;
const float FIRST_FLOWER = 3.0;  // panicle and spike are seed heads

uniform int finest_level;
uniform vec2 level_px;

#ifndef SHADOW
out vec3 position_rs;
out vec3 colour;
out vec3 normal_ws;
out vec4 previousClip;
flat out uint blade;
flat out uint isFlower;

uniform mat4 previous_from_now;  // where a point of what the blade grows on was a frame ago, in relative space
#endif

void main() {
    uint index = heads[chunks[first_chunk + gl_InstanceID].first];
    Blade b = blades[index];
    vec3 root = bladeRoot(b) - view.origin_ws.xyz;
    float away = distance(bladeRoot(b), view.camera_ws.xyz);
    float fade = lodFade(b, away);
    int kindOfGrass = bladeSpecies(b);
    float kind = species(kindOfGrass, MIX).w;
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
#ifdef FULL_HEIGHT
    // the last of a blade to come
    float ripe = smoothstep(0.6, 1.0, b.height / max(sown[index].height * FULL_HEIGHT, 1e-6));
#else
    const float ripe = 1.0;
#endif
    if (fade * ripe <= 0.0) return;

    bool flower = kind >= FIRST_FLOWER;
    float random = bladeRandom(b), other = fract(random * 57.31);
    vec3 v1, v2;
    unpackPose(poses[index].now, root, v1, v2);
    vec3 tip = mix(root, v2, fade);
    float size = mix(species(kindOfGrass, HEAD).w, species(kindOfGrass, HEART).w, other);
    float depth = dot(view.axis_rs.xyz, tip) + view.axis_rs.w;
    float pixel = view.pixel_m.x * max(depth, 0.02) + view.pixel_m.y;
    float thick = flower ? 1.2 : 0.6, breadth = flower ? 1.0 : 0.4;
    // few heads stand for many far away, but a flower must not grow into a cabbage
    float grown = min(pow(max(sownCoverage(away) * view.density, 1e-6), -0.25), flower ? 1.8 : 1.0);
    size = max(size * grown, (flower ? 1.1 : 0.7) * pixel / thick) * fade * ripe;

    int level = max(finest_level, breadth * size > level_px.x * pixel ? 0 : breadth * size > level_px.y * pixel ? 1 : 2);
    if (gl_VertexID >= levels[level].y) return;
    HeadVertex corner = mesh[int(kind) * VERTICES + levels[level].x + gl_VertexID];
    if (corner.normal.xyz == vec3(0.0)) return;  // padding of the mesh

    vec3 up = bladeUp(b), tangent = normalize(v2 - v1);
    vec3 wander = vec3(cos(6.2832 * random), 0.0, sin(6.2832 * random));
    // flowers turn up, each a little to a side of its own; seed heads go on along the stem and nod
    vec3 axis = flower ? normalize(0.5 * tangent + up + (0.15 + 0.75 * other) * wander)
                       : normalize(tangent - 0.12 * up + 0.12 * wander);

    vec3 helper = abs(axis.y) < 0.95 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    vec3 e1 = normalize(cross(helper, axis)), e3 = cross(axis, e1);
    float turn = 6.2832 * fract(random * 13.7);
    mat3 frame = mat3(cos(turn) * e1 + sin(turn) * e3, axis, cos(turn) * e3 - sin(turn) * e1);
    vec3 local = corner.place.xyz * size;
    if (!flower) local.y -= 0.12 * size;
    vec3 offset = frame * local;
    gl_Position = view.jittered_clip_from_relative * vec4(tip + offset, 1.0);
#ifndef SHADOW
    position_rs = tip + offset;
    vec3 previousControl, previousTip;
    unpackPose(poses[index].previous, root, previousControl, previousTip);
    vec4 previous_rs = previous_from_now * vec4(mix(root, previousTip, fade) + offset, 1.0);
    previousClip = view.previous_clip_from_relative * previous_rs;
    normal_ws = frame * corner.normal.xyz;
    float tint = bladeTint(b) - 0.5;
    vec3 paint = corner.place.w > 0.5 ? species(kindOfGrass, HEART).rgb : species(kindOfGrass, HEAD).rgb;
    colour = paint * (1.0 + (flower ? vec3(0.35, 0.7, 0.3) : vec3(0.5)) * tint) * mix(0.8, 1.0, clamp(corner.place.y * 2.0 + 0.3, 0.0, 1.0));
    blade = index;
    isFlower = flower ? 1u : 0u;
#endif
}
