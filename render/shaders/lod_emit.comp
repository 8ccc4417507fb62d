// Writes the triangles of each open area: one group for each area. A vertex is numbered by its area and its sample there.
layout(local_size_x = 64) in;

void main() {
    const Area a = area_at(gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x, word = stored_word(a.slot, square);
    if (word == kNone) return;
    const uint pin = drawn_pin(a.chunk, a.area);
    const uint before = triangles_before(a.slot, square) - replaced_before(pin, square);
    const uint column = 2u * (square & 7u) + 1u, row = 2u * (square >> 3) + 1u;
    write_square(word, replaced_word(pin, square), a.slot * kAreaOffsets + row * 17u + column, 17, 1,
                 3u * (work[bases.w + a.slot] + before));
}
