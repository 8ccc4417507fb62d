// SPDX-License-Identifier: MIT
#pragma once

#include "support/heights/table_ground.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/solid_surface.h>

#include <cmath>
#include <functional>
#include <memory>

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

}  // namespace terrane::test
