// Keys of the centres of a level's open areas: one group for each area.
layout(local_size_x = 64) in;
layout(location = 0) uniform uint level;

// Key of a midpoint of the parent chunk: column or row 8 are in the adjacent area.
float parent_key(uint parent, uint area, uint kind, uint column, uint row) {
    const uint slot = slot_of_area(parent, area);
    if (column == 8u) {
        if ((area & 7u) == 7u && is_at_border(parent, kEast)) return side_key(parent, kEast, (area >> 3) * 8u + row);
        return key_beyond(parent, area, kEast, kind, row * 8u);
    }
    if (row == 8u) {
        if ((area >> 3) == 7u && is_at_border(parent, kNorth)) return side_key(parent, kNorth, (area & 7u) * 8u + column);
        return key_beyond(parent, area, kNorth, kind, column);
    }
    return slot == kNone ? kAboveFloor : key_of_area(slot, kind, row * 8u + column);
}

void main() {
    const Area a = area_at(state[kLevelAreas + level] + gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x, column = square & 7u, row = square >> 3;
    const uint area_column = a.area & 7u, area_row = a.area >> 3;
    precise float key = own_key_of(a, kCentre, square, position_of(a.chunk, 0u, area_column * 16u + 2u * column + 1u),
                                   position_of(a.chunk, 1u, area_row * 16u + 2u * row + 1u), centre_width(a.chunk), reach_unit(a.chunk),
                                   reach_base(a.chunk));
    const float fade = fade_factor(a.chunk);
    if (fade != 1.0) key = key * fade;
    float from_x, from_y;  // the midpoints of the two sides that bound the quarter
    if (is_root(a.chunk)) {
        const uint west = area_column * 8u, south = area_row * 8u;
        from_x = coarse_key(a.chunk, west + 2u * ((column + 1u) / 2u), south + 2u * (row / 2u) + 1u);
        from_y = coarse_key(a.chunk, west + 2u * (column / 2u) + 1u, south + 2u * (row / 2u + row % 2u));
    } else {
        const uint parent = parent_of(a.chunk);
        const uint above = ((is_north_child(a.chunk) ? 4u : 0u) + area_row / 2u) * 8u + (is_east_child(a.chunk) ? 4u : 0u) +
                           area_column / 2u;
        const uint first_column = area_column % 2u * 4u, first_row = area_row % 2u * 4u;
        from_x = parent_key(parent, above, kAlongY, first_column + (column + 1u) / 2u, first_row + row / 2u);
        from_y = parent_key(parent, above, kAlongX, first_column + column / 2u, first_row + row / 2u + row % 2u);
    }
    keys[a.slot * kAreaKeys + square] = raised(a, key, max_of(from_x, from_y));
}
