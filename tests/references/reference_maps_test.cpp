// SPDX-License-Identifier: MIT
#include "reference_maps.h"

#include "support/mesh_checks.h"
#include "support/random.h"
#include "terrain/source/bound_checks.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::test {
namespace reference_maps_test {

HeightTable rough_table(int columns, int rows, std::uint64_t seed) {
    HeightTable table;
    table.columns = columns;
    table.rows = rows;
    Random random(seed);
    for (int i = 0; i < columns * rows; ++i) {
        table.heights.push_back(static_cast<float>(random.between(-20.0, 30.0)));
    }
    return table;
}

// The formula of the maps for one sample, spelled out.
double fbm_height(int x, int y) {
    const auto mix = [](std::uint32_t h) {
        h ^= h >> 16;
        h *= 0x7feb352du;
        h ^= h >> 15;
        h *= 0x846ca68bu;
        h ^= h >> 16;
        return h;
    };
    const auto fade = [](double t) {
        return 6 * std::pow(t, 5) - 15 * std::pow(t, 4) + 10 * t * t * t;
    };
    double height = 0.0;
    for (std::uint32_t octave = 0; octave < 10; ++octave) {
        const double u = x * std::pow(2.0, octave) / 512 + 17.31 * octave;
        const double v = y * std::pow(2.0, octave) / 512 + 9.77 * octave;
        double noise = 0.0;
        for (const int dy : {0, 1}) {
            for (const int dx : {0, 1}) {
                const double i = std::floor(u) + dx, j = std::floor(v) + dy;
                const std::uint32_t hash =
                    mix(static_cast<std::uint32_t>(i) * 0x8da6b343u ^
                        static_cast<std::uint32_t>(j) * 0xd8163841u ^ octave * 0xcb1ab31fu);
                const double angle = 2.0 * std::acos(-1.0) * hash / 4294967296.0;
                const double weight = fade(1.0 - std::abs(u - i)) * fade(1.0 - std::abs(v - j));
                noise += weight * (std::cos(angle) * (u - i) + std::sin(angle) * (v - j));
            }
        }
        height += 100.0 * std::pow(0.5, octave) * noise;
    }
    return height;
}

TEST(ReferenceMap, OfContactIsAsSteepAsItsFiguresSay) {
    const HeightTable table = make_contact_table(1025, 1.0);
    double sum = 0.0, steepest = 0.0;
    for (int y = 0; y + 1 < table.rows; ++y) {
        for (int x = 0; x + 1 < table.columns; ++x) {
            const double here = static_cast<double>(table.at(x, y));
            const double slope = std::hypot(static_cast<double>(table.at(x + 1, y)) - here,
                                            static_cast<double>(table.at(x, y + 1)) - here);
            sum += slope;
            steepest = std::max(steepest, slope);
        }
    }
    EXPECT_NEAR(sum / (1024.0 * 1024.0), 0.375, 0.0005);
    EXPECT_NEAR(steepest, 1.59, 0.005);
}

TEST(ReferenceMap, OfContactHasTheSameHillsAtEverySpacing) {
    const HeightTable coarse = make_contact_table(9, 1.0);
    const HeightTable fine = make_contact_table(33, 0.25);
    for (int y = 0; y < 9; ++y) {
        for (int x = 0; x < 9; ++x) EXPECT_EQ(coarse.at(x, y), fine.at(4 * x, 4 * y));
    }
}

TEST(ReferenceMap, FollowsItsFormula) {
    const HeightTable table = make_fbm_table(257);
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        const int x = random.below(257), y = random.below(257);
        EXPECT_NEAR(static_cast<double>(table.at(x, y)), fbm_height(x, y), 1e-4) << x << ", " << y;
    }
}

TEST(TableHeights, BoundsWhatItsDiamondsMeasureAndNotMuchMore) {
    const TableHeights source(rough_table(129, 129, 2));
    Random random(3);
    double closest = 0.0;
    for (const std::int64_t step : {1, 2, 4, 16}) {
        for (int i = 0; i < 4; ++i) {
            const SampleGrid grid{{32 * random.below(3), 32 * random.below(3)},
                                  step,
                                  static_cast<int>(32 / step) + 1,
                                  static_cast<int>(32 / step) + 1};
            closest = std::max(closest, check_bounds(source, grid, 60, random));
        }
    }
    EXPECT_GT(closest, 0.97);
}

