// Residual errors of the open areas: one group for each area.
layout(local_size_x = 64) in;

void visit_cells(Area a, uint square) {
    const uint area_column = a.area & 7u, area_row = a.area >> 3;
    const uint child = child_of(a.chunk, area_column / 4u + 2u * (area_row / 4u));
    // chunks with a fade of 0 have an infinite key
    const bool is_absent = child == kNone || isinf(least_key(child));
    const bool is_finest = level_of(a.chunk) == options.z;
    if (!is_absent || !bit_of(a.slot, kCentre, square)) return;
    const uint words = vertex_words(a.chunk);
    const float largest = uintBitsToFloat(vertices[words + kCellBoundsWord + a.area]);
    const uint error = is_finest ? kFinestError : kAbsentError;
    const int west = int(area_column) * 16, south = int(area_row) * 16;
    const double low = origin_quantum.z * double(int(vertices[words + kAreaHeightsWord + 2u * a.area]));
    const double high = origin_quantum.z * double(int(vertices[words + kAreaHeightsWord + 2u * a.area + 1u]));
    const double per_metre =
        ratio_of_box(dvec3(x_over_eye(a.chunk, west), y_over_eye(a.chunk, south), low - eye_spacing.z - double(largest)),
                     dvec3(x_over_eye(a.chunk, west + 16), y_over_eye(a.chunk, south + 16),
                           high - eye_spacing.z + double(largest)));
    if (!(per_metre > 0.0lf)) return;
    const uint word = word_of(a, square);
    for (int k = 0; k < 4; ++k) {
        // a quarter is drawn as a cell if both of its sides are split
        const bool is_cell = (word >> k & 1u) != 0u && (word >> (k + 3 & 3) & 1u) != 0u && (word >> (4 + k) & 1u) == 0u;
        if (!is_cell) continue;
        const int column = west + 2 * int(square & 7u) + (k == 1 || k == 2 ? 1 : 0);
        const int row = south + 2 * int(square >> 3) + (k >= 2 ? 1 : 0);
        const float bound =
            intBitsToFloat(heights[slot_of(a.chunk) * kHeightWords + kSamples + uint(row * 128 + column)]);
        if (is_finest) raise(kFinestMetres, bound);
        if (rounded_up(double(bound) * double(bound) * per_metre) > uintBitsToFloat(state[kResiduals + error]))
            raise(error, rounded_up(ratio_of_square(a.chunk, column, row, 1, double(bound))));
    }
}

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
    const Area a = area_at(gl_WorkGroupID.x);
    const uint square = gl_LocalInvocationID.x;
    visit_cells(a, square);
    if (a.is_held) {
        visit_own(a, square, kCentre, 1, 1);
        visit_own(a, square, kAlongX, 1, 0);
        visit_own(a, square, kAlongY, 0, 1);
    }
    if (square < 8u && (a.area & 7u) == 7u && !is_open(neighbour_of(a.chunk, kEast))) visit_side(a, kEast, square);
    if (square < 8u && (a.area >> 3) == 7u && !is_open(neighbour_of(a.chunk, kNorth))) visit_side(a, kNorth, square);
}
