// SPDX-License-Identifier: MIT
#include "ground/cell_lines.h"

#include <algorithm>
#include <cmath>

namespace terrane {

// A point over a cell, its closed edges included: metres from its south-west corner.
struct Ground::Place {
    std::int64_t column, row;
    double x, y;
};

// Whether the cell is ground, or not known. The triangle that the point lies over is chosen by addresses,
// not by jumps: which one it is cannot be foreseen, and a jump that was foreseen wrongly costs more than
// all the sums here.
inline bool Ground::height_over(const Place& place, HeightAnswer& answer) const {
    if (!is_in_extent(place.column, place.row)) return false;
    const Chunk* const chunk = find_chunk(place.column, place.row);
    if (chunk == nullptr) {
        answer.status = GroundStatus::not_resident;
        return true;
    }
    const auto i = static_cast<std::size_t>(place.column & (kChunkCells - 1));
    const auto j = static_cast<std::size_t>(place.row & (kChunkCells - 1));
    const std::size_t cell = j * kChunkCells + i;
    if (!chunk->cell_flags.empty()) {
        const std::uint8_t flags = chunk->cell_flags[cell];
        if ((flags & cell_outside) != 0) return false;
        answer.filled = (flags & cell_filled) != 0;
    }
    const double u = std::min(1.0, place.x / spacing_);
    const double v = std::min(1.0, place.y / spacing_);
    const bool cut = cut_to_north_east(place.column, place.row);
    // whether it is the triangle at the southern side, and at the eastern one
    const bool is_south = (cut & (u >= v)) | (!cut & (u + v <= 1.0));
    const bool is_east = is_south == cut;
    const std::size_t north = std::size_t{!is_south} * kChunkSamples;
    const std::size_t east = std::size_t{is_east};
    const std::int32_t* const corner = &chunk->heights[j * kChunkSamples + i];
    const auto rise_of = [&](std::size_t to, std::size_t from) {
        return quantum_ * (static_cast<double>(corner[to]) - static_cast<double>(corner[from]));
    };
    const double slope_x = rise_of(north + 1, north);
    const double slope_y = rise_of(east + kChunkSamples, east);
    // from the south-west corner, or where the triangle has none of it, from the north-east one
    const auto far = static_cast<double>(!is_south & !cut);
    const double to_north_east = rise_of(1, 0) + rise_of(kChunkSamples + 1, 1);
    const double rise = far * to_north_east + slope_x * (u - far) + slope_y * (v - far);
    answer.status = GroundStatus::ok;
    answer.height = quantum_ * static_cast<double>(*corner) + rise;
    const Eigen::Vector3d up(-slope_x / spacing_, -slope_y / spacing_, 1.0);
    answer.normal = up / up.norm();
    answer.error_m = static_cast<double>(chunk->cell_bounds[cell]);
    return true;
}

HeightAnswer Ground::height(double x, double y) const {
    HeightAnswer answer;
    if (!extent_.contains(x, y)) {
        if (std::isfinite(x) && std::isfinite(y)) answer.status = GroundStatus::outside;
        return answer;
    }
    answer.status = GroundStatus::outside;
    const std::int64_t column = columns_.last_up_to(x);
    const std::int64_t row = rows_.last_up_to(y);
    const auto over = [&](std::int64_t before_x, std::int64_t before_y) -> Place {
        return {column - before_x, row - before_y, x - columns_.at(column - before_x),
                y - rows_.at(row - before_y)};
    };
    const Place place = over(0, 0);
    if (height_over(place, answer)) return answer;
    // cells are closed: on a line the cell before it answers where the one behind it is no ground
    const bool is_on_column = place.x == 0.0, is_on_row = place.y == 0.0;
    if (is_on_column && height_over(over(1, 0), answer)) return answer;
    if (is_on_row && height_over(over(0, 1), answer)) return answer;
    if (is_on_column && is_on_row) height_over(over(1, 1), answer);
    return answer;
}

}  // namespace terrane
