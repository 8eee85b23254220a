// Passes on what the vertex buffer holds of a root, or only its number (Tillman 2013, sections 2.1.2.1 and 2.1.2.2).
#ifdef TEXTURES
out flat uint number;
#else
in uvec4 place, control, tip, habit;

out flat uvec4 rootPlace, rootControl, rootTip, rootHabit;
out flat uint number;
#endif

void main() {
    gl_Position = vec4(0.0);
#ifndef TEXTURES
    rootPlace = place;
    rootControl = control;
    rootTip = tip;
    rootHabit = habit;
#endif
    number = uint(gl_VertexID);
}
