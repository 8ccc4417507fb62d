// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/math.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace terrane::internal {

/// The first of `along` root squares, of which a world has `count` from `first`: as near to `before` as keeps the root
/// square of a place in the middle two, or as near to the middle as the world allows.
inline std::int32_t first_in_window(double place, double origin, double side, std::int32_t first,
                                    std::int32_t count, std::int32_t along, std::int64_t before) {
    const std::int64_t last = std::int64_t{first} + count - 1;
    const double index = std::clamp(std::floor((place - origin) / side), static_cast<double>(first),
                                    static_cast<double>(last));
    const std::int64_t least = static_cast<std::int64_t>(index) - along / 2;
    const std::int64_t wanted = std::clamp(before, least, least + 1);
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(wanted, first, std::max<std::int64_t>(first, last + 1 - along)));
}

/// The lattice of the root squares in the window of a world when the client is at a place, finite, metres: moved from
/// the one before by no more root squares than necessary. So a client that crosses an edge of root squares to and fro
/// moves it once. The world itself where it has no window.
inline Lattice moved_root_window(const Lattice& world, const Lattice& before,
                                 const WorldVec2& place) {
    Lattice window = world;
    window.root_window = 0;
    if (world.root_window == 0) return window;
    const double side = world.root_size();
    window.root_count_x = std::min(world.root_count_x, world.root_window);
    window.root_count_y = std::min(world.root_count_y, world.root_window);
    window.first_root_x =
        first_in_window(place.x(), world.origin_x, side, world.first_root_x, world.root_count_x,
                        window.root_count_x, before.first_root_x);
    window.first_root_y =
        first_in_window(place.y(), world.origin_y, side, world.first_root_y, world.root_count_y,
                        window.root_count_y, before.first_root_y);
    return window;
}

/// The window before any client has come: around the lattice's origin.
inline Lattice first_root_window(const Lattice& world) {
    return moved_root_window(world, world, {world.origin_x, world.origin_y});
}

/// The rectangle of a lattice's root squares, metres.
inline WorldRect rect_of_roots(const Lattice& lattice) {
    return {lattice.x(lattice.west()), lattice.y(lattice.south()), lattice.x(lattice.east()),
            lattice.y(lattice.north())};
}

/// Whether all ground of a region is inside a window.
inline bool is_in_window(const WorldRect& region, const WorldRect& extent, const Lattice& window) {
    const WorldRect roots = rect_of_roots(window);
    return std::max(region.west, extent.west) >= roots.west &&
           std::max(region.south, extent.south) >= roots.south &&
           std::min(region.east, extent.east) <= roots.east &&
           std::min(region.north, extent.north) <= roots.north;
}

}  // namespace terrane::internal
