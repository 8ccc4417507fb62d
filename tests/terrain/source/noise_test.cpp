// SPDX-License-Identifier: MIT
#include "source/fractal/noise.h"

#include "source/fractal/fractal_surface.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <vector>

namespace terrane::noise_test {

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};

NoiseCoordinate coordinate(double position) {
    const double cell = std::floor(position);
    return {static_cast<std::uint64_t>(static_cast<std::int64_t>(cell)), position - cell};
}

double noise_at(const NoiseKeys& keys, double x, double y) {
    return noise(noise_place(keys.x, kAllCells, coordinate(x)),
                 noise_place(keys.y, kAllCells, coordinate(y)));
}

/// A closed interval, without outward rounding: kSlack below covers the rounding errors.
struct Interval {
    double low = 0.0, high = 0.0;

    double magnitude() const { return std::max(std::abs(low), std::abs(high)); }
    Interval squared() const {
        const double far = magnitude();
        const double near =
            low <= 0.0 && high >= 0.0 ? 0.0 : std::min(std::abs(low), std::abs(high));
        return {near * near, far * far};
    }
};

Interval operator+(Interval a, Interval b) { return {a.low + b.low, a.high + b.high}; }
Interval operator*(Interval a, Interval b) {
    const auto [low, high] =
        std::minmax({a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high});
    return {low, high};
}
Interval operator*(double a, Interval b) { return Interval{a, a} * b; }

/// Range of a function over an interval, from its value at the centre and a bound of its derivative.
Interval around(double middle, double derivative, double half) {
    return {middle - derivative * half, middle + derivative * half};
}

double fade(double t) { return t * t * t * (10.0 + t * (6.0 * t - 15.0)); }
double fade1(double t) { return 30.0 * t * t * (1.0 - t) * (1.0 - t); }
double fade2(double t) { return 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t); }
double fade3(double t) { return 60.0 * (1.0 + t * (6.0 * t - 6.0)); }

/// Weight of the lower node along an axis, with two derivatives; the upper node's weight is its mirror image.
struct Weight {
    Interval value, first, second;
};

/// Range of the weight over t = middle +- half, by the mean value form. fade3 is a parabola, so its largest magnitude
/// over an interval is at an end or at 1/2; the lower derivatives follow from it.
Weight weight(double middle, double half, bool upper) {
    const double low = std::max(middle - half, 0.0), high = std::min(middle + half, 1.0);
    double third = std::max(std::abs(fade3(low)), std::abs(fade3(high)));
    if (low < 0.5 && high > 0.5) third = std::max(third, std::abs(fade3(0.5)));
    const Interval second = around(fade2(middle), third, half);
    const Interval first = around(fade1(middle), second.magnitude(), half);
    const Interval value = around(fade(middle), first.magnitude(), half);
    if (upper) return {value, first, second};
    return {Interval{1.0, 1.0} + -1.0 * value, -1.0 * first, -1.0 * second};
}

/// A box of positions in a cell and of directions e = (1, k) / sqrt(1 + k^2).
struct Box {
    std::array<double, 3> middle;  ///< x, y, k
    std::array<double, 3> half;
};

