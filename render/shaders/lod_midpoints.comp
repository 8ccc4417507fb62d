// Keys of the midpoints of a level's open areas, and of those on sides without an open neighbour: one group for each area.
layout(local_size_x = 64) in;
layout(location = 0) uniform uint level;

// Key of a parent that may be in the area to the south or west
float centre_key(Area a, uint side, uint square) {
    if (side == kSouth ? a.ends_south : a.ends_west) return 0.0;
    return key_beyond(a.chunk, a.area, side, kCentre, square);
}

// Midpoints on the line between two chunks fade with both.
float fade_beside(uint chunk, bool is_chunk_side, uint side) {
    const float own = fade_factor(chunk);
    if (!is_chunk_side) return own;
    const uint other = neighbour_of(chunk, side);
    return is_open(other) ? max_of(own, fade_factor(other)) : own;
}

void find_side(Area a, uint side, uint i) {
    const uint along = (side == kEast ? a.area >> 3 : a.area & 7u) * 8u + i;
    precise float faded = fade_factor(a.chunk) * own_side_key(a.chunk, side, along);
    const uint inside = side == kEast ? i * 8u + 7u : 56u + i;
    const float parent = is_at_border(a.chunk, side) ? key_of_area(a.slot, kCentre, inside) : kNever;
    keys[more_bases.x + a.chunk * 128u + (side == kNorth ? 64u : 0u) + along] = raised(a, faded, parent);
}

void main() {
    const Area a = area_at(state[kLevelAreas + level] + gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x, column = square & 7u, row = square >> 3;
    const uint area_column = a.area & 7u, area_row = a.area >> 3;
    const uint first_column = area_column * 16u, first_row = area_row * 16u;
    const float x = position_of(a.chunk, 0u, first_column + 2u * column);
    const float next_x = position_of(a.chunk, 0u, first_column + 2u * column + 1u);
    const float y = position_of(a.chunk, 1u, first_row + 2u * row);
    const float next_y = position_of(a.chunk, 1u, first_row + 2u * row + 1u);
    const float unit = reach_unit(a.chunk), base = reach_base(a.chunk), width = midpoint_width(a.chunk);
    precise float along_x = own_key_of(a, kAlongX, square, next_x, y, width, unit, base);
    precise float along_y = own_key_of(a, kAlongY, square, x, next_y, width, unit, base);
    along_x = along_x * (row == 0u ? fade_beside(a.chunk, area_row == 0u, kSouth) : fade_factor(a.chunk));
    along_y = along_y * (column == 0u ? fade_beside(a.chunk, area_column == 0u, kWest) : fade_factor(a.chunk));
    const float own = key_of_area(a.slot, kCentre, square);
    const float south = row == 0u ? centre_key(a, kSouth, 56u + column) : key_of_area(a.slot, kCentre, square - 8u);
    const float west = column == 0u ? centre_key(a, kWest, row * 8u + 7u) : key_of_area(a.slot, kCentre, square - 1u);
    keys[a.slot * kAreaKeys + 64u + square] = raised(a, along_x, max_of(own, south));
    keys[a.slot * kAreaKeys + 128u + square] = raised(a, along_y, max_of(own, west));
    if (square < 8u && area_column == 7u && !is_open(neighbour_of(a.chunk, kEast))) find_side(a, kEast, square);
    if (square < 8u && area_row == 7u && !is_open(neighbour_of(a.chunk, kNorth))) find_side(a, kNorth, square);
}
