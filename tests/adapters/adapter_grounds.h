// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"
#include "support/meshes.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/solid_surface.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>

namespace terrane::test {

/// Hills of some metres, slopes up to 0.9.
inline double hills(double x, double y) {
    return 3.0 * std::sin(0.21 * x) * std::cos(0.17 * y) + 0.3 * std::sin(1.1 * x + 0.7 * y);
}

/// 2 x 2 chunks of 128 m of hills from (0, 0); is_resident by column and row of the chunk.
inline Ground hilly_ground(std::function<bool(int, int)> is_resident = {}) {
    return make_test_ground(hills, {.roots = 2, .is_resident = std::move(is_resident)});
}

/// The surface of a box of solid or, if the part is a cavity, of a box without.
inline std::shared_ptr<const SolidSurface> box_surface(const WorldPos& low, const WorldPos& high,
                                                       SolidPart part) {
    SolidTriangles box;
    for (int i = 0; i < 8; ++i) {
        box.vertices_world.emplace_back((i & 1 ? high : low).x(), (i & 2 ? high : low).y(),
                                        (i & 4 ? high : low).z());
    }
    for (auto [a, b, c] : kBoxTriangles) {
        if (part == SolidPart::cavity) std::swap(b, c);  // the solid is outside
        box.triangles.push_back({a, b, c});
    }
    box.parts.assign(box.triangles.size(), part);
    return std::make_shared<const SolidSurface>(std::move(box));
}

/// Flat ground at 0 with a solid slab above it, from 30 to 50 m in x and y, its top at 5 m and its bottom at 4 m.
inline Ground slab_ground() {
    const auto solid = [](const Chunk&) {
        return box_surface({30.0, 30.0, 4.0}, {50.0, 50.0, 5.0}, SolidPart::overhang);
    };
    return make_test_ground([](double, double) { return 0.0; }, {.solid = solid});
}

/// Hills whose heights differ from cell to cell, 128 x 128 cells of 1 m from (0, 0) plus a shift.
inline double rough_height(double x, double y) {
    return 20.0 + 3.0 * std::sin(0.7 * x) + 2.0 * std::cos(0.9 * y + 0.3 * x);
}

/// A plane that rises to the east and falls to the north; its heights are whole quanta.
inline double plane_height(double x, double y) { return 10.0 + 0.25 * x - 0.125 * y; }

/// Out of the solid: of plane_height().
inline Eigen::Vector3d plane_normal() { return Eigen::Vector3d(-0.25, 0.125, 1.0).normalized(); }

/// Flat ground at z = 20 over a closed room from 40 to 60 m east and north, with its floor at z = 5 and its ceiling at
/// z = 9.
inline Ground make_room_ground() {
    const auto room = [](const Chunk&) {
        return box_surface({40.0, 40.0, 5.0}, {60.0, 60.0, 9.0}, SolidPart::cavity);
    };
    return make_test_ground([](double, double) { return 20.0; }, {.solid = room});
}

/// Two by two chunks of plane_height(), of which the north-eastern one is not resident and the cells up to x = 8 are
/// outside.
inline Ground make_broken_ground() {
    return make_test_ground(plane_height,
                            {.roots = 2,
                             .is_outside = [](double x, double) { return x < 8.0; },
                             .is_resident = [](int column, int row) { return column + row < 2; }});
}

/// The plane around (1e9, -1e9), 1e5 m higher.
inline Ground make_far_ground() {
    return make_test_ground([](double x, double y) { return 1e5 + plane_height(x - 1e9, y + 1e9); },
                            {.origin_x = 1e9, .origin_y = -1e9});
}

}  // namespace terrane::test