/// Upper bounds over a box of the two sums in noise.cpp, slope and curvature.
std::array<double, 2> bound_over(const Box& box) {
    const Interval x = around(box.middle[0], 1.0, box.half[0]);
    const Interval y = around(box.middle[1], 1.0, box.half[1]);
    const Interval k = around(box.middle[2], 1.0, box.half[2]);
    const double length_squared = 1.0 + k.low * k.low;  // k >= 0: the shortest (1, k) in the box
    double slope = 0.0, curvature = 0.0;
    for (const bool east : {false, true}) {
        const Weight wx = weight(box.middle[0], box.half[0], east);
        const Interval dx = x + Interval{east ? -1.0 : 0.0, east ? -1.0 : 0.0};
        for (const bool north : {false, true}) {
            const Weight wy = weight(box.middle[1], box.half[1], north);
            const Interval dy = y + Interval{north ? -1.0 : 0.0, north ? -1.0 : 0.0};
            const Interval w = wx.value * wy.value;
            const Interval along = wx.first * wy.value + k * (wx.value * wy.first);
            const Interval twice = wx.second * wy.value + 2.0 * (k * (wx.first * wy.first)) +
                                   k.squared() * (wx.value * wy.second);
            const Interval slope_x = w + along * dx, slope_y = k * w + along * dy;
            const Interval bend_x = 2.0 * along + twice * dx;
            const Interval bend_y = 2.0 * (k * along) + twice * dy;
            slope += std::sqrt(slope_x.squared().high + slope_y.squared().high);
            curvature += std::sqrt(bend_x.squared().high + bend_y.squared().high);
        }
    }
    return {slope / std::sqrt(length_squared), curvature / length_squared};
}

/// Whether bound_over() is below a limit over a whole box; subdivides where it is not.
bool stays_below(const Box& box, std::size_t which, double limit, std::size_t& boxes_left) {
    std::vector<Box> open = {box};
    while (!open.empty()) {
        if (boxes_left == 0) return false;
        --boxes_left;
        const Box here = open.back();
        open.pop_back();
        if (bound_over(here)[which] < limit) continue;
        const std::size_t axis =
            static_cast<std::size_t>(std::ranges::max_element(here.half) - here.half.begin());
        Box part = here;
        part.half[axis] *= 0.5;
        part.middle[axis] = here.middle[axis] - part.half[axis];
        open.push_back(part);
        part.middle[axis] = here.middle[axis] + part.half[axis];
        open.push_back(part);
    }
    return true;
}

// Swapping x and y gives e_x >= e_y, mirroring x gives k >= 0; a half turn maps a cell to itself and a direction to its
// opposite, so x <= 1/2 suffices.
constexpr Box kEverything = {{0.25, 0.5, 0.5}, {0.25, 0.5, 0.5}};
constexpr double kSlack = 1e-9;  // far above the rounding of bound_over()
constexpr std::size_t kMostBoxes = 30'000'000;

TEST(Noise, SlopeBoundIsProvedByIntervals) {
    std::size_t boxes_left = kMostBoxes;
    EXPECT_TRUE(stays_below(kEverything, 0, kNoiseSlope - kSlack, boxes_left));
    // the proof detects a constant that is too small
    boxes_left = 100'000;
    EXPECT_FALSE(stays_below(kEverything, 0, 2.069, boxes_left));
}

TEST(Noise, CurvatureBoundIsProvedByIntervals) {
    std::size_t boxes_left = kMostBoxes;
    EXPECT_TRUE(stays_below(kEverything, 1, kNoiseCurvature - kSlack, boxes_left));
    boxes_left = 100'000;
    EXPECT_FALSE(stays_below(kEverything, 1, 9.235, boxes_left));
}

TEST(Noise, MeasuredExtremesLieBelowTheBoundsAndNotFarBelow) {
    constexpr std::uint64_t kSeed = 11;
    test::SeededRandom random(kSeed);
    const NoiseKeys keys = NoiseKeys::make(kSeed, 0);
    double value = 0.0, slope = 0.0, curvature = 0.0;
    constexpr double kStep = 0x1p-12;
    for (int trial = 0; trial < 1'000'000; ++trial) {
        const double x = random.between(0.0, 1e6), y = random.between(0.0, 1e6);
        const double here = noise_at(keys, x, y);
        const double east = noise_at(keys, x + kStep, y), west = noise_at(keys, x - kStep, y);
        const double north = noise_at(keys, x, y + kStep), south = noise_at(keys, x, y - kStep);
        value = std::max(value, std::abs(here));
        slope = std::max(slope, std::hypot(east - west, north - south) / (2.0 * kStep));
        curvature = std::max({curvature, std::abs(east + west - 2.0 * here) / (kStep * kStep),
                              std::abs(north + south - 2.0 * here) / (kStep * kStep)});
    }
    EXPECT_LE(value, kNoiseSup);
    EXPECT_LE(slope, kNoiseSlope);
    EXPECT_LE(curvature, kNoiseCurvature);
    EXPECT_GE(2.0 * value, kNoiseSup);
    EXPECT_GE(2.0 * slope, kNoiseSlope);
    EXPECT_GE(2.0 * curvature, kNoiseCurvature);
}

