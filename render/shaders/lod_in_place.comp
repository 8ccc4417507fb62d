// Clears the flags of volumes whose replaced triangles are not all in the mesh, with their corners at their final heights:
// one group for each pin. See are_in_place() of terrain/lod/solid_selection.cpp.
layout(local_size_x = 64) in;

void main() {
    const uint pin = gl_WorkGroupID.x, square = gl_LocalInvocationID.x;
    const uint group = group_of_pin(pin), replaced = replaced_word(pin, square);
    if (replaced == 0u) return;
    const uint slot = slot_of_area(chunk_of_group(group), area_of_pin(pin));
    bool are_in_place = slot != kNone && bit_of(slot, kCentre, square);
    if (are_in_place) {
        const uint word = word_of(area_at(slot), square);
        const ivec2 centre = 2 * ivec2(square & 7u, square >> 3) + 1;
        for (int k = 0; k < 8; ++k) {
            if ((replaced >> k & 1u) == 0u) continue;
            are_in_place = are_in_place && (word >> (k / 2) & 1u) != 0u;
            if (options.y == 0u) continue;
            const ivec2 corners[3] = ivec2[3](centre, centre + kMiddle[k / 2], centre + kCorner[(k + 1) / 2 & 3]);
            for (int i = 0; i < 3; ++i)
                are_in_place = are_in_place && offsets[slot * kAreaOffsets + uint(corners[i].y * 17 + corners[i].x)] == 0.0;
        }
    }
    if (!are_in_place) work[capacity.w + group] = 0u;
}
