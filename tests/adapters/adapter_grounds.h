// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/solid_surface.h>

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace terrane::test {

/// Hills of some metres, slopes up to 0.9.
inline double hills(double x, double y) {
    return 3.0 * std::sin(0.21 * x) * std::cos(0.17 * y) + 0.3 * std::sin(1.1 * x + 0.7 * y);
}

/// 2 x 2 chunks of 128 m of hills from (0, 0); is_resident by column and row of the chunk.
inline Ground hilly_ground(std::function<bool(int, int)> is_resident = {}) {
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = std::move(is_resident);
    return make_test_ground(hills, settings);
}

/// Flat ground at 0 with a solid slab above it, from 30 to 50 m in x and y, its top at 5 m and its bottom at 4 m.
inline Ground slab_ground() {
    TableGroundSettings settings;
    settings.solid = [](const Chunk&) {
        SolidTriangles t;
        for (const double z : {4.0, 5.0}) {
            for (const double y : {30.0, 50.0}) {
                for (const double x : {30.0, 50.0}) t.vertices_world.emplace_back(x, y, z);
            }
        }
        t.triangles = {{4, 5, 7}, {4, 7, 6}, {0, 3, 1}, {0, 2, 3}, {0, 1, 5}, {0, 5, 4},
                       {2, 7, 3}, {2, 6, 7}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
        t.parts.assign(t.triangles.size(), SolidPart::overhang);
        return std::make_shared<const SolidSurface>(std::move(t));
    };
    return make_test_ground([](double, double) { return 0.0; }, settings);
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
    TableGroundSettings settings;
    settings.solid = [](const Chunk&) {
        SolidTriangles room;
        for (int i = 0; i < 8; ++i) {
            room.vertices_world.emplace_back((i & 1) != 0 ? 60.0 : 40.0, (i & 2) != 0 ? 60.0 : 40.0,
                                             (i & 4) != 0 ? 9.0 : 5.0);
        }
        // counter-clockwise seen from inside the room, which is outside of the solid
        constexpr std::array<std::array<std::uint32_t, 4>, 6> faces{
            {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}}};
        for (const auto& f : faces) {
            room.triangles.push_back({f[0], f[1], f[2]});
            room.triangles.push_back({f[0], f[2], f[3]});
        }
        room.parts.assign(room.triangles.size(), SolidPart::cavity);
        return std::make_shared<const SolidSurface>(std::move(room));
    };
    return make_test_ground([](double, double) { return 20.0; }, settings);
}

/// Two by two chunks of plane_height(), of which the north-eastern one is not resident and the cells up to x = 8 are
/// outside.
inline Ground make_broken_ground() {
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_outside = [](double x, double) { return x < 8.0; };
    settings.is_resident = [](int column, int row) { return column + row < 2; };
    return make_test_ground(plane_height, settings);
}

/// The plane around (1e9, -1e9), 1e5 m higher.
inline Ground make_far_ground() {
    TableGroundSettings settings;
    settings.origin_x = 1e9;
    settings.origin_y = -1e9;
    return make_test_ground([](double x, double y) { return 1e5 + plane_height(x - 1e9, y + 1e9); },
                            settings);
}

}  // namespace terrane::test
