// Offsets of the samples of a level's open areas with active centres: one group for each area.
layout(local_size_x = 64) in;
layout(location = 0) uniform uint level;
shared float coarse[81];  // of the even samples, 9 x 9

float rise_of(uint chunk, uint area, uint kind, uint square) {
    const uint words = vertex_words(chunk) + area * kAreaWords;
    precise float rise = float(half_at(words + 288u + 32u * kind, square)) * uintBitsToFloat(vertices[words + 384u]);
    return rise;
}

// Offset of a midpoint on the eastern or northern side, which the adjacent area owns
float side_offset(Area a, uint side, uint i) {
    const float slope = morph_slope();
    const uint column = a.area & 7u, row = a.area >> 3;
    const bool is_east = side == kEast, leaves = is_east ? column == 7u : row == 7u;
    float key, rise;
    if (leaves && is_at_border(a.chunk, side)) {
        const uint along = (is_east ? row : column) * 16u + 2u * i + 1u;
        const uint at = is_east ? along * 129u + 128u : 128u * 129u + along, to = is_east ? 129u : 1u;
        key = side_key(a.chunk, side, along / 2u);
        rise = rise_between(a.chunk, at, at - to, at + to);
    } else {
        const uint owner = leaves ? neighbour_of(a.chunk, side) : a.chunk;
        if (!is_open(owner)) return 0.0;  // not active
        const uint area = is_east ? row * 8u + ((column + 1u) & 7u) : ((row + 1u) & 7u) * 8u + column;
        const uint slot = slot_of_area(owner, area);
        if (slot == kNone) return 0.0;
        const uint kind = is_east ? kAlongY : kAlongX, square = is_east ? i * 8u : i;
        key = key_of_area(slot, kind, square);
        rise = rise_of(owner, area, kind, square);
    }
    const uint end_a = is_east ? i * 9u + 8u : 72u + i;
    return morph_offset(share_less_one(key, slope), rise, coarse[end_a], coarse[is_east ? end_a + 9u : end_a + 1u]);
}

void main() {
    const Area a = area_at(state[kLevelAreas + level] + gl_WorkGroupID.x);
    const uint masks = bases.z + 6u * a.slot;
    if ((work[masks] | work[masks + 1u]) == 0u) return;
    const uint square = gl_LocalInvocationID.x;
    const float slope = morph_slope();
    const uint area_column = a.area & 7u, area_row = a.area >> 3;
    uint first = kNone;
    if (!is_root(a.chunk)) {
        const uint parent = parent_of(a.chunk);
        const uint above = slot_of_area(parent, ((is_north_child(a.chunk) ? 4u : 0u) + area_row / 2u) * 8u +
                                                    (is_east_child(a.chunk) ? 4u : 0u) + area_column / 2u);
        if (above != kNone) first = above * kAreaOffsets + area_row % 2u * 8u * 17u + area_column % 2u * 8u;
    }
    for (uint i = square; i < 81u; i += 64u) {
        const uint column = i % 9u, row = i / 9u;
        if (is_root(a.chunk)) {
            coarse[i] = offsets[more_bases.z + a.chunk * kCoarse + (area_row * 8u + row) * kCoarseSide + area_column * 8u + column];
        } else {
            coarse[i] = first == kNone ? 0.0 : offsets[first + row * 17u + column];
        }
    }
    barrier();
    const uint to = a.slot * kAreaOffsets;
    for (uint i = square; i < 81u; i += 64u) offsets[to + i / 9u * 34u + i % 9u * 2u] = coarse[i];
    const uint column = square & 7u, row = square >> 3, at = row * 9u + column;
    const float low = coarse[at], low_next = coarse[at + 1u], high = coarse[at + 9u], high_next = coarse[at + 10u];
    const uint sample_at = to + row * 34u + column * 2u;
    offsets[sample_at + 1u] = morph_offset(share_less_one(key_of_area(a.slot, kAlongX, square), slope),
                                           rise_of(a.chunk, a.area, kAlongX, square), low, low_next);
    offsets[sample_at + 17u] = morph_offset(share_less_one(key_of_area(a.slot, kAlongY, square), slope),
                                            rise_of(a.chunk, a.area, kAlongY, square), low, high);
    // an even square is cut from its south-western to its north-eastern corner
    const bool rises = ((column + row) & 1u) == 0u;
    offsets[sample_at + 18u] = morph_offset(share_less_one(key_of_area(a.slot, kCentre, square), slope),
                                            rise_of(a.chunk, a.area, kCentre, square), rises ? low : low_next,
                                            rises ? high_next : high);
    if (square < 8u) {
        offsets[to + (2u * square + 1u) * 17u + 16u] = side_offset(a, kEast, square);
    } else if (square < 16u) {
        offsets[to + 16u * 17u + 2u * (square - 8u) + 1u] = side_offset(a, kNorth, square - 8u);
    }
}
