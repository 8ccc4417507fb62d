// SPDX-License-Identifier: MIT
// The bound of the rounding of interpolated heights that docs/numerics.md derives, against long double.
#include "support/heights/table_ground.h"
#include "support/random.h"

#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace terrane {
namespace height_rounding_test {

using Long = long double;
using test::Random;

static_assert(std::numeric_limits<Long>::digits >= 64, "the oracle needs 11 bits more than double");

constexpr std::uint64_t kSeed = 20261127;
constexpr Long kUnit = 0x1p-53L;  // unit roundoff u of double
constexpr int kCells = kChunkCells;

struct Scene {
    const char* name;
    double spacing, origin;
    double size;    // of the heights, metres
    bool is_exact;  // whether every place of the lattice is a double
};

void PrintTo(const Scene& scene, std::ostream* out) { *out << scene.name; }

double random_height(double x, double y, double size) {
    const auto bits = [](double p) { return static_cast<std::uint64_t>(std::llround(p * 1024.0)); };
    Random random(bits(x) * 0x9e3779b97f4a7c15u ^ bits(y));
    return random.between(-size, size);
}

// The contact surface at the exact places origin + spacing * index.
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

    // The bound of docs/numerics.md; slopes and differences are those of the nine cells around the place.
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
        ASSERT_EQ(answer.status, GroundStatus::ok);
        const Long error = std::abs(Long{answer.height} - exact.height(x, y));
        const Long bound = exact.bound(x, y, scene.is_exact);
        ASSERT_LE(error, bound) << "place " << i << ": " << x << ", " << y;
        worst = std::max(worst, error);
        worst_share = std::max(worst_share, error / bound);
    }
    std::printf("largest error %.2Lg m, %.2Lf of the bound\n", worst, worst_share);
    // Far from the origin the places of an exact lattice have so few digits that nothing is rounded.
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

}  // namespace height_rounding_test
}  // namespace terrane
