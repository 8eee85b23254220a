// What every technique and pass says of a point that it shows.
struct Surface {
    vec3 baseColour;      // linear, 0 to 1
    float transmittance;  // light let through, relative to what is reflected
    vec3 normal_ws;       // towards the viewer, of any length
    float occlusion;      // 1 open to the sky, 0 closed
    float roughness;
    uint surfaceClass;
    uint bladeNumber;         // 0 where no blade shows
    vec4 previousClip;    // this point of the surface one frame ago, without jitter
};
