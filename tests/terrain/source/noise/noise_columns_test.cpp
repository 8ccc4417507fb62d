// SPDX-License-Identifier: MIT
#include "source/fractal/fractal_surface.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace terrane {
namespace noise_columns_test {

using internal::SimdLevel;

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};
constexpr std::uint64_t kSeed = 12;

/// Those that this machine runs.
std::vector<SimdLevel> levels() {
    std::vector<SimdLevel> all;
    for (const SimdLevel level : {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
        if (level <= internal::best_simd_level()) all.push_back(level);
    }
    return all;
}

NoiseCoordinate coordinate(double position) {
    const double cell = std::floor(position);
    return {static_cast<std::uint64_t>(static_cast<std::int64_t>(cell)), position - cell};
}

TEST(NoiseColumns, RowsHaveTheBitsOfSinglePoints) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    for (const SimdLevel level : levels()) {
        NoiseColumns columns(internal::noise_kernels(level));
        // also steps at which lanes of a group lie in as many cells as there are lanes, or more
        for (const double step : {0.0, 0.01, 0.25, 0.5, 0.7, 0.9, 0.999, 1.0, 1.5, 4.0, 1e5}) {
            for (const std::size_t count : {1u, 7u, 100u, 136u}) {
                const NoiseKeys keys = NoiseKeys::make(random.bits(), 0);
                const double west = random.between(-5e5, 5e5);
                std::vector<NoiseCoordinate> coordinates;
                for (std::size_t column = 0; column < count; ++column) {
                    coordinates.push_back(coordinate(west + step * static_cast<double>(column)));
                }
                columns.assign(keys.x, kAllCells, coordinates);
                double south = random.between(0.0, 1.0);
                for (const double up :
                     {0.0, 0.3, 0.9, 1.0, 5.0, -2.0}) {  // the next cell, and jumps
                    south += up;
                    internal::NoiseRow row;
                    columns.find_row(keys.y, kAllCells, coordinate(south), row);
                    alignas(64) double sums[internal::kMaxNoiseColumns];
                    for (double& sum : sums) sum = 1.0;
                    columns.add(row, 3.0, sums);
                    const NoisePlace y = noise_place(keys.y, kAllCells, coordinate(south));
                    for (std::size_t column = 0; column < count; ++column) {
                        const NoisePlace x = noise_place(keys.x, kAllCells, coordinates[column]);
                        ASSERT_EQ(sums[column], 1.0 + 3.0 * noise(x, y))
                            << "level " << static_cast<int>(level) << ", step " << step;
                    }
                }
            }
        }
    }
}

TEST(NoiseColumns, UnitsWrapAsSinglePointsDo) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    for (const SimdLevel level : levels()) {
        NoiseColumns columns(internal::noise_kernels(level));
        for (const int shift : {4, 24, 48}) {
            const internal::NoiseAxis axis = {random.bits(), random.bits(), shift,
                                              std::ldexp(1.0, -shift)};
            for (const int step_log2 : {0, shift - 2, shift, shift + 3}) {
                const std::uint64_t step = std::uint64_t{1} << step_log2;
                const std::uint64_t first = 0 - axis.offset - 50 * step - (random.bits() & 7);
                columns.assign(axis, first, step, 100);
                internal::NoiseRow row;
                const NoisePlace y = noise_place(axis, first, 0.0);
                columns.find_row(axis.key, kAllCells >> shift, {y.cell, y.fraction}, row);
                alignas(64) double sums[internal::kMaxNoiseColumns] = {};
                columns.add(row, 1.0, sums);
                for (std::uint64_t column = 0; column < 100; ++column) {
                    ASSERT_EQ(sums[column],
                              noise(noise_place(axis, first + step * column, 0.0), y) + 0.0)
                        << "level " << static_cast<int>(level) << ", shift " << shift;
                }
            }
        }
    }
}

