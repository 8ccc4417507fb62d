// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A rectangle of samples, metres from the store's base, repeated beyond the raster's edge.
struct RasterPatch {
    std::int64_t column = 0, row = 0;  ///< of the south-western sample
    int columns = 0, rows = 0;
    std::vector<double> samples;

    double at(std::int64_t c, std::int64_t r) const {
        return samples[static_cast<std::size_t>(r - row) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(c - column)];
    }
    /// Second differences over a sample's neighbours.
    double bend_x(std::int64_t c, std::int64_t r) const {
        return at(c - 1, r) - 2.0 * at(c, r) + at(c + 1, r);
    }
    double bend_y(std::int64_t c, std::int64_t r) const {
        return at(c, r - 1) - 2.0 * at(c, r) + at(c, r + 1);
    }
    /// South-west - south-east - north-west + north-east of a raster cell.
    double twist(std::int64_t c, std::int64_t r) const {
        return at(c, r) - at(c + 1, r) - at(c, r + 1) + at(c + 1, r + 1);
    }
};

}  // namespace terrane::internal
