// SPDX-License-Identifier: MIT
// One sample of a chunk; its position is the same in chunks of all levels.

layout(location = 0) in int height;  // quanta

// per chunk: see ChunkAttributes
layout(location = 1) in ivec4 corner;  // lattice index minus the eye's: x high, low, y high, low
layout(location = 2) in ivec4 numbers;  // xy: finest spacings between samples: high, low part;
                                        // z: sample 0's vertex, w: its offset, or -1

// metres, of the samples of morphing chunks
layout(std430, binding = 0) readonly buffer Offsets { float offsets[]; };

out vec3 p_eye;

#ifdef MARKED
layout(location = 3) in vec4 mark;  // per chunk: see ground_mark.frag

flat out vec4 chunk_mark;
#endif

invariant gl_Position;

const int kSamples = 129;

void main() {
    int index = gl_VertexID - numbers.z;
    int row = index / kSamples;
    int column = index - row * kSamples;
    float offset = numbers.w < 0 ? 0.0 : offsets[numbers.w + index];
    precise vec3 place_eye = vec3(lattice_place(corner.x, corner.y, column, numbers.xy),
                                  lattice_place(corner.z, corner.w, row, numbers.xy),
                                  lattice_rise(height)) - frame.remainder.xyz;
    // added last, so that samples that do not morph keep their bits
    place_eye.z += offset;
    p_eye = place_eye;
#ifdef MARKED
    chunk_mark = mark;
#endif
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
