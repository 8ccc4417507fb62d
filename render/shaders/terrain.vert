// SPDX-License-Identifier: MIT
// One sample of a chunk. Positions are computed in integers up to one rounding, from the integers of the sample and the
// eye only: chunks of all levels give it the same position.

layout(location = 0) in int height;  // quanta

// per chunk: see ChunkAttributes
layout(location = 1) in ivec4 corner;  // lattice index minus the eye's: x high, low, y high, low
layout(location = 2) in ivec4 numbers;  // xy: finest spacings between samples: high, low part;
                                        // z: sample 0's vertex, w: its offset, or -1

// metres, of the samples of morphing chunks
layout(std430, binding = 0) readonly buffer Offsets { float offsets[]; };

out vec3 p_eye;

invariant gl_Position;

const int kSamples = 129;
const int kIndexBits = 20;
const int kHeightBits = 16;

// Metres from the eye's lattice point.
float place(int high, int low, int index) {
    low += index * numbers.y;
    int carry = (low + (1 << (kIndexBits - 1))) >> kIndexBits;
    low -= carry << kIndexBits;
    high += index * numbers.x + carry;
    precise float metres =
        float(high) * (frame.grid.x * float(1 << kIndexBits)) + float(low) * frame.grid.x;
    return metres;
}

float rise() {
    int low = (height & ((1 << kHeightBits) - 1)) - frame.eye_height.y;
    int carry = (low + (1 << (kHeightBits - 1))) >> kHeightBits;
    low -= carry << kHeightBits;
    int high = (height >> kHeightBits) - frame.eye_height.x + carry;
    precise float metres =
        float(high) * (frame.grid.y * float(1 << kHeightBits)) + float(low) * frame.grid.y;
    return metres;
}

void main() {
    int index = gl_VertexID - numbers.z;
    int row = index / kSamples;
    int column = index - row * kSamples;
    float offset = numbers.w < 0 ? 0.0 : offsets[numbers.w + index];
    precise vec3 place_eye = vec3(place(corner.x, corner.y, column), place(corner.z, corner.w, row),
                                  rise()) - frame.remainder.xyz;
    // last addition, so that samples that do not morph keep their bits
    place_eye.z += offset;
    p_eye = place_eye;
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
