// A lower bound of the residual errors of cells, which spares the exact errors of nearly all: one group for each listed
// area. The error of a cell is at least that at its corner, if the corner is in view.
layout(local_size_x = 64) in;
shared uint most;

void main() {
    const Area a = area_of_cells();
    if (gl_LocalInvocationID.x == 0u) most = 0u;
    barrier();
    Cells cells;
    if (find_cells(a, gl_LocalInvocationID.x, cells)) {
        for (int k = 0; k < 4; ++k) {
            if (!is_cell(cells.word, k)) continue;
            const ivec2 cell = cell_of(cells, k);
            vec3 low, high, corner;
            corners_of(a.chunk, cell, low, high, corner);
            const float margin = 1e-5 * (abs(corner.x) + abs(corner.y) + abs(corner.z));
            bool is_in_view = true;
            for (int plane = 0; plane < 4; ++plane) is_in_view = is_in_view && dot(planes[plane].xyz, corner) > margin;
            if (!is_in_view) continue;
            const float bound = bound_of_cell(a.chunk, cell);
            atomicMax(most, floatBitsToUint(0.9999 * bound * bound / max(dot(corner, corner), least_squared())));
        }
    }
    barrier();
    if (gl_LocalInvocationID.x != 0u || most == 0u) return;
    const uint error = level_of(a.chunk) == options.z ? kFinestLeast : kAbsentLeast;
    if (most > state[kResiduals + error]) atomicMax(state[kResiduals + error], most);
}
