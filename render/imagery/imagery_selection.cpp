// SPDX-License-Identifier: MIT
#include "imagery/imagery_selection.h"

#include <terrane/scene/view_volume.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace terrane::internal {
namespace {

// Root squares farther from the eye's than this many are not looked at.
constexpr std::int64_t kMostRoots = 16;

bool do_meet(const WorldRect& a, const WorldRect& b) {
    return a.west < b.east && b.west < a.east && a.south < b.north && b.south < a.north;
}

// A square with the heights of the finest chunk that covers it.
Aabb box_of(const ResidentSet& resident, const ImagerySquare& square) {
    const Lattice& lattice = resident.lattice();
    const WorldRect rect = imagery_rect(lattice, square);
    int level = square.level;
    double low = 0.0, high = 0.0;
    for (std::int64_t x = square.x, y = square.y; level >= 0; --level, x >>= 1, y >>= 1) {
        if (level > lattice.finest_level) continue;
        const ChunkKey key{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                           static_cast<std::uint8_t>(level)};
        const std::int32_t index = resident.find(key);
        if (index == ResidentSet::kNone) continue;
        const Chunk& chunk = *resident.chunks()[static_cast<std::size_t>(index)];
        low = lattice.quantum * chunk.low;
        high = lattice.quantum * chunk.high;
        break;
    }
    return {{rect.west, rect.south, low}, {rect.east, rect.north, high}};
}

double distance_to(const Aabb& box, const WorldPos& p) {
    return (p - p.cwiseMax(box.low).cwiseMin(box.high)).norm();
}

std::vector<ImagerySquare> roots_around(const Lattice& lattice, const WorldPos& eye,
                                        const WorldRect& rect) {
    const double side = imagery_side(lattice, 0);
    const auto range = [&](double place, double origin, std::int32_t first, std::int32_t count) {
        const double most = static_cast<double>(first + count);
        const auto root = static_cast<std::int64_t>(
            std::clamp(std::floor((place - origin) / side), static_cast<double>(first), most));
        return std::pair(std::max<std::int64_t>(first, root - kMostRoots),
                         std::min<std::int64_t>(first + count - 1, root + kMostRoots));
    };
    const auto [west, east] =
        range(eye.x(), lattice.origin_x, lattice.first_root_x, lattice.root_count_x);
    const auto [south, north] =
        range(eye.y(), lattice.origin_y, lattice.first_root_y, lattice.root_count_y);
    std::vector<ImagerySquare> roots;
    for (std::int64_t y = south; y <= north; ++y) {
        for (std::int64_t x = west; x <= east; ++x) {
            const ImagerySquare root{.level = 0, .y = y, .x = x};
            if (do_meet(imagery_rect(lattice, root), rect)) roots.push_back(root);
        }
    }
    return roots;
}

}  // namespace

int finest_imagery_level(const Lattice& lattice, double texel_size) {
    int level = 0;
    while (level < kMostImageryLevel && imagery_side(lattice, level) / kImageryContent > texel_size)
        ++level;
    return level;
}

std::vector<ImagerySquare> select_imagery(const ResidentSet& resident, const View& view,
                                          const WorldRect& rect, double texel_size,
                                          std::size_t most) {
    const Lattice& lattice = resident.lattice();
    const int finest = finest_imagery_level(lattice, texel_size);
    const double radians_per_pixel = 1.0 / view.pixels_per_radian();
    const ViewVolume volume(view);
    std::vector<ImagerySquare> selected;
    std::set<ImagerySquare> known;
    const std::vector<ImagerySquare> roots = roots_around(lattice, view.eye_world, rect);
    for (const bool is_for_view : {true, false}) {
        // breadth first: a square precedes those in it
        std::vector<ImagerySquare> level = roots, next;
        while (!level.empty()) {
            next.clear();
            for (const ImagerySquare& square : level) {
                const Aabb box = box_of(resident, square);
                if (is_for_view && !volume.meets(box)) continue;
                if (known.insert(square).second) {
                    if (selected.size() == most) return selected;
                    selected.push_back(square);
                }
                const double pixel = distance_to(box, view.eye_world) * radians_per_pixel;
                if (square.level >= finest ||
                    pixel >= imagery_side(lattice, square.level) / kImageryContent)
                    continue;
                for (int quadrant = 0; quadrant < 4; ++quadrant) {
                    const ImagerySquare child{.level = square.level + 1,
                                              .y = 2 * square.y + (quadrant >> 1),
                                              .x = 2 * square.x + (quadrant & 1)};
                    if (do_meet(imagery_rect(lattice, child), rect)) next.push_back(child);
                }
            }
            std::swap(level, next);
        }
    }
    return selected;
}

}  // namespace terrane::internal
