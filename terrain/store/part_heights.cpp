// SPDX-License-Identifier: MIT
#include "part_heights.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

/// The range of chunks of a level that cover an interval of an axis, inside [first, end).
struct ChunkRange {
    std::int32_t first = 0, end = 0;
};

ChunkRange chunks_over(double low, double high, double origin, double side, std::int64_t first,
                       std::int64_t end) {
    const auto index = [&](double place) {
        return static_cast<std::int64_t>(
            std::clamp(place, static_cast<double>(first) - 1.0, static_cast<double>(end) + 1.0));
    };
    const std::int64_t from = std::clamp(index(std::floor((low - origin) / side)), first, end - 1);
    const std::int64_t to = std::clamp(index(std::ceil((high - origin) / side)), from + 1, end);
    return {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
}

std::string text_of(const WorldRect& rect) {
    return std::to_string(rect.west) + ", " + std::to_string(rect.south) + ", " +
           std::to_string(rect.east) + ", " + std::to_string(rect.north);
}

}  // namespace

Result<std::unique_ptr<const PartHeights>> PartHeights::create(
    const HeightSource& base, int level_count, const std::optional<WorldRect>& region) {
    const Lattice& whole = base.lattice();
    if (level_count < 0 || level_count > whole.finest_level + 1) {
        return fail(ErrorCode::invalid_argument,
                    "level_count must be 1 to " + std::to_string(whole.finest_level + 1) +
                        ", or 0 for all, got " + std::to_string(level_count));
    }
    const int finest = level_count == 0 ? whole.finest_level : level_count - 1;
    const int shift = whole.finest_level - finest;
    Lattice lattice = whole;
    lattice.spacing = whole.level_spacing(finest);
    lattice.finest_level = finest;
    WorldRect extent = base.extent();
    if (region) {
        const bool is_rect = region->west < region->east && region->south < region->north;
        if (!is_rect || region->west >= extent.east || region->east <= extent.west ||
            region->south >= extent.north || region->north <= extent.south) {
            return fail(ErrorCode::invalid_argument,
                        "region must be west, south, east, north inside " + text_of(extent) +
                            " m, got " + text_of(*region));
        }
        // Root squares of about the region's size, so that few of them cover it.
        const double side = std::max(region->east - region->west, region->north - region->south);
        int root = 0;
        while (root < finest && whole.level_spacing(root + 1) * kChunkCells >= side) ++root;
        const double root_side = whole.level_spacing(root) * kChunkCells;
        const std::int64_t per_root = std::int64_t{1} << root;
        const ChunkRange x = chunks_over(
            region->west, region->east, whole.origin_x, root_side, whole.first_root_x * per_root,
            (std::int64_t{whole.first_root_x} + whole.root_count_x) * per_root);
        const ChunkRange y = chunks_over(
            region->south, region->north, whole.origin_y, root_side, whole.first_root_y * per_root,
            (std::int64_t{whole.first_root_y} + whole.root_count_y) * per_root);
        lattice.finest_level = finest - root;
        lattice.first_root_x = x.first;
        lattice.first_root_y = y.first;
        lattice.root_count_x = x.end - x.first;
        lattice.root_count_y = y.end - y.first;
        extent.west = std::max(extent.west, lattice.x(lattice.west()));
        extent.south = std::max(extent.south, lattice.y(lattice.south()));
        extent.east = std::min(extent.east, lattice.x(lattice.east()));
        extent.north = std::min(extent.north, lattice.y(lattice.north()));
    }
    if (auto checked = check(lattice); !checked) return tl::unexpected(checked.error());
    return std::unique_ptr<const PartHeights>(new PartHeights(base, lattice, extent, shift));
}

}  // namespace terrane::internal
