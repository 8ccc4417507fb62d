// SPDX-License-Identifier: MIT
#include "opening_memory.h"

#include "bounds/bound_tiers.h"
#include "voids/void_map.h"

#include <algorithm>
#include <cstdint>

namespace terrane::internal {
namespace {

/// Sum over levels of half the resolution each.
constexpr double kAllLevels = 4.0 / 3.0;
constexpr double kMebibyte = 1024.0 * 1024.0;

}  // namespace

double opening_bytes(const BilinearGrid& grid, double held_bytes) {
    // Per sample of a strip: as read, twice as a height, packed, and its validity.
    constexpr double kStripSample = 3 * sizeof(double) + sizeof(std::uint32_t) + 1;
    // Per block: intervals on all levels, flags of nodata, fill of voids, amplitude of detail.
    constexpr double kBlock = kAllLevels * 2 * sizeof(double) + 1 + 24 + sizeof(float);
    // Per point of the first tier: height, two bounds, two deviations.
    constexpr double kTierPoint = kAllLevels * (sizeof(double) + 4 * sizeof(float));
    // Windows of samples and points of the threads.
    constexpr double kWindows = 64.0 * kMebibyte;
    const double columns = grid.columns, rows = grid.rows;
    const double blocks =
        (columns / kBlockSide + 1.0) * (rows / kBlockSide + 1.0) + rows / kBlockSide;
    return held_bytes +
           kStripSample * columns * std::min(rows, static_cast<double>(strip_rows(grid.columns))) +
           kBlock * blocks + sizeof(std::size_t) * rows +
           kTierPoint * BoundTiers::first_points(grid) + kWindows;
}

}  // namespace terrane::internal
