// Triangles of the roots' centres of coarser spacings: one group for each root. Counts them, or writes them.
layout(local_size_x = 256) in;
layout(location = 0) uniform bool writes;
const uint kSquares = 1365u;  // of strides 64 to 2, in samples
const uint kEach = 6u;        // squares of an invocation
shared uint sums[256];

bool is_active(uint root, int column, int row) {
    float key;
    if (((column | row) & 1) == 0) {
        key = coarse_key(root, uint(column) / 2u, uint(row) / 2u);
    } else {
        // only centres of the chunk's own spacing are asked for
        const uint slot = slot_of_area(root, uint(row / 16 * 8 + column / 16));
        key = slot == kNone ? kNever : key_of_area(slot, kCentre, uint(row % 16 / 2 * 8 + column % 16 / 2));
    }
    return key < threshold();
}

// The square of a number: strides from coarse to fine, row by row. Returns column, row and stride.
ivec3 square_at(uint number) {
    uint per_side = 1u;
    while (number >= per_side * per_side) {
        number -= per_side * per_side;
        per_side *= 2u;
    }
    const int stride = int(64u / per_side);
    return ivec3(int(number % per_side * 2u + 1u) * stride, int(number / per_side * 2u + 1u) * stride, stride);
}

uint coarse_word(uint root, ivec3 square) {
    uint word = 0u;
    for (int k = 0; k < 4; ++k) {
        const ivec2 middle = square.xy + kMiddle[k] * square.z, quarter = square.xy + kCorner[k] * square.z / 2;
        if (is_active(root, middle.x, middle.y)) word |= 1u << k;
        if (is_active(root, quarter.x, quarter.y)) word |= 16u << k;
    }
    return word;
}

void main() {
    const uint root = gl_WorkGroupID.x, i = gl_LocalInvocationID.x;
    const bool is_undivided = !is_active(root, 64, 64);
    uint words[kEach];
    uint own = 0u;
    for (uint k = 0u; k < kEach; ++k) {
        words[k] = kNone;
        const uint number = i * kEach + k;
        if (number >= kSquares || is_undivided) continue;
        const ivec3 square = square_at(number);
        if (!is_active(root, square.x, square.y)) continue;
        words[k] = coarse_word(root, square);
        own += triangles_of(words[k]);
    }
    sums[i] = own;
    barrier();
    for (uint step = 1u; step < 256u; step <<= 1) {
        const uint before = i >= step ? sums[i - step] : 0u;
        barrier();
        sums[i] += before;
        barrier();
    }
    if (!writes) {
        if (i == 255u) state[kRootTriangles + root] = is_undivided ? 2u : sums[255];
        return;
    }
    const uint first_vertex = 0x80000000u + root * kSamples;
    uint at = 3u * state[kRootTriangles + root];
    if (is_undivided) {
        if (i != 0u) return;
        const uint west = first_vertex, east = first_vertex + 128u, north = 128u * 129u;
        if (is_cut_to_north_east(root)) {
            write_triangle(at, west, east, east + north);
            write_triangle(at, west, east + north, west + north);
        } else {
            write_triangle(at, west, east, west + north);
            write_triangle(at, east, east + north, west + north);
        }
        return;
    }
    at += 3u * (sums[i] - own);
    for (uint k = 0u; k < kEach; ++k) {
        if (words[k] == kNone) continue;
        const ivec3 square = square_at(i * kEach + k);
        write_square(words[k], 0u, first_vertex + uint(square.y * 129 + square.x), 129, square.z, at);
        at += 3u * triangles_of(words[k]);
    }
}
