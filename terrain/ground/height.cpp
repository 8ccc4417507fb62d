// SPDX-License-Identifier: MIT
#include "ground/cell_height.h"
#include "ground/cell_lines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace terrane {

// A point of a closed cell: metres from its south-west corner, and in the world.
struct Ground::CellPoint {
    std::int64_t column, row;
    double x, y;
    double x_world, y_world;
};

namespace {

// The highest of a heightfield's answer, if it is not replaced, and of the triangles of a joined solid.
void answer_from_solid(const SolidSurface& solid, bool is_replaced, double x, double y,
                       double at_most, HeightAnswer& answer) {
    const bool has_field = !is_replaced && answer.height <= at_most;
    const std::optional<SolidSurface::Hit> hit = solid.highest(x, y, at_most);
    // The solid has copies of triangles beside replaced ones: the heightfield answers ties, to rounding.
    const double rounding = 1e-14 * (1.0 + std::abs(answer.height));
    if (hit && !(has_field && answer.height >= hit->t - rounding)) {
        answer.height = hit->t;
        answer.normal = solid.normal(hit->triangle);
        // A clipped triangle has the error of its cell.
        answer.error_m = std::max(answer.error_m, solid.error_m(hit->triangle));
        answer.filled = false;
    } else if (!has_field) {
        answer = {.status = GroundStatus::miss};
    }
}

}  // namespace

// Returns false if the cell is no ground; true with an answer, or with not_resident.
inline bool Ground::height_over(const CellPoint& point, double at_most,
                                HeightAnswer& answer) const {
    if (!is_in_extent(point.column, point.row)) return false;
    const Chunk* const chunk = find_chunk(point.column, point.row);
    if (chunk == nullptr) {
        answer.status = GroundStatus::not_resident;
        return true;
    }
    const auto i = static_cast<std::size_t>(point.column & (kChunkCells - 1));
    const auto j = static_cast<std::size_t>(point.row & (kChunkCells - 1));
    const std::size_t cell = j * kChunkCells + i;
    if (!chunk->cell_flags.empty()) {
        const std::uint8_t flags = chunk->cell_flags[cell];
        if ((flags & cell_outside) != 0) return false;
        answer.filled = (flags & cell_filled) != 0;
    }
    const double u = std::min(1.0, point.x / spacing_);
    const double v = std::min(1.0, point.y / spacing_);
    const internal::CellHeight found =
        internal::height_in_cell(&chunk->heights[j * kChunkSamples + i], u, v,
                                 cut_to_north_east(point.column, point.row), quantum_);
    answer.status = GroundStatus::ok;
    answer.height = found.height;
    answer.normal = found.normal(spacing_);
    answer.error_m = static_cast<double>(chunk->cell_bounds[cell]);
    if (chunk->solid != nullptr) {
        answer_from_solid(*chunk->solid, chunk->solid->is_replaced(cell, !found.is_south),
                          point.x_world, point.y_world, at_most, answer);
    } else if (!(answer.height <= at_most)) {
        answer = {.status = GroundStatus::miss};
    }
    return true;
}

HeightAnswer Ground::height(double x, double y) const {
    return height_at_most(x, y, std::numeric_limits<double>::infinity());
}

HeightAnswer Ground::height_below(double x, double y, double z) const {
    if (std::isnan(z)) return {};
    return height_at_most(x, y, z);
}

inline HeightAnswer Ground::height_at_most(double x, double y, double at_most) const {
    HeightAnswer answer;
    if (!extent_.contains(x, y)) {
        if (std::isfinite(x) && std::isfinite(y)) answer.status = GroundStatus::outside;
        return answer;
    }
    answer.status = GroundStatus::outside;
    const std::int64_t column = columns_.last_up_to(x);
    const std::int64_t row = rows_.last_up_to(y);
    const auto over = [&](std::int64_t before_x, std::int64_t before_y) -> CellPoint {
        return {column - before_x,
                row - before_y,
                x - columns_.at(column - before_x),
                y - rows_.at(row - before_y),
                x,
                y};
    };
    const CellPoint point = over(0, 0);
    if (height_over(point, at_most, answer)) return answer;
    // cells are closed: on a line the western or southern cell answers if the other one is no ground
    const bool is_on_column = point.x == 0.0, is_on_row = point.y == 0.0;
    if (is_on_column && height_over(over(1, 0), at_most, answer)) return answer;
    if (is_on_row && height_over(over(0, 1), at_most, answer)) return answer;
    if (is_on_column && is_on_row) height_over(over(1, 1), at_most, answer);
    return answer;
}

}  // namespace terrane
