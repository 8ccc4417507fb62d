// SPDX-License-Identifier: MIT
#include "source/compose/source_pair.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

WorldRect common(const WorldRect& a, const WorldRect& b) {
    return {std::max(a.west, b.west), std::max(a.south, b.south), std::min(a.east, b.east),
            std::min(a.north, b.north)};
}

}  // namespace

Result<void> check_pair(const HeightSource& a, const HeightSource& b) {
    if (!(a.lattice() == b.lattice())) {
        return fail(ErrorCode::invalid_argument,
                    "the sources must have the same lattice, got spacings of " +
                        number_text(a.lattice().spacing) + " and " +
                        number_text(b.lattice().spacing) + " m, or other origins or roots");
    }
    const WorldRect extent = common(a.extent(), b.extent());
    if (extent.west < extent.east && extent.south < extent.north) return {};
    return fail(ErrorCode::invalid_argument, "the extents of the sources do not overlap");
}

SourcePair::SourcePair(std::shared_ptr<const HeightSource> a, std::shared_ptr<const HeightSource> b)
    : HeightSource(a->lattice(), common(a->extent(), b->extent())),
      a_(std::move(a)),
      b_(std::move(b)) {}

WorldRect SourcePair::square_around(const SampleGrid& grid, std::int64_t steps_beyond) const {
    const std::int64_t width = grid.step * (grid.columns - 1), depth = grid.step * (grid.rows - 1);
    // half a step more than needed, against rounding
    const double half_side =
        lattice().spacing *
        (0.5 * static_cast<double>(std::max(width, depth)) +
         (static_cast<double>(steps_beyond) + 0.5) * static_cast<double>(grid.step));
    const double x =
        lattice().x(grid.corner.x) + 0.5 * lattice().spacing * static_cast<double>(width);
    const double y =
        lattice().y(grid.corner.y) + 0.5 * lattice().spacing * static_cast<double>(depth);
    return {x - half_side, y - half_side, x + half_side, y + half_side};
}

WorldRect SourcePair::world() const {
    const std::int64_t side = lattice().chunk_side(0);
    const std::int64_t west = side * lattice().first_root_x, south = side * lattice().first_root_y;
    return rect({west, south},
                {west + side * lattice().root_count_x, south + side * lattice().root_count_y});
}

}  // namespace terrane::internal
