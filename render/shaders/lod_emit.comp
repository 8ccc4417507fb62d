// Writes the triangles of each open area: one group for each area. A vertex is numbered by its area and its sample there.
layout(local_size_x = 64) in;

void main() {
    const uint slot = gl_WorkGroupID.x, square = gl_LocalInvocationID.x;
    const uint word = stored_word(slot, square);
    if (word == kNone) return;
    const uint column = 2u * (square & 7u) + 1u, row = 2u * (square >> 3) + 1u;
    write_square(word, slot * kAreaOffsets + row * 17u + column, 17, 1, 3u * (work[bases.w + slot] + triangles_before(slot, square)));
}
