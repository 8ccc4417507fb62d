// Squares and number of triangles of each open area: one group for each area.
layout(local_size_x = 64) in;
shared uint masks[18];

void main() {
    const Area a = area_at(gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x, half_index = square >> 5, bit = square & 31u;
    if (square < 18u) masks[square] = 0u;
    barrier();
    if (bit_of(a.slot, kCentre, square)) {
        const uint word = word_of(a, square);
        atomicOr(masks[half_index], 1u << bit);
        for (uint k = 0u; k < 8u; ++k)
            if ((word >> k & 1u) != 0u) atomicOr(masks[2u + 2u * k + half_index], 1u << bit);
    }
    barrier();
    if (square < 18u) work[last_bases.x + 18u * a.slot + square] = masks[square];
    if (square != 0u) return;
    uint total = 4u * (bitCount(masks[0]) + bitCount(masks[1]));
    for (uint k = 2u; k < 10u; ++k) total += bitCount(masks[k]);
    for (uint k = 10u; k < 18u; ++k) total -= 2u * bitCount(masks[k]);
    work[bases.w + a.slot] = total - replaced_before(drawn_pin(a.chunk, a.area), 64u);
    if (total > 0u && is_child_absent(a)) work[last_bases.z + capacity.x + atomicAdd(state[kCellGroups], 1u)] = a.slot;
}
