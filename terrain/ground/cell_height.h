// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>

namespace terrane::internal {

/// The triangle of a cell over a point of it.
struct CellHeight {
    double height;            ///< world z, metres
    double slope_x, slope_y;  ///< rise along one cell, metres
    bool is_south;            ///< the triangle contains the cell's southern edge

    /// Unit, upwards.
    Eigen::Vector3d normal(double spacing) const {
        const Eigen::Vector3d up(-slope_x / spacing, -slope_y / spacing, 1.0);
        return up / up.norm();
    }
};

/// Selects the triangle without branches: which one it is cannot be predicted, and a misprediction costs more than the
/// arithmetic here.
///
/// @param south_west   sample of the cell's south-west corner in Chunk::heights
/// @param u, v         place in the cell from that corner, 0 to 1
/// @param cut          cut_to_north_east() of the cell
inline CellHeight height_in_cell(const std::int32_t* south_west, double u, double v, bool cut,
                                 double quantum) {
    // whether the triangle contains the southern edge, and the eastern one
    const bool is_south = (cut & (u >= v)) | (!cut & (u + v <= 1.0));
    const bool is_east = is_south == cut;
    const std::size_t north = std::size_t{!is_south} * kChunkSamples;
    const std::size_t east = std::size_t{is_east};
    const auto rise_of = [&](std::size_t to, std::size_t from) {
        return quantum *
               (static_cast<double>(south_west[to]) - static_cast<double>(south_west[from]));
    };
    const double slope_x = rise_of(north + 1, north);
    const double slope_y = rise_of(east + kChunkSamples, east);
    // from the south-west corner, or from the north-east one where the triangle lacks the former
    const auto far = static_cast<double>(!is_south & !cut);
    const double to_north_east = rise_of(1, 0) + rise_of(kChunkSamples + 1, 1);
    const double rise = far * to_north_east + slope_x * (u - far) + slope_y * (v - far);
    return {quantum * static_cast<double>(*south_west) + rise, slope_x, slope_y, is_south};
}

}  // namespace terrane::internal