/// Points within `reach` of one another along each axis, from `before` units below the wrap of an
/// octave's units on.
void scatter(test::Random& random, const internal::NoiseOctave& octave, int count,
             std::uint64_t before, std::uint64_t reach, internal::NoisePoints& points_out) {
    points_out.count = count;
    for (int point = 0; point < count; ++point) {
        points_out.x[point] = 0 - octave.x.offset + (random.bits() % reach) - before;
        points_out.y[point] = 0 - octave.y.offset + (random.bits() % reach) - before;
        if (point % 16 > 8) points_out.x[point] = points_out.x[point - 8];
        if (point % 32 > 8) points_out.y[point] = points_out.y[point - 8];
        points_out.rest_x[point] = random.between(0.0, 1.0);
        points_out.rest_y[point] = random.between(0.0, 1.0);
    }
}

TEST(NoisePoints, HaveTheBitsOfSinglePoints) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    internal::NoisePoints points;
    for (const SimdLevel level : levels()) {
        const internal::NoiseKernels& kernels = internal::noise_kernels(level);
        for (const int shift : {4, 24, 48}) {
            const auto axis = [&] {
                return internal::NoiseAxis{random.bits(), random.bits(), shift,
                                           std::ldexp(1.0, -shift)};
            };
            const internal::NoiseOctave octave = {axis(), axis(), 3.0};
            const std::uint64_t cell = std::uint64_t{1} << shift;
            // in one cell or a few, in as many as a patch of nodes has room for and in just too
            // many, in far too many, and anywhere
            for (const std::uint64_t reach :
                 {cell / 8, 3 * cell, 38 * cell, 44 * cell, 999 * cell, ~std::uint64_t{0}}) {
                for (const int count : {8, 136, internal::kMaxNoisePoints}) {
                    scatter(random, octave, count, count == 136 ? 0 : reach / 2, reach, points);
                    kernels.enclose(points);
                    alignas(64) double sums[internal::kMaxNoisePoints];
                    for (double& sum : sums) sum = 1.0;
                    kernels.add_points(octave, points, sums);
                    for (int point = 0; point < count; ++point) {
                        const NoisePlace x =
                            noise_place(octave.x, points.x[point], points.rest_x[point]);
                        const NoisePlace y =
                            noise_place(octave.y, points.y[point], points.rest_y[point]);
                        ASSERT_EQ(sums[point], 1.0 + 3.0 * noise(x, y))
                            << "level " << static_cast<int>(level) << ", shift " << shift
                            << ", reach " << reach;
                    }
                }
            }
        }
    }
}

TEST(NoisePoints, MoveByWholeUnitsAndRestsAndAreEnclosed) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    internal::NoisePoints points, moved;
    alignas(64) double shifts[2][internal::kMaxNoisePoints];
    for (const SimdLevel level : levels()) {
        const internal::NoiseKernels& kernels = internal::noise_kernels(level);
        for (const double far : {1e-9, 1.0, 1e6}) {
            scatter(random, {}, internal::kMaxNoisePoints, 1 << 19, 1 << 20, points);
            moved = points;
            for (auto& axis_shifts : shifts) {
                for (double& shift : axis_shifts) shift = random.between(-far, far);
            }
            kernels.move(moved, 8, 16, 256.0, shifts[0], shifts[1]);  // all but the first 8
            moved.count = 24;
            kernels.enclose(moved);
            bool is_at_edge[4] = {};
            for (int point = 0; point < moved.count; ++point) {
                const double shift = point < 8 ? 0.0 : shifts[0][point - 8] * 256.0;
                const double from = points.rest_x[point] + shift;
                const double whole = std::floor(from);
                EXPECT_EQ(moved.x[point] - points.x[point],
                          static_cast<std::uint64_t>(static_cast<std::int64_t>(whole)));
                EXPECT_EQ(moved.rest_x[point], from - whole);
                const std::uint64_t x = moved.x[point] - moved.low_x;
                const std::uint64_t y = moved.y[point] - moved.low_y;
                EXPECT_LE(x, moved.extent_x);
                EXPECT_LE(y, moved.extent_y);
                is_at_edge[0] |= x == 0;
                is_at_edge[1] |= x == moved.extent_x;
                is_at_edge[2] |= y == 0;
                is_at_edge[3] |= y == moved.extent_y;
            }
            for (const bool is_at : is_at_edge) EXPECT_TRUE(is_at);
        }
    }
}

}  // namespace noise_columns_test
}  // namespace terrane
