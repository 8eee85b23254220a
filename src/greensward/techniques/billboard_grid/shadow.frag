// The depth that was traced, into a shadow map.
uniform sampler2D traced;

void main() {
    gl_FragDepth = texelFetch(traced, ivec2(gl_FragCoord.xy) / COARSER, 0).r;
    if (gl_FragDepth >= 1.0) discard;
}