TEST(Noise, IsZeroAtItsNodes) {
    const NoiseKeys keys = NoiseKeys::make(5, 3);
    for (int x = -20; x < 20; ++x) {
        for (int y = -20; y < 20; ++y) EXPECT_EQ(noise_at(keys, x, y), 0.0);
    }
}

TEST(Noise, IsContinuousWhereNodesWrap) {
    const NoiseKeys keys = NoiseKeys::make(5, 3);
    constexpr std::uint64_t kMask = 0xff;
    const NoisePlace y = noise_place(keys.y, kMask, {7, 0.3});
    const double before = noise(noise_place(keys.x, kMask, {0xff, 1.0 - 0x1p-40}), y);
    const double after = noise(noise_place(keys.x, kMask, {0, 0.0}), y);
    EXPECT_NEAR(before, after, 1e-11);
}

TEST(Noise, SeedsOctavesAxesAndDistantCellsDiffer) {
    std::set<double> seen;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        for (int octave = 0; octave < 10; ++octave) {
            const NoiseKeys keys = NoiseKeys::make(seed, octave);
            for (const double far : {0.0, 1e9, 1e15}) {
                seen.insert(noise_at(keys, far + 0.25, 0.625));
                seen.insert(noise_at(keys, 0.625, far + 0.25));
            }
        }
    }
    EXPECT_GE(seen.size(), 490u);  // at least 490 distinct values among 600
}

TEST(Noise, GradientsShowNoPreferredSignOrNeighbour) {
    const NoiseKeys keys = NoiseKeys::make(77, 0);
    double mean = 0.0, square = 0.0, beside = 0.0, above = 0.0;
    constexpr int kSide = 400;
    for (int x = 0; x < kSide; ++x) {
        for (int y = 0; y < kSide; ++y) {
            const double here = noise_at(keys, x + 0.5, y + 0.5);
            mean += here;
            square += here * here;
            beside += here * noise_at(keys, x + 2.5, y + 0.5);
            above += here * noise_at(keys, x + 0.5, y + 2.5);
        }
    }
    // sums of independent values stay within five standard deviations
    EXPECT_LE(std::abs(mean), 5.0 * std::sqrt(square));
    EXPECT_LE(std::abs(beside), 5.0 * square / kSide);
    EXPECT_LE(std::abs(above), 5.0 * square / kSide);
}

}  // namespace terrane::noise_test

namespace terrane::noise_columns_test {

using internal::SimdLevel;
using noise_test::coordinate;
using noise_test::kAllCells;

constexpr std::uint64_t kSeed = 12;

/// The kernels that this machine supports.
std::vector<SimdLevel> levels() {
    std::vector<SimdLevel> all;
    for (const SimdLevel level : {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
        if (level <= internal::best_simd_level()) all.push_back(level);
    }
    return all;
}

TEST(NoiseColumns, RowsHaveTheBitsOfSinglePoints) {
    test::SeededRandom random(kSeed);
    for (const SimdLevel level : levels()) {
        NoiseColumns columns(internal::noise_kernels(level));
        // includes steps at which the lanes of a vector are all in different cells
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
    test::SeededRandom random(kSeed);
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

/// Random points within `reach` of one another along each axis, starting `before` units below the wrap of an octave's
/// integer coordinates.
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
    test::SeededRandom random(kSeed);
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
            // in one or a few cells; in as many as a patch of nodes holds, in slightly more, in far more, and anywhere
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
    test::SeededRandom random(kSeed);
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

}  // namespace terrane::noise_columns_test
