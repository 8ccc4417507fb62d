// SPDX-License-Identifier: MIT
//
// Deviations of rows of edges and squares: the same bits at all levels of vector instructions as one by one.
#include "bilinear/diamond_window.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

namespace terrane::test {
namespace deviation_rows_test {

using internal::cell_deviation;
using internal::CornerHeight;
using internal::DeviationRows;
using internal::DiamondWindow;
using internal::PhasedHeights;
using internal::SimdLevel;
using internal::TriangleShape;

constexpr std::uint64_t kSeed = 49;

DiamondWindow random_window(int columns, int rows, Random& random) {
    DiamondWindow window;
    window.columns = columns;
    window.rows = rows;
    const double roughness = random.between(0.0, 50.0);
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
            // Whole numbers have ties, and planes have none but rounding.
            const double height = 0.3 * x - 0.7 * y + roughness * random.between(-1.0, 1.0);
            window.heights.push_back(roughness < 10.0 ? std::round(height) : height);
        }
    }
    return window;
}

/// The largest deviation over a triangle: at lattice points, and at many places of the hypotenuse.
double sampled_deviation(const DiamondWindow& window, int x, int y, int sign_x, int sign_y, int n,
                         double at_corner) {
    const auto height = [&](int i, int j) {
        return window.heights[window.at(x + i * sign_x, y + j * sign_y)];
    };
    const double slope_x = (height(n, 0) - at_corner) / n, slope_y = (height(0, n) - at_corner) / n;
    double largest = 0.0;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i + j <= n; ++i) {
            largest = std::max(largest,
                               std::fabs(height(i, j) - (at_corner + i * slope_x + j * slope_y)));
        }
    }
    constexpr int kPlaces = 64;
    for (int j = 0; j < n; ++j) {
        const int i = n - 1 - j;
        for (int k = 0; k <= kPlaces; ++k) {
            const double u = static_cast<double>(k) / kPlaces, v = 1.0 - u;
            const double surface = (1 - u) * (1 - v) * height(i, j) +
                                   u * (1 - v) * height(i + 1, j) + (1 - u) * v * height(i, j + 1) +
                                   u * v * height(i + 1, j + 1);
            largest = std::max(
                largest, std::fabs(surface - (at_corner + (i + u) * slope_x + (j + v) * slope_y)));
        }
    }
    return largest;
}

double sampled_edge(const DiamondWindow& window, int x, int y, int n, bool along_x) {
    const auto height = [&](int i, int j) { return window.heights[window.at(i, j)]; };
    const double middle = along_x ? 0.5 * (height(x - n, y) + height(x + n, y))
                                  : 0.5 * (height(x, y - n) + height(x, y + n));
    double largest = 0.0;
    for (const int sign_x : {-1, 1}) {
        for (const int sign_y : {-1, 1}) {
            largest = std::max(largest, sampled_deviation(window, x, y, sign_x, sign_y, n, middle));
        }
    }
    return largest;
}

TEST(DeviationRows, OfSquaresAreThoseOfEachSquare) {
    SeededRandom random(kSeed);
    for (int n = 1; n <= 16; n *= 2) {
        for (int i = 0; i < 20; ++i) {
            DiamondWindow window = random_window(
                n * (1 + static_cast<int>(random.between(0, 24))) + 1, 2 * n + 1, random);
            window.first_x = n * static_cast<int>(random.between(-3, 4));
            window.first_y = n * static_cast<int>(random.between(-3, 4));
            DeviationRows rows(window);
            for (int y = 0; y + n < window.rows; y += n) {
                std::vector<float> deviations(static_cast<std::size_t>((window.columns - 1) / n));
                rows.squares(0, y, n, deviations);
                for (std::size_t k = 0; k < deviations.size(); ++k) {
                    EXPECT_EQ(deviations[k], cell_deviation(window, n * static_cast<int>(k), y, n))
                        << n << ", " << k;
                }
            }
        }
    }
}

