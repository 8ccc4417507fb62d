#version 450 core
// SPDX-License-Identifier: MIT
// Shared by all shaders: uniforms of the frame, positions on the lattice. Positions with the suffix _eye are metres from
// the eye in world axes.

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
    vec4 waves;  // phases of two layers of waves, 0 to 1
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
