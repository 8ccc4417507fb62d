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
    const int at = 2 * int(along) + 1;
    visit_vertex(a.chunk, side == kEast ? 128 : at, side == kEast ? at : 128, 1, own_side_key(a.chunk, side, along),
                 side_bound(a.chunk, side, along));
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