TEST(DeviationRows, OfEdgesAreTheLargestOverTheirTriangles) {
    SeededRandom random(kSeed);
    for (int n = 1; n <= 16; n *= 2) {
        for (int i = 0; i < 10; ++i) {
            const int count = 1 + static_cast<int>(random.between(0, 12));
            const DiamondWindow window = random_window(2 * n * count + 1, 2 * n + 1, random);
            DeviationRows rows(window);
            for (const bool along_x : {false, true}) {
                std::vector<float> deviations(static_cast<std::size_t>(count));
                rows.edges(n, n, n, along_x, deviations);
                for (int k = 0; k < count; ++k) {
                    const double sampled = sampled_edge(window, n + 2 * n * k, n, n, along_x);
                    const double found = deviations[static_cast<std::size_t>(k)];
                    EXPECT_GE(found, sampled) << n << ", " << k;
                    // the extreme of a hypotenuse lies between two places
                    EXPECT_LE(found, sampled * 1.001 + 1e-5) << n << ", " << k;
                }
            }
        }
    }
}

TEST(DeviationRows, OfEqualColumnsAreEqual) {
    SeededRandom random(kSeed);
    DiamondWindow window = random_window(65, 9, random);
    for (int y = 0; y < window.rows; ++y) {
        const auto row = window.heights.begin() + static_cast<std::ptrdiff_t>(window.at(0, y));
        std::fill(row, row + 24, row[24]);
    }
    DiamondWindow with_runs = window;
    with_runs.find_runs();
    ASSERT_TRUE(with_runs.has_equal_columns(0, 24));
    for (const int n : {1, 2, 4}) {
        std::vector<float> one(static_cast<std::size_t>(64 / n)), other = one;
        DeviationRows(window).squares(0, 0, n, one);
        DeviationRows(with_runs).squares(0, 0, n, other);
        EXPECT_EQ(one, other);
        one.resize(static_cast<std::size_t>(32 / n));
        other.resize(one.size());
        DeviationRows(window).edges(n, 4, n, true, one);
        DeviationRows(with_runs).edges(n, 4, n, true, other);
        EXPECT_EQ(one, other);
    }
}

TEST(DeviationRows, EveryLevelGivesTheSameBits) {
    SeededRandom random(kSeed);
    for (const int leg : {1, 2, 4, 8, 32}) {
        for (const CornerHeight corner :
             {CornerHeight::surface, CornerHeight::mean_x, CornerHeight::mean_y}) {
            for (int count = 1; count <= 19; count += 3) {
                const int stride = 2 * leg, columns = stride * count + 1, rows = 2 * leg + 1;
                const DiamondWindow window = random_window(columns, rows, random);
                PhasedHeights heights;
                for (heights.log2_stride = 0; 1 << heights.log2_stride < stride;)
                    ++heights.log2_stride;
                heights.pitch = static_cast<std::size_t>(count + 1 + internal::kPhasePadding);
                std::vector<double> values(static_cast<std::size_t>(rows * stride) * heights.pitch);
                for (int y = 0; y < rows; ++y) {
                    for (int x = 0; x < columns; ++x) {
                        values[static_cast<std::size_t>(y * stride + x % stride) * heights.pitch +
                               static_cast<std::size_t>(x / stride)] =
                            window.heights[window.at(x, y)];
                    }
                }
                heights.values = values.data();
                const std::array<TriangleShape, 2> shapes{
                    {{0, 0, 1, -1, leg, corner}, {0, 0, -1, 1, leg, corner}}};
                const auto find = [&](SimdLevel level) {
                    std::vector<float> found(static_cast<std::size_t>(count) + 1, -1.0f);
                    find_triangle_deviations(level)(heights, shapes.data(), 2, leg, leg, count,
                                                    found.data());
                    EXPECT_EQ(found.back(), -1.0f) << "written beyond the end";
                    return found;
                };
                const std::vector<float> baseline = find(SimdLevel::baseline);
                for (const SimdLevel level : {SimdLevel::avx2, SimdLevel::avx512}) {
                    if (level > internal::best_simd_level()) continue;
                    const std::vector<float> found = find(level);
                    EXPECT_EQ(
                        std::memcmp(found.data(), baseline.data(), found.size() * sizeof(float)), 0)
                        << leg;
                }
            }
        }
    }
}

}  // namespace deviation_rows_test
}  // namespace terrane::test
