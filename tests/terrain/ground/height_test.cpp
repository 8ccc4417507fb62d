// SPDX-License-Identifier: MIT
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace height_test {

using test::make_test_ground;
using test::Random;
using test::TableGroundSettings;

double rough(double x, double y) {
    Random random(static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(x * 64.0))) *
                      0x9e3779b97f4a7c15u ^
                  static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(y * 64.0))));
    return random.between(-30.0, 30.0);
}

bool has_hole(double x, double y) {
    Random random(static_cast<std::uint64_t>(std::floor(x) * 977.0 + std::floor(y)));
    return random.below(4) == 0;
}

// Reference: one cell's answer, triangle by triangle as CONVENTIONS.md cuts them, in the order of operations that
// defines the bits.
HeightAnswer plain_height(const Ground& ground, const GroundCell& cell, std::int64_t column,
                          std::int64_t row, double x, double y) {
    HeightAnswer answer;
    const double spacing = ground.spacing(), quantum = ground.lattice().quantum;
    const double u = std::clamp((x - ground.cell_x(column)) / spacing, 0.0, 1.0);
    const double v = std::clamp((y - ground.cell_y(row)) / spacing, 0.0, 1.0);
    const double south = quantum * (static_cast<double>(cell.south_east) - cell.south_west);
    const double north = quantum * (static_cast<double>(cell.north_east) - cell.north_west);
    const double west = quantum * (static_cast<double>(cell.north_west) - cell.south_west);
    const double east = quantum * (static_cast<double>(cell.north_east) - cell.south_east);
    double slope_x = 0.0, slope_y = 0.0, rise = 0.0;
    if (cell.cut_to_north_east) {
        slope_x = u >= v ? south : north;
        slope_y = u >= v ? east : west;
        rise = slope_x * u + slope_y * v;
    } else if (u + v <= 1.0) {
        slope_x = south;
        slope_y = west;
        rise = slope_x * u + slope_y * v;
    } else {
        slope_x = north;
        slope_y = east;
        rise = south + east - slope_x * (1.0 - u) - slope_y * (1.0 - v);
    }
    answer.status = GroundStatus::ok;
    answer.height = quantum * static_cast<double>(cell.south_west) + rise;
    const Eigen::Vector3d up(-slope_x / spacing, -slope_y / spacing, 1.0);
    answer.normal = up / up.norm();
    answer.error_m = static_cast<double>(cell.error_m);
    return answer;
}

// Of the closed cells that contain a point, the first that is ground: from the east and the north.
HeightAnswer slow_height(const Ground& ground, double x, double y) {
    HeightAnswer answer;
    answer.status = GroundStatus::outside;
    std::vector<std::int64_t> columns, rows;
    const std::int64_t side = kChunkCells * 3;
    for (std::int64_t i = side - 1; i >= 0; --i) {
        if (x >= ground.cell_x(i) && x <= ground.cell_x(i + 1)) columns.push_back(i);
        if (y >= ground.cell_y(i) && y <= ground.cell_y(i + 1)) rows.push_back(i);
    }
    for (const std::int64_t row : rows) {
        for (const std::int64_t column : columns) {
            const GroundCell cell = ground.cell(column, row);
            if (cell.status == GroundStatus::outside) continue;
            answer.status = cell.status;
            if (cell.status != GroundStatus::ok) return answer;
            return plain_height(ground, cell, column, row, x, y);
        }
    }
    return answer;
}

TEST(GroundHeight, HasTheBitsOfThePlainFormula) {
    constexpr std::uint64_t kSeed = 7;
    for (const double spacing : {1.0, 0.01, 1.1, 0.25, 30.0}) {
        for (const double origin : {0.0, 0.3, 1e7 + 0.1}) {
            TableGroundSettings settings{.spacing = spacing,
                                         .roots = 3,
                                         .origin_x = origin,
                                         .origin_y = -origin,
                                         .bound = 0.25f};
            settings.is_outside = [=](double x, double y) {
                return has_hole((x - origin) / spacing, (y + origin) / spacing);
            };
            settings.is_resident = [](int x, int y) { return x != 1 || y != 2; };
            const Ground ground = make_test_ground(rough, settings);
            Random random(kSeed);
            std::array<int, 5> counts{};
            for (int i = 0; i < 3000; ++i) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", spacing " << spacing
                                                << ", origin " << origin << ", place " << i);
                const int column = random.below(386) - 1, row = random.below(386) - 1;
                double x = ground.cell_x(column), y = ground.cell_y(row);
                // between lines, on them, and one ulp beside them
                if (i % 2 == 0) x += spacing * random.between(0.0, 1.0);
                if (i % 3 == 0) y += spacing * random.between(0.0, 1.0);
                if (i % 5 == 0) x = std::nextafter(x, i % 10 == 0 ? -1e9 : 1e9);
                if (i % 7 == 0) y = std::nextafter(y, i % 14 == 0 ? -1e9 : 1e9);
                const HeightAnswer answer = ground.height(x, y);
                const HeightAnswer expected = slow_height(ground, x, y);
                ++counts[static_cast<std::size_t>(answer.status)];
                ASSERT_EQ(answer.status, expected.status);
                ASSERT_EQ(answer.height, expected.height);
                ASSERT_EQ(answer.normal, expected.normal);
                ASSERT_EQ(answer.error_m, expected.error_m);
            }
            for (const GroundStatus status :
                 {GroundStatus::ok, GroundStatus::outside, GroundStatus::not_resident}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 100);
            }
        }
    }
}

