// SPDX-License-Identifier: MIT
#include "source/cell_deviation.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {
namespace cell_deviation_test {

constexpr std::uint64_t kSeed = 67;
constexpr int kCells = 3 * kCellGroup;
constexpr int kSide = kCellSamples;

/// Random cells with everything that CellRow points to.
struct Cells {
    std::vector<std::vector<double>> values;
    CellRow row;

    Cells(bool has_radii, bool centre_is_foot, test::Random& random) {
        values.reserve(2 * kSide * kSide + 11);
        const auto make = [&](double low, double high) {
            std::vector<double>& made = values.emplace_back(kCells);
            for (double& value : made) value = random.between(low, high);
            return made.data();
        };
        row.count = kCells;
        row.has_radii = has_radii;
        row.centre_is_foot = centre_is_foot;
        for (int i = 0; i < kSide; ++i) {
            for (int j = 0; j < kSide; ++j) {
                row.centres[i][j] = make(-1.0, 1.0);
                row.radii[i][j] = has_radii ? make(0.0, 0.3) : nullptr;
            }
        }
        for (const double** corner : {&row.foot, &row.right, &row.head, &row.left}) {
            *corner = make(-1.0, 1.0);
        }
        for (const double** rise : {&row.right_rise, &row.left_rise, &row.centre_rise}) {
            *rise = make(-1.0, 1.0);
        }
        clear();
    }

    void clear() {
        for (double** most : {&row.cell, &row.right_most, &row.left_most, &row.centre_most}) {
            *most = values.emplace_back(kCells, 0.0).data();
        }
    }
};

double plane(const std::array<double, 3>& corners, double x, double y, bool upper) {
    // foot, the corner beside the diagonal, head
    return upper ? (1.0 - y) * corners[0] + (y - x) * corners[1] + x * corners[2]
                 : (1.0 - x) * corners[0] + (x - y) * corners[1] + y * corners[2];
}

TEST(CellDeviation, IsTheLargestOfAnySampleFromEachOfThePlanes) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    for (const bool has_radii : {false, true}) {
        for (const bool centre_is_foot : {false, true}) {
            Cells cells(has_radii, centre_is_foot, random);
            const CellRow& row = cells.row;
            raise_deviations(SimdLevel::baseline)(row);
            for (std::size_t cell = 0; cell < kCells; ++cell) {
                double of_cell = 0.0, of_right = 0.0, of_left = 0.0, of_centre = 0.0;
                for (int i = 0; i < kSide; ++i) {
                    for (int j = 0; j < kSide; ++j) {
                        const double x = j / (kSide - 1.0), y = i / (kSide - 1.0);
                        const double radius = has_radii ? row.radii[i][j][cell] : 0.0;
                        for (const bool upper : {false, true}) {
                            if (upper ? y < x : y > x) continue;
                            const double beside = upper ? row.left[cell] : row.right[cell];
                            const double rise = upper ? row.left_rise[cell] : row.right_rise[cell];
                            std::array<double, 3> corners{row.foot[cell], beside, row.head[cell]};
                            const auto deviation = [&] {
                                return std::abs(row.centres[i][j][cell] -
                                                plane(corners, x, y, upper)) +
                                       radius;
                            };
                            of_cell = std::max(of_cell, deviation());
                            corners[1] -= rise;
                            double& of_midpoint = upper ? of_left : of_right;
                            of_midpoint = std::max(of_midpoint, deviation());
                            corners[centre_is_foot ? 0 : 2] -= row.centre_rise[cell];
                            of_centre = std::max(of_centre, deviation());
                        }
                    }
                }
                EXPECT_NEAR(row.cell[cell], of_cell, 1e-14);
                EXPECT_NEAR(row.right_most[cell], of_right, 1e-14);
                EXPECT_NEAR(row.left_most[cell], of_left, 1e-14);
                EXPECT_NEAR(row.centre_most[cell], of_centre, 1e-14);
            }
        }
    }
}

TEST(CellDeviation, KeepsWhatIsLargerAlready) {
    test::Random random(kSeed);
    Cells cells(true, true, random);
    std::fill_n(cells.row.cell, kCells, 100.0);
    std::fill_n(cells.row.left_most, kCells, 100.0);
    raise_deviations(SimdLevel::baseline)(cells.row);
    EXPECT_EQ(cells.row.cell[0], 100.0);
    EXPECT_EQ(cells.row.left_most[kCells - 1], 100.0);
    EXPECT_LT(cells.row.right_most[0], 100.0);
}

TEST(CellDeviation, EveryLevelGivesTheSameBits) {
    for (const SimdLevel level : {SimdLevel::avx2, SimdLevel::avx512}) {
        if (level > best_simd_level()) continue;
        for (const bool has_radii : {false, true}) {
            for (const bool centre_is_foot : {false, true}) {
                test::Random random(kSeed), again(kSeed);
                Cells one(has_radii, centre_is_foot, random),
                    other(has_radii, centre_is_foot, again);
                raise_deviations(SimdLevel::baseline)(one.row);
                raise_deviations(level)(other.row);
                EXPECT_EQ(one.values, other.values);
            }
        }
    }
}

}  // namespace cell_deviation_test
}  // namespace terrane::internal
