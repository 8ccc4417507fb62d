#version 450 core
// SPDX-License-Identifier: MIT
// Shared by all shaders: uniforms of the frame, positions on the lattice, lighting. Positions with the suffix _eye are
// metres from the eye in world axes. Colours are linear until display().

layout(std140, binding = 0) uniform Frame {
    mat4 clip_from_eye;
    vec4 right;      // xyz: half the picture's width at distance 1
    vec4 up;         // xyz: half the picture's height at distance 1
    vec4 forward;    // xyz
    vec4 sun;        // xyz: towards the sun, unit
    vec4 horizon;    // rgb as displayed
    vec4 zenith;     // rgb as displayed
    vec4 remainder;  // xyz: the eye minus its lattice point and quantum, metres
    ivec4 eye_height;  // x high, y low part, quanta
    vec4 grid;  // x spacing, y quantum, z haze per metre, w radians a pixel spans
    vec4 tint;  // x low, y 1 / (high - low), z, w: repeats of fine and coarse noise per metre
    vec4 noise_phase;  // xy: phase of the fine noise at the eye, zw: of the coarse noise, 0 to 1
    vec4 near;  // x: distance of the near plane along forward, y: the water's level above the eye, metres
} frame;

// Positions on the lattice are computed in integers with a single rounding, from the integers of the point and the eye
// only: a point has the same position whatever draws it. Parts of integers: see SplitInteger.
const int kIndexBits = 20;
const int kHeightBits = 16;

// Metres along an axis from the eye's lattice point to the `index`-th sample of a chunk. high, low: the chunk's corner
// relative to the eye's lattice point. stride: between samples, high and low part.
float lattice_place(int high, int low, int index, ivec2 stride) {
    low += index * stride.y;
    int carry = (low + (1 << (kIndexBits - 1))) >> kIndexBits;
    low -= carry << kIndexBits;
    high += index * stride.x + carry;
    precise float metres =
        float(high) * (frame.grid.x * float(1 << kIndexBits)) + float(low) * frame.grid.x;
    return metres;
}

// Metres from the eye's quantum up to a height in quanta.
float lattice_rise(int height) {
    int low = (height & ((1 << kHeightBits) - 1)) - frame.eye_height.y;
    int carry = (low + (1 << (kHeightBits - 1))) >> kHeightBits;
    low -= carry << kHeightBits;
    int high = (height >> kHeightBits) - frame.eye_height.x + carry;
    precise float metres =
        float(high) * (frame.grid.y * float(1 << kHeightBits)) + float(low) * frame.grid.y;
    return metres;
}

// The value of a square of a level in a table (SquareTable in shader.h), or -1. square: relative to the eye's square
int find_entry(isamplerBuffer table, int mask, ivec2 square, int level) {
    uint hash = uint(square.x) * 0x9e3779b1u ^ uint(square.y) * 0x85ebca77u ^
                uint(level) * 0xc2b2ae3du;
    hash ^= hash >> 15;
    for (int place = int(hash) & mask;; place = (place + 1) & mask) {
        ivec4 entry = texelFetch(table, place);
        if (entry.z < 0) return -1;
        if (entry.xyz == ivec3(square, level)) return entry.w;
    }
}

// v rotated by a unit quaternion x, y, z, w.
vec3 rotated(vec4 q, vec3 v) {
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

const vec3 kSunLight = vec3(2.75, 2.40, 1.90);
const vec3 kSkyLight = vec3(0.26, 0.35, 0.52);
const vec3 kGroundLight = vec3(0.16, 0.14, 0.10);

// Diffuse light of sun, sky and surrounding ground.
// towards_sun, upward: components of the normal.
vec3 lit_from(vec3 albedo, float towards_sun, float upward) {
    float sun = max(towards_sun, 0.0);
    float sky = 0.5 + 0.5 * upward;
    return albedo * (kSunLight * sun + mix(kGroundLight, kSkyLight, sky));
}
vec3 lit(vec3 albedo, vec3 normal) {
    return lit_from(albedo, dot(normal, frame.sun.xyz), normal.z);
}

// Tone mapping: a soft shoulder, gamma 2 (cheap), some contrast.
vec3 display(vec3 light) {
    vec3 shown = sqrt(light / (light + 0.80));
    return mix(shown, shown * shown * (3.0 - 2.0 * shown), 0.6);
}

// Glow of the air towards the sun.
vec3 glow(vec3 direction) {
    float towards = max(dot(direction, frame.sun.xyz), 0.0);
    float towards4 = towards * towards * towards * towards;
    float towards16 = towards4 * towards4 * towards4 * towards4;
    float towards48 = towards16 * towards16 * towards16;
    return vec3(1.0, 0.86, 0.62) * (0.10 * towards4 + 0.22 * towards48);
}

// Displayed colour of the sky in a unit direction.
vec3 sky(vec3 direction) {
    float height = max(direction.z, 0.0);
    vec3 colour = mix(frame.horizon.rgb, frame.zenith.rgb, 1.0 - exp(-3.6 * height));
    return colour + glow(direction) * (1.0 - colour);
}

// Displayed colour of a surface seen through haze.
vec3 behind_air(vec3 colour, vec3 p_eye, float distance) {
    vec3 along = p_eye / distance;
    vec3 air = frame.horizon.rgb + glow(along) * (1.0 - frame.horizon.rgb);
    return mix(air, colour, exp2(-frame.grid.z * distance));
}
