// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

namespace terrane::height_test {

using namespace test;

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

// Reference: one cell's answer, triangle by triangle with the diagonals of CONVENTIONS.md, in the order of operations
// that defines the bits.
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
    answer.status = QueryStatus::ok;
    answer.height = quantum * static_cast<double>(cell.south_west) + rise;
    const Eigen::Vector3d up(-slope_x / spacing, -slope_y / spacing, 1.0);
    answer.normal = up / up.norm();
    answer.error_m = static_cast<double>(cell.error_m);
    return answer;
}

// The answer of the first closed cell that contains the point and is ground, from east to west and north to south.
HeightAnswer slow_height(const Ground& ground, double x, double y) {
    HeightAnswer answer{.status = QueryStatus::outside};
    std::vector<std::int64_t> columns, rows;
    const std::int64_t side = kChunkCells * 3;
    for (std::int64_t i = side - 1; i >= 0; --i) {
        if (x >= ground.cell_x(i) && x <= ground.cell_x(i + 1)) columns.push_back(i);
        if (y >= ground.cell_y(i) && y <= ground.cell_y(i + 1)) rows.push_back(i);
    }
    for (const std::int64_t row : rows) {
        for (const std::int64_t column : columns) {
            const GroundCell cell = ground.cell(column, row);
            if (cell.status == QueryStatus::outside) continue;
            answer.status = cell.status;
            if (cell.status != QueryStatus::ok) return answer;
            return plain_height(ground, cell, column, row, x, y);
        }
    }
    return answer;
}

TEST(GroundHeight, HasTheBitsOfThePlainFormula) {
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
            SeededRandom random(7);
            std::array<int, 6> counts{};
            for (int i = 0; i < 3000; ++i) {
                SCOPED_TRACE(testing::Message()
                             << "spacing " << spacing << ", origin " << origin << ", place " << i);
                const int column = random.below(386) - 1, row = random.below(386) - 1;
                double x = ground.cell_x(column), y = ground.cell_y(row);
                // between lattice lines, on them, and one ulp beside them
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
            for (const QueryStatus status :
                 {QueryStatus::ok, QueryStatus::outside, QueryStatus::not_resident}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 100);
            }
        }
    }
}

