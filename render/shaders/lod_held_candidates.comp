// Lists the held vertices: one group for each area that has any.
layout(local_size_x = 64) in;

void visit_own(Area a, uint square, uint kind, int to_x, int to_y) {
    const int column = int(a.area & 7u) * 16 + 2 * int(square & 7u) + to_x;
    const int row = int(a.area >> 3) * 16 + 2 * int(square >> 3) + to_y;
    const float width = kind == kCentre ? centre_width(a.chunk) : midpoint_width(a.chunk);
    const float own = own_key_of(a, kind, square, position_of(a.chunk, 0u, uint(column)), position_of(a.chunk, 1u, uint(row)),
                                 width, reach_unit(a.chunk), reach_base(a.chunk));
    visit_vertex(a.chunk, column, row, 1, own, upper_half_at(vertex_words(a.chunk) + a.area * kAreaWords + 32u * kind, square));
}

void visit_side(Area a, uint side, uint i) {
    const uint along = (side == kEast ? a.area >> 3 : a.area & 7u) * 8u + i;
    const uint words = vertex_words(a.chunk) + (side == kEast ? kEastWord : kNorthWord);
    const uint column = side == kEast ? 128u : 2u * along + 1u, row = side == kEast ? 2u * along + 1u : 128u;
    const float unit = reach_unit(a.chunk), base = reach_base(a.chunk), inverse = upper_half_at(words, along);
    const float own = own_key(position_of(a.chunk, 0u, column), position_of(a.chunk, 1u, row),
                              over_eye(half_at(words + 32u, along), unit, base),
                              over_eye(half_at(words + 64u, along), unit, base), midpoint_width(a.chunk), inverse);
    visit_vertex(a.chunk, int(column), int(row), 1, own, inverse);
}

void main() {
    const Area a = area_at(work[last_bases.z + gl_WorkGroupID.x]);
    const uint square = gl_LocalInvocationID.x;
    visit_own(a, square, kCentre, 1, 1);
    visit_own(a, square, kAlongX, 1, 0);
    visit_own(a, square, kAlongY, 0, 1);
    if (square < 8u && (a.area & 7u) == 7u && !is_open(neighbour_of(a.chunk, kEast))) visit_side(a, kEast, square);
    if (square < 8u && (a.area >> 3) == 7u && !is_open(neighbour_of(a.chunk, kNorth))) visit_side(a, kNorth, square);
}
