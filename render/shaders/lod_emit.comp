// Writes the triangles of each open area: one group for each area. A vertex is numbered by its area and its sample there.
layout(local_size_x = 64) in;
shared uint sums[64];

void main() {
    const uint slot = gl_WorkGroupID.x;
    const uint square = gl_LocalInvocationID.x;
    const uint word = stored_word(slot, square);
    const uint own = word != kNone ? triangles_of(word) : 0u;
    sums[square] = own;
    barrier();
    for (uint step = 1u; step < 64u; step <<= 1) {
        const uint before = square >= step ? sums[square - step] : 0u;
        barrier();
        sums[square] += before;
        barrier();
    }
    if (word == kNone) return;
    const uint column = 2u * (square & 7u) + 1u, row = 2u * (square >> 3) + 1u;
    write_square(word, slot * kAreaOffsets + row * 17u + column, 17, 1, 3u * (work[bases.w + slot] + sums[square] - own));
}