TEST(GroundReader, BoundsSquaresByTheirLowestAndHighestSamples) {
    const Ground ground = make_test_ground(
        rough,
        {.roots = 3, .first_root = -1, .is_outside = has_hole, .is_resident = [](int x, int y) {
             return x != 1 || y != 2;
         }});
    GroundReader reader(ground);
    SeededRandom random(8);
    for (int i = 0; i < 4000; ++i) {
        SCOPED_TRACE(testing::Message() << "square " << i);
        const int size = i % 8;
        const std::int64_t column = random.below(500) - 190, row = random.below(500) - 190;
        const std::int64_t side = std::int64_t{1} << size;
        const std::int64_t west = column & -side, south = row & -side;
        const RangeAnswer square = reader.square(column, row, size);
        const RangeAnswer range = ground.range({west, south, west + side - 1, south + side - 1});
        ASSERT_EQ(square.status, range.status);
        const auto is_within = [](std::int64_t cell) { return cell >= -128 && cell < 256; };
        if (!is_within(column) || !is_within(row)) {
            ASSERT_EQ(square.status, QueryStatus::outside);
            continue;
        }
        if (column >= 0 && column < 128 && row >= 128) {
            ASSERT_EQ(square.status, QueryStatus::not_resident);
            ASSERT_EQ(square.low, range.low);
            ASSERT_EQ(square.high, range.high);
            continue;
        }
        ASSERT_EQ(square.status, QueryStatus::ok);
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

// Ranges of heights equal those of the overlapping blocks of 8 x 8 cells.
TEST(Ground, BoundsRangesByTheirBlocks) {
    const Ground ground = make_test_ground(rough, {.roots = 3});
    GroundReader reader(ground);
    SeededRandom random(9);
    for (int i = 0; i < 2000; ++i) {
        SCOPED_TRACE(testing::Message() << "range " << i);
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
        ASSERT_EQ(range.status, QueryStatus::ok);
        ASSERT_EQ(range.low, low);
        ASSERT_EQ(range.high, high);
    }
}

}  // namespace terrane::height_test

// The bound of docs/numerics.md for the rounding of interpolated heights, against long double.

namespace terrane::height_rounding_test {

using namespace test;
using Long = long double;

static_assert(std::numeric_limits<Long>::digits >= 64, "the oracle needs 11 bits more than double");

constexpr std::uint64_t kSeed = 20261127;
constexpr Long kUnit = 0x1p-53L;  // unit roundoff u of double
constexpr int kCells = kChunkCells;

struct Scene {
    const char* name;
    double spacing, origin;
    double size;    // magnitude of the heights, metres
    bool is_exact;  // whether every lattice position is a double
};

void PrintTo(const Scene& scene, std::ostream* out) { *out << scene.name; }

double random_height(double x, double y, double size) {
    const auto bits = [](double p) { return static_cast<std::uint64_t>(std::llround(p * 1024.0)); };
    Random random(bits(x) * 0x9e3779b97f4a7c15u ^ bits(y));
    return random.between(-size, size);
}

// The contact surface over the exact positions origin + spacing * index.
class ExactSurface {
public:
    ExactSurface(const Ground& ground, const Scene& scene)
        : ground_(ground), spacing_(scene.spacing), origin_(scene.origin) {}

    Long height(double x, double y) const {
        const Long u = (Long{x} - origin_) / spacing_, v = (Long{y} - origin_) / spacing_;
        const auto column = static_cast<std::int64_t>(std::floor(u));
        const auto row = static_cast<std::int64_t>(std::floor(v));
        const GroundCell cell = ground_.cell(column, row);
        const Long east = u - static_cast<Long>(column), north = v - static_cast<Long>(row);
        const Long sw = cell.south_west, se = cell.south_east, nw = cell.north_west,
                   ne = cell.north_east;
        Long quanta = 0;
        if (cell.cut_to_north_east) {
            quanta = sw + (east >= north ? (se - sw) * east + (ne - se) * north
                                         : (ne - nw) * east + (nw - sw) * north);
        } else if (east + north <= 1) {
            quanta = sw + (se - sw) * east + (nw - sw) * north;
        } else {
            quanta = ne + (nw - ne) * (1 - east) + (se - ne) * (1 - north);
        }
        return quanta * ground_.lattice().quantum;
    }

    // The bound of docs/numerics.md, with the slopes and height differences of the nine cells around the point.
    Long bound(double x, double y, bool is_exact) const {
        const std::int64_t column = ground_.column_at(x), row = ground_.row_at(y);
        double slope_x = 0.0, slope_y = 0.0, difference = 0.0;
        for (std::int64_t j = row - 1; j <= row + 1; ++j) {
            for (std::int64_t i = column - 1; i <= column + 1; ++i) {
                const GroundCell cell = ground_.cell(i, j);
                const auto [low, high] = std::minmax(
                    {cell.south_west, cell.south_east, cell.north_west, cell.north_east});
                difference = std::max(difference, double(high) - double(low));
                slope_x = std::max({slope_x, std::abs(double(cell.south_east) - cell.south_west),
                                    std::abs(double(cell.north_east) - cell.north_west)});
                slope_y = std::max({slope_y, std::abs(double(cell.north_west) - cell.south_west),
                                    std::abs(double(cell.north_east) - cell.south_east)});
            }
        }
        const double quantum = ground_.lattice().quantum;
        const auto shift = [&](double p, std::int64_t index) {
            const Long place = is_exact ? 0
                                        : std::abs(Long{spacing_} * (index + 1)) +
                                              std::abs(Long{p}) + Long{spacing_};
            return place + 2 * Long{spacing_};
        };
        return kUnit *
               (std::abs(height(x, y)) + 6 * Long{quantum} * difference +
                Long{quantum} / spacing_ * (slope_x * shift(x, column) + slope_y * shift(y, row)));
    }

private:
    const Ground& ground_;
    double spacing_, origin_;
};

class HeightRounding : public testing::TestWithParam<Scene> {};

TEST_P(HeightRounding, IsWithinTheDerivedBound) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    const Scene& scene = GetParam();
    const Ground ground = test::make_test_ground(
        [&](double x, double y) { return random_height(x, y, scene.size); },
        {.spacing = scene.spacing, .origin_x = scene.origin, .origin_y = scene.origin});
    for (int i = 0; i <= kCells; ++i) {
        const Long place = Long{scene.origin} + Long{scene.spacing} * i;
        EXPECT_TRUE(!scene.is_exact || Long{ground.cell_x(i)} == place) << i;
    }
    const ExactSurface exact(ground, scene);
    Random random(kSeed);
    Long worst_share = 0, worst = 0;
    for (int i = 0; i < 20'000; ++i) {
        const int column = 2 + random.below(kCells - 4), row = 2 + random.below(kCells - 4);
        double u = random.between(0.0, 1.0), v = random.between(0.0, 1.0);
        if (i % 4 == 1) v = u;
        if (i % 4 == 2) v = 1.0 - u;
        if (i % 16 == 3) u = 0.0;
        double x = ground.cell_x(column) + scene.spacing * u;
        if (i % 8 == 5) x = std::nextafter(x, i % 16 == 5 ? -1e12 : 1e12);
        const double y = ground.cell_y(row) + scene.spacing * v;
        const HeightAnswer answer = ground.height(x, y);
        ASSERT_EQ(answer.status, QueryStatus::ok);
        const Long error = std::abs(Long{answer.height} - exact.height(x, y));
        const Long bound = exact.bound(x, y, scene.is_exact);
        ASSERT_LE(error, bound) << "place " << i << ": " << x << ", " << y;
        worst = std::max(worst, error);
        worst_share = std::max(worst_share, error / bound);
    }
    std::printf("largest error %.2Lg m, %.2Lf of the bound\n", worst, worst_share);
    // Far from the origin, positions on an exact lattice have so few digits that nothing is rounded.
    if (scene.origin == 0.0 || !scene.is_exact) {
        EXPECT_GT(worst_share, 0.01L);
    }
}

INSTANTIATE_TEST_SUITE_P(All, HeightRounding,
                         testing::Values(Scene{"hills_at_0", 1.0, 0.0, 1.0, true},
                                         Scene{"hills_at_1e6", 1.0, 1e6, 1.0, true},
                                         Scene{"hills_at_1e9", 1.0, 1e9, 1.0, true},
                                         Scene{"odd_spacing_at_0", 1.1, 0.3, 1.0, false},
                                         Scene{"odd_spacing_at_1e6", 1.1, 1e6 + 0.3, 1.0, false},
                                         Scene{"odd_spacing_at_1e9", 1.1, 1e9 + 0.3, 1.0, false},
                                         Scene{"cliffs_at_0", 1.0, 0.0, 1e5, true},
                                         Scene{"cliffs_at_1e9", 1.0, 1e9, 1e5, true},
                                         Scene{"cliffs_with_odd_spacing_at_1e9", 1.1, 1e9 + 0.3,
                                               1e5, false}),
                         [](const auto& each) { return each.param.name; });

}  // namespace terrane::height_rounding_test
