// SPDX-License-Identifier: MIT
#include "terrain/ground/batch_scene.h"

#include <cmath>
#include <limits>

namespace terrane::test {
namespace {

double rough_height(double x, double y) {
    return 6.0 * std::sin(0.13 * x) + 4.0 * std::cos(0.17 * y + 0.05 * x) + std::sin(2.1 * x * y);
}

// Replaces the cells 30 to 37 of rows 50 to 53 by a floor at -20 m and a roof at 25 m.
std::shared_ptr<const SolidSurface> make_pit(double spacing) {
    SolidTriangles pit;
    for (int row = 50; row <= 53; ++row) {
        for (int column = 30; column <= 37; ++column) {
            const auto cell = static_cast<std::uint16_t>(2 * cell_index(column, row));
            pit.replaced.push_back(cell);
            pit.replaced.push_back(static_cast<std::uint16_t>(cell + 1));
            for (const double z : {-20.0, 25.0}) {
                const auto first = static_cast<std::uint32_t>(pit.vertices_world.size());
                for (const int corner : {0, 1, 3, 2}) {
                    pit.vertices_world.push_back(
                        {spacing * (column + (corner & 1)), spacing * (row + (corner >> 1)), z});
                }
                pit.triangles.push_back({first, first + 1, first + 2});
                pit.triangles.push_back({first, first + 2, first + 3});
            }
        }
    }
    pit.parts.assign(pit.triangles.size(), SolidPart::cavity);
    pit.error_m = 0.25;
    return std::make_shared<const SolidSurface>(std::move(pit));
}

double special_number(Random& random) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    switch (random.below(5)) {
        case 0:
            return std::numeric_limits<double>::quiet_NaN();
        case 1:
            return kInfinity;
        case 2:
            return -kInfinity;
        case 3:
            return 1e300;
        default:
            return -0.0;
    }
}

}  // namespace

Ground make_batch_ground(double spacing) {
    TableGroundSettings settings{.spacing = spacing, .roots = 3, .bound = 0.25f};
    settings.is_outside = [spacing](double x, double y) {
        Random random(
            static_cast<std::uint64_t>(std::floor(x / spacing) * 977.0 + std::floor(y / spacing)));
        return x > spacing * kChunkCells && random.below(6) == 0;
    };
    settings.is_resident = [](int x, int y) { return x != 1 || y != 2; };
    settings.solid = [spacing](const Chunk& chunk) {
        return chunk.key.x == 0 && chunk.key.y == 0 ? make_pit(spacing) : nullptr;
    };
    return make_test_ground(rough_height, settings);
}

std::vector<double> make_batch_points(Random& random, std::size_t count, double spacing) {
    std::vector<double> points;
    const double side = spacing * kBatchSide;
    double x = 0.0, y = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const int kind = random.below(12);
        if (kind < 6) {
            x = random.between(-0.02 * side, 1.02 * side);
            y = random.between(-0.02 * side, 1.02 * side);
        } else if (kind < 9) {  // next to the previous point
            x += spacing * random.between(-1.0, 1.0);
            y += spacing * random.between(-1.0, 1.0);
        } else if (kind == 9) {  // on lattice lines and borders
            x = spacing * random.below(3 * kChunkCells + 1);
            if (random.below(2) == 0) y = spacing * random.below(3 * kChunkCells + 1);
        } else if (kind == 10) {
            x = spacing * random.between(29.0, 39.0);
            y = spacing * random.between(49.0, 55.0);
        }
        points.insert(points.end(), {x, y, random.between(-25.0, 30.0)});
        if (kind == 11)
            points[3 * i + static_cast<std::size_t>(random.below(3))] = special_number(random);
    }
    return points;
}

}  // namespace terrane::test
