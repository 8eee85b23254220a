// Temporal anti-aliasing: this frame's sample blended into the history, reprojected along the motion of its surfaces
// (Karis 2014, "High-Quality Temporal Supersampling"; Salvi 2016, "An Excursion in Temporal Supersampling").
// A pixel of the history holds its colour after the tone curve, and how many frames that is the average of.
#include "shaders/gbuffer.glsl"
#include "layout/Light"

uniform sampler2D latest;
uniform sampler2D history;

// The history stands for at most so many frames: where its texels fall on those of the picture, and where they fall
// between, since each such step blurs it a little
const float MOST_FRAMES = 16.0, MOST_RESAMPLED = 3.0;
// How far from the mean about a pixel the history may lie, in standard deviations: where nothing moves, a thin blade
// that this sample missed may stay
const float REACH_STILL = 2.0, REACH_MOVING = 1.0, MOVING_PX = 0.5;

vec3 toYCoCg(vec3 c) {
    return vec3(dot(c, vec3(0.25, 0.5, 0.25)), 0.5 * (c.r - c.b), dot(c, vec3(-0.25, 0.5, -0.25)));
}

vec3 fromYCoCg(vec3 c) { return vec3(c.x - c.z + c.y, c.x + c.z, c.x - c.z - c.y); }

// Weights of the four texels around a point, `f` beyond the second (Catmull & Rom 1974): sharp where bilinear blurs
vec4 catmullRom(float f) {
    return vec4(
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f)
    );
}

// The sixteen texels in nine fetches: the middle two of each row and column by the sampler's own interpolation
vec3 historyAt(vec2 at_px) {
    vec2 second = floor(at_px - 0.5) + 0.5, f = at_px - second;
    vec4 wx = catmullRom(f.x), wy = catmullRom(f.y);
    vec3 weightX = vec3(wx.x, wx.y + wx.z, wx.w), weightY = vec3(wy.x, wy.y + wy.z, wy.w);
    vec3 x = (second.x + vec3(-1.0, wx.z / weightX.y, 2.0)) * view.size_px.z;
    vec3 y = (second.y + vec3(-1.0, wy.z / weightY.y, 2.0)) * view.size_px.w;
    vec3 sum = vec3(0.0);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            sum += weightX[column] * weightY[row] * textureLod(history, vec2(x[column], y[row]), 0.0).rgb;
    return sum;
}

// How far a colour lies from a mean, in units of the reach about it: above 1 it is outside
float outside(vec3 c, vec3 mean, vec3 reach) {
    vec3 far = abs(c - mean) / max(reach, 1e-4);
    return max(far.x, max(far.y, far.z));
}

// Pixels since the frame before. Around objects and single blades, the background takes the motion of the nearest
// surface beside it, which so carries its edge along; in the sward blades cross, and each pixel of grass has its own.
vec2 motionAbout(ivec2 pixel, ivec2 last) {
    ivec2 nearest = pixel;
    float nearest_m = depthAt(pixel);
    for (int i = 0; i < 9 && classAt(pixel) != CLASS_GRASS; i++) {
        ivec2 beside = clamp(pixel + ivec2(i % 3, i / 3) - 1, ivec2(0), last);
        float depth_m = depthAt(beside);
        if (depth_m < nearest_m) {
            nearest_m = depth_m;
            nearest = beside;
        }
    }
    if (classAt(nearest) != CLASS_SKY) return texelFetch(gbuffer_motion, nearest, 0).rg;
    vec4 previousClip = view.previous_clip_from_relative * vec4(rayThrough(pixel), 0.0);
    return packMotion(vec2(pixel) + 0.5, previousClip);
}

bool shade(ivec2 pixel, out vec4 result[TARGETS]) {
    vec3 c = texelFetch(latest, pixel, 0).rgb;
    result[0] = vec4(c, 1.0);
    if (light.sample_index == 0) return true;  // the history holds anything, infinities too
    ivec2 last = ivec2(view.size_px.xy) - 1;
    vec2 motion = motionAbout(pixel, last), before = vec2(pixel) + 0.5 - motion;
    // not a number either, of a surface that was where no camera sees
    if (!all(greaterThanEqual(before, vec2(0.0))) || !all(lessThan(before, view.size_px.xy))) return true;

    vec3 mean = vec3(0.0), squares = vec3(0.0);
    for (int i = 0; i < 9; i++) {
        vec3 beside = toYCoCg(texelFetch(latest, clamp(pixel + ivec2(i % 3, i / 3) - 1, ivec2(0), last), 0).rgb);
        mean += beside / 9.0;
        squares += beside * beside / 9.0;
    }
    float deviations = mix(REACH_STILL, REACH_MOVING, smoothstep(0.0, MOVING_PX, length(motion)));
    vec3 reach = deviations * sqrt(max(squares - mean * mean, 0.0));
    vec3 old = toYCoCg(historyAt(before));
    float excess = max(outside(old, mean, reach), 1.0);
    old = mean + (old - mean) / excess;  // clipped towards the mean

    vec2 between = abs(fract(before) - 0.5) * 2.0;  // 0 on a texel, 1 midway
    float blur = max(between.x, between.y);
    float most = mix(MOST_FRAMES, MOST_RESAMPLED, sqrt(blur * (2.0 - blur)));
    float frames = min(texelFetch(history, ivec2(before), 0).a, most - 1.0) / (excess * excess);
    result[0] = vec4(max(mix(fromYCoCg(old), c, 1.0 / (frames + 1.0)), 0.0), frames + 1.0);
    return true;
}
