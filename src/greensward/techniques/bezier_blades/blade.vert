// A patch is one blade: which one, from the chunk of this instance.
layout(std430, binding = 2) readonly buffer Chunks { uvec2 chunks[]; };

out uint patchBlade;  // 0xffffffff beyond the end of the chunk

void main() {
    uvec2 chunk = chunks[gl_InstanceID];
    patchBlade = uint(gl_VertexID) < chunk.y ? chunk.x + uint(gl_VertexID) : 0xffffffffu;
    gl_Position = vec4(0.0);
}
