// Lists cells and vertices that may have the largest residual error: one group for each area.
layout(local_size_x = 64) in;

// Whether any part of an area may be in view
bool is_in_view(Area a) {
    const uint words = vertex_words(a.chunk);
    const float bound = uintBitsToFloat(vertices[words + kCellBoundsWord + a.area]);
    const uint west = (a.area & 7u) * 16u, south = (a.area >> 3) * 16u;
    const double low_z = origin_quantum.z * double(int(vertices[words + kAreaHeightsWord + 2u * a.area]));
    const double high_z = origin_quantum.z * double(int(vertices[words + kAreaHeightsWord + 2u * a.area + 1u]));
    const vec3 low = vec3(position_of(a.chunk, 0u, west), position_of(a.chunk, 1u, south), float(low_z - eye_spacing.z) - bound);
    const vec3 high = vec3(position_of(a.chunk, 0u, west + 16u), position_of(a.chunk, 1u, south + 16u),
                           float(high_z - eye_spacing.z) + bound);
    const vec3 far = max(abs(low), abs(high));
    const float slack = 1e-6 * (far.x + far.y + far.z);
    for (int plane = 0; plane < 4; ++plane) {
        const vec3 n = planes[plane].xyz;
        if (dot(n, vec3(n.x > 0.0 ? high.x : low.x, n.y > 0.0 ? high.y : low.y, n.z > 0.0 ? high.z : low.z)) < -slack) return false;
    }
    return true;
}

void visit_cells(Area a, uint square) {
    Cells cells;
    if (!find_cells(a, square, cells)) return;
    const uint least = cells.error == kFinestError ? kFinestLeast : kAbsentLeast;
    const bool is_seen = is_in_view(a);
    for (int k = 0; k < 4; ++k) {
        if (!is_seen || !is_cell(cells.word, k)) continue;
        const ivec2 cell = cell_of(cells, k);
        const float bound = bound_of_cell(a.chunk, cell);
        if (cells.error == kFinestError) raise(kFinestMetres, bound);
        vec3 low, high, corner;
        corners_of(a.chunk, cell, low, high, corner);
        const vec3 far = max(abs(low), abs(high));
        const float slack = bound + 1e-5 * (far.x + far.y + far.z);
        const vec3 gap = max(max(low - slack, -high - slack), vec3(0.0));
        // rounded up
        const float ratio = 1.0001 * bound * bound / max(dot(gap, gap), 0.9999 * least_squared());
        if (ratio <= uintBitsToFloat(state[kResiduals + least])) continue;
        if (!add_candidate(kCell, a.chunk, cell.x, cell.y, 1, bound)) raise(cells.error, ratio);
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