TEST(GroundReader, BoundsSquaresByTheirLowestAndHighestSamples) {
    constexpr std::uint64_t kSeed = 8;
    const Ground ground = make_test_ground(
        rough,
        {.roots = 3, .first_root = -1, .is_outside = has_hole, .is_resident = [](int x, int y) {
             return x != 1 || y != 2;
         }});
    GroundReader reader(ground);
    Random random(kSeed);
    for (int i = 0; i < 4000; ++i) {
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", square " << i);
        const int size = i % 8;
        const std::int64_t column = random.below(500) - 190, row = random.below(500) - 190;
        const std::int64_t side = std::int64_t{1} << size;
        const std::int64_t west = column & -side, south = row & -side;
        const RangeAnswer square = reader.square(column, row, size);
        const RangeAnswer range = ground.range({west, south, west + side - 1, south + side - 1});
        ASSERT_EQ(square.status, range.status);
        const auto is_within = [](std::int64_t cell) { return cell >= -128 && cell < 256; };
        if (!is_within(column) || !is_within(row)) {
            ASSERT_EQ(square.status, GroundStatus::outside);
            continue;
        }
        if (column >= 0 && column < 128 && row >= 128) {
            ASSERT_EQ(square.status, GroundStatus::not_resident);
            ASSERT_EQ(square.low, range.low);
            ASSERT_EQ(square.high, range.high);
            continue;
        }
        ASSERT_EQ(square.status, GroundStatus::ok);
        std::int32_t low = std::numeric_limits<std::int32_t>::max();
        std::int32_t high = std::numeric_limits<std::int32_t>::min();
        for (std::int64_t y = south; y <= south + side; ++y) {
            for (std::int64_t x = west; x <= west + side; ++x) {
                const auto quanta = static_cast<std::int32_t>(
                    std::floor(rough(ground.cell_x(x), ground.cell_y(y)) * 0x1p12 + 0.5));
                low = std::min(low, quanta);
                high = std::max(high, quanta);
            }
        }
        ASSERT_EQ(square.low, low);
        ASSERT_EQ(square.high, high);
        ASSERT_LE(range.low, low);
        ASSERT_GE(range.high, high);
        if (size >= 3) {
            ASSERT_EQ(range.low, low);
            ASSERT_EQ(range.high, high);
        }
    }
}

// Ranges are exactly those of the overlapping blocks of 8 x 8 cells.
TEST(Ground, BoundsRangesByTheirBlocks) {
    constexpr std::uint64_t kSeed = 9;
    const Ground ground = make_test_ground(rough, {.roots = 3});
    GroundReader reader(ground);
    Random random(kSeed);
    for (int i = 0; i < 2000; ++i) {
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", range " << i);
        const int reach = i % 4 == 0 ? 300 : 40;
        CellRange cells{random.below(384), random.below(384), 0, 0};
        cells.east = std::min<std::int64_t>(cells.west + random.below(reach), 383);
        cells.north = std::min<std::int64_t>(cells.south + random.below(reach), 383);
        std::int32_t low = std::numeric_limits<std::int32_t>::max();
        std::int32_t high = std::numeric_limits<std::int32_t>::min();
        for (std::int64_t row = cells.south & -8; row <= cells.north; row += 8) {
            for (std::int64_t column = cells.west & -8; column <= cells.east; column += 8) {
                const RangeAnswer block = reader.block(column, row);
                low = std::min(low, block.low);
                high = std::max(high, block.high);
            }
        }
        const RangeAnswer range = ground.range(cells);
        ASSERT_EQ(range.status, GroundStatus::ok);
        ASSERT_EQ(range.low, low);
        ASSERT_EQ(range.high, high);
    }
}

}  // namespace height_test
}  // namespace terrane
