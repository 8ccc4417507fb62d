// Lists the cells that may have the largest residual error: one group for each listed area.
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

void main() { visit_cells(area_of_cells(), gl_LocalInvocationID.x); }