// Dense points of the finest diamonds, where the bend within a cell decides.
TEST(TableHeights, BoundsOfTheFinestDiamondsAreExact) {
    const TableHeights source(rough_table(129, 129, 4));
    const std::vector<float> bounds = vertex_bounds(source, {{64, 64}, 1, 9, 9});
    for (int row = 0; row < 9; ++row) {
        for (int column = 0; column < 9; ++column) {
            if (((row | column) & 1) == 0 || (row & column & 1) != 0) continue;
            double dense = 0.0;  // a midpoint has nothing below it
            for (const Triangle& triangle : diamond(64 + column, 64 + row, 1)) {
                for (int i = 0; i <= 400; ++i) {
                    for (int j = 0; i + j <= 400; ++j) {
                        const double a = i / 400.0, b = j / 400.0, c = 1.0 - a - b;
                        const auto mixed = [&](auto&& of) {
                            return a * of(triangle[0]) + b * of(triangle[1]) + c * of(triangle[2]);
                        };
                        const double x = mixed([](const LatticePoint& p) { return double(p.x); });
                        const double y = mixed([](const LatticePoint& p) { return double(p.y); });
                        const double plane = mixed([&](const LatticePoint& p) {
                            return source.height(double(p.x), double(p.y));
                        });
                        dense = std::max(dense, std::abs(source.height(x, y) - plane));
                    }
                }
            }
            const auto bound =
                static_cast<double>(bounds[static_cast<std::size_t>(9 * row + column)]);
            EXPECT_LE(dense, bound);
            EXPECT_GE(dense, bound - 1e-3);
        }
    }
}

TEST(TableHeights, NestsItsBoundsAndGivesTheSameBitsToEveryGrid) {
    const TableHeights source(rough_table(300, 200, 5));
    for (const std::int64_t step : {2, 4, 8}) {
        check_nesting(source, {{16, 32}, step, 9, 9});
        check_same_bits(source, {{16, 32}, step, 9, 9});
    }
    check_same_bits(source, {{-4, 180}, 1, 20, 40});
}

TEST(TableHeights, HoldsEveryHeightInItsIntervalsAndRises) {
    const TableHeights source(rough_table(300, 200, 6));
    EXPECT_EQ(source.lattice().root_count_x, 3);
    EXPECT_EQ(source.lattice().root_count_y, 2);
    EXPECT_EQ(source.extent().east, 299.0);
    Random random(7);
    for (int i = 0; i < 2000; ++i) {
        const double west = random.between(-40.0, 400.0), south = random.between(-40.0, 280.0);
        const WorldRect rect{west, south, west + random.between(0.0, 60.0),
                             south + random.between(0.0, 60.0)};
        const HeightInterval held = source.interval(rect);
        const double x0 = random.between(rect.west, rect.east);
        const double y0 = random.between(rect.south, rect.north);
        const double x1 = random.between(rect.west, rect.east);
        const double y1 = random.between(rect.south, rect.north);
        const double from = source.height(x0, y0), to = source.height(x1, y1);
        EXPECT_LE(held.low, from);
        EXPECT_GE(held.high, from);
        EXPECT_LE(std::abs(to - from), source.rise_bound(std::hypot(x1 - x0, y1 - y0)));
    }
}

TEST(TableHeights, MakesChunksWhoseEdgesAreShared) {
    const TableHeights source(make_fbm_table(257));
    EXPECT_EQ(source.lattice().finest_level, 1);
    EXPECT_EQ(source.lattice().root_count_x, 1);
    const auto west = make_chunk(source, {0, 1, 1}).value();
    const auto east = make_chunk(source, {1, 1, 1}).value();
    for (int row = 0; row < kChunkSamples; ++row) {
        EXPECT_EQ(west->heights[sample_index(kChunkCells, row)],
                  east->heights[sample_index(0, row)]);
    }
}

}  // namespace reference_maps_test
}  // namespace terrane::test
