// SPDX-License-Identifier: MIT
// One sample of a chunk; its position is the same in chunks of all levels.

#ifdef FROM_DEVICE
// a vertex of GpuTriangulator: see DeviceMesh
layout(std430, binding = 0) readonly buffer Places { ivec4 places[]; };
layout(std430, binding = 1) readonly buffer Offsets { float offsets[]; };
layout(std430, binding = 2) readonly buffer Heights { int heights[]; };
layout(location = 0) uniform uvec4 device;  // first of the roots' places, of the roots' offsets; whether vertices morph
#else
layout(location = 0) in int height;  // quanta

// per chunk: see ChunkAttributes
layout(location = 1) in ivec4 corner;  // lattice index minus the eye's: x high, low, y high, low
layout(location = 2) in ivec4 numbers;  // xy: finest spacings between samples: high, low part;
                                        // z: sample 0's vertex, w: its offset, or -1

// metres, of the samples of morphing chunks
layout(std430, binding = 0) readonly buffer Offsets { float offsets[]; };
#endif

out vec3 p_eye;

#ifdef MARKED
#ifdef FROM_DEVICE
layout(std430, binding = 3) readonly buffer Marks { uint chunk_marks[]; };
#else
layout(location = 3) in vec4 mark;  // per chunk: see ground_mark.frag
#endif

flat out vec4 chunk_mark;
#endif

invariant gl_Position;

const int kSamples = 129;

void main() {
#ifdef FROM_DEVICE
    uint id = uint(gl_VertexID);
    bool is_root = id >= 0x80000000u;
    uint vertices = is_root ? uint(kSamples * kSamples) : 289u;  // of a place
    uint number = (id & 0x7fffffffu) / vertices, at = (id & 0x7fffffffu) - number * vertices;
    uint place = 3u * (is_root ? device.x + number : number);
    ivec4 corner = places[place], more = places[place + 1u];
    int side = is_root ? kSamples : 17;
    int row = int(at) / side, column = int(at) - row * side;
    // the roots' offsets are of even samples
    uint offset_at = is_root ? device.y + 4225u * number + uint(row / 2 * 65 + column / 2) : id;
    float offset = device.z != 0u ? offsets[offset_at] : 0.0;
    if (!is_root) {
        column += more.w % 8 * 16;
        row += more.w / 8 * 16;
    }
    int height = heights[more.z + row * kSamples + column];
    ivec2 stride = more.xy;
#ifdef MARKED
    vec4 mark = unpackUnorm4x8(chunk_marks[places[place + 2u].x]);
#endif
#else
    int index = gl_VertexID - numbers.z;
    int row = index / kSamples;
    int column = index - row * kSamples;
    float offset = numbers.w < 0 ? 0.0 : offsets[numbers.w + index];
    ivec2 stride = numbers.xy;
#endif
    precise vec3 place_eye = vec3(lattice_place(corner.x, corner.y, column, stride),
                                  lattice_place(corner.z, corner.w, row, stride),
                                  lattice_rise(height)) - frame.remainder.xyz;
    // added last, so that samples that do not morph keep their bits
    place_eye.z += offset;
    p_eye = place_eye;
#ifdef MARKED
    chunk_mark = mark;
#endif
    gl_Position = frame.clip_from_eye * vec4(place_eye, 1.0);
}
