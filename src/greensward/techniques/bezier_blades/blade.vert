// A patch is the record of one blade, 32 of them per instance: one draw of N patches is far slower on llvmpipe.
flat out uint patchRecord;

void main() {
    patchRecord = uint(gl_InstanceID) * 32u + uint(gl_VertexID);
    gl_Position = vec4(0.0);
}
