// SPDX-License-Identifier: MIT
#include "source/cell_deviation.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"
#include "source/fractal/noise.h"
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace terrane::fractal_bounds_test {

constexpr std::uint64_t kSeed = 51;

class FractalBoundsOfKind : public testing::TestWithParam<FractalKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, FractalBoundsOfKind, test::kAllFractalKinds);

/// @param strong  whether a kind deviates from a sum of octaves as much as possible
FractalSettings rough(FractalKind kind, std::uint64_t seed, bool strong = false) {
    if (strong) {
        return {.seed = seed,
                .kind = kind,
                .octave_count = 3,
                .amplitude = 100.0,
                .wavelength_log2 = 9,
                .heterogeneity = 1.0,
                .crest_rounding = 1.0 / 64.0,
                .warp = 1.0};
    }
    return {
        .seed = seed, .kind = kind, .octave_count = 10, .amplitude = 100.0, .wavelength_log2 = 9};
}

/// Coordinates are multiples of 2^-20 m, so that sums with eighths of them are exact 10^9 m away.
double to_grid(double metres) { return std::floor(metres * 0x1p20) * 0x1p-20; }

struct Triangle {
    double x, y;          ///< corner with the right angle
    double leg_x, leg_y;  ///< one leg
    double other;         ///< length of the other leg relative to this one, 0 to 1 in eighths
    double height(const FractalSurface& surface, double along, double across) const {
        return surface.height(x + along * leg_x - across * other * leg_y,
                              y + along * leg_y + across * other * leg_x);
    }
};

/// Largest deviation from linear interpolation at some points of a triangle.
double deviation(const FractalSurface& surface, const Triangle& triangle, test::Random& random) {
    const double corner = triangle.height(surface, 0.0, 0.0);
    const double east = triangle.height(surface, 1.0, 0.0);
    const double north = triangle.height(surface, 0.0, 1.0);
    double largest = 0.0;
    const auto look = [&](double along, double across) {
        const double plane = corner + along * (east - corner) + across * (north - corner);
        largest = std::max(largest, std::abs(triangle.height(surface, along, across) - plane));
    };
    look(0.5, 0.5);
    look(0.5, 0.0);
    look(0.25, 0.375);
    const int along = random.below(9);
    look(0.125 * along, 0.125 * random.below(9 - along));
    return largest;
}

/// Hill climbing from random starts to a position and direction with a large function value.
template <class Function>
double climb(double far, double length, int starts, const Function& function,
             test::Random& random) {
    std::array<double, 3> best{}, place{};
    double largest = 0.0;
    const auto look = [&] {
        const double value = function(place[0], place[1], place[2]);
        if (value <= largest) return false;
        largest = value;
        best = place;
        return true;
    };
    for (int start = 0; start < starts; ++start) {
        place = {to_grid(far + random.between(-1e5, 1e5)), to_grid(random.between(-1e5, 1e5) - far),
                 random.between(0.0, 6.3)};
        look();
    }
    for (double reach = length; reach > 0.001 * length; reach *= 0.9) {
        for (int trial = 0; trial < 20; ++trial) {
            place = {to_grid(best[0] + random.between(-reach, reach)),
                     to_grid(best[1] + random.between(-reach, reach)),
                     best[2] + random.between(-1.0, 1.0) * reach / length};
            look();
        }
    }
    return largest;
}

/// Searches for triangles of a given hypotenuse with large deviations, and compares these with the bound.
///
/// @param most  largest allowed ratio of the bound to the largest deviation found
void check_interpolation(const FractalSurface& surface, double far, double length, double most,
                         test::Random& random) {
    const auto measured = [&](double x, double y, double angle) {
        Triangle triangle{x, y, 0.0, 0.0, 0.125 * (8 - random.below(3))};
        const double leg = length / std::sqrt(1.0 + triangle.other * triangle.other);
        triangle.leg_x = to_grid(leg * std::cos(angle));
        triangle.leg_y = to_grid(leg * std::sin(angle));
        return deviation(surface, triangle, random);
    };
    const double largest = climb(far, length, 800, measured, random);
    const double bound =
        FractalBounds(surface).interpolation(length * (1.0 + 1e-4));  // legs are rounded
    std::printf("  hypotenuse %10g m at %g: measured %.4g, bound %.4g, ratio %.2f\n", length, far,
                largest, bound, bound / largest);
    EXPECT_LE(largest, bound);
    EXPECT_LE(bound, most * largest);
}

TEST_P(FractalBoundsOfKind, InterpolationIsNeverWorseThanItsBoundAndNotAbsurdlyBetter) {
    test::SeededRandom random(kSeed);
    for (const double far : {0.0, 1e9}) {
        for (const double length : {0x1p-6, 0.25, 1.0, 4.0, 16.0, 64.0, 256.0, 2048.0}) {
            const FractalSurface surface(rough(GetParam(), random.bits()));
            check_interpolation(surface, far, length, 16.0, random);
        }
    }
}

TEST_P(FractalBoundsOfKind, InterpolationKeepsItsBoundWhereAKindIsAsStrongAsItCanBe) {
    test::SeededRandom random(kSeed);
    for (const double length : {0x1p-6, 1.0, 8.0, 64.0}) {
        const FractalSurface surface(rough(GetParam(), random.bits(), true));
        check_interpolation(surface, 0.0, length, 64.0, random);
    }
}

TEST_P(FractalBoundsOfKind, RiseIsNeverMoreThanItsBoundAndNotAbsurdlyLess) {
    test::SeededRandom random(kSeed);
    for (const double far : {0.0, 1e9}) {
        for (const double length : {0x1p-6, 0.25, 4.0, 64.0, 2048.0}) {
            const FractalSurface surface(rough(GetParam(), random.bits()));
            const FractalBounds bounds(surface);
            const auto measured = [&](double x, double y, double angle) {
                return std::abs(surface.height(x + to_grid(length * std::cos(angle)),
                                               y + to_grid(length * std::sin(angle))) -
                                surface.height(x, y));
            };
            const double largest = climb(far, length, 2000, measured, random);
            const double bound = bounds.rise(length * (1.0 + 1e-4));  // steps are rounded
            std::printf("  distance %10g m at %g: measured %.4g, bound %.4g, ratio %.2f\n", length,
                        far, largest, bound, bound / largest);
            EXPECT_LE(largest, bound);
            EXPECT_LE(bound, 10.0 * largest);
        }
    }
}

TEST_P(FractalBoundsOfKind, RangeContainsEveryHeight) {
    test::SeededRandom random(kSeed);
    const FractalSurface surface(rough(GetParam(), kSeed));
    const HeightInterval range = FractalBounds(surface).range();
    const auto up = [&](double x, double y, double) { return surface.height(x, y) - range.low; };
    const auto down = [&](double x, double y, double) { return range.high - surface.height(x, y); };
    const double length = range.high - range.low;
    const double highest = climb(0.0, 64.0, 20'000, up, random);
    const double lowest = climb(0.0, 64.0, 20'000, down, random);
    std::printf("  heights %.4g to %.4g within %.4g to %.4g\n", range.high - lowest,
                range.low + highest, range.low, range.high);
    EXPECT_LE(highest, length);
    EXPECT_LE(lowest, length);
    EXPECT_GE(highest, 0.6 * length);
    EXPECT_GE(lowest, 0.6 * length);
}

TEST_P(FractalBoundsOfKind, BoundsDoNotDecrease) {
    for (const double gain : {0.3, 0.7, 1.0}) {
        FractalSettings settings = rough(GetParam(), kSeed);
        settings.gain = gain;
        const FractalSurface surface(settings);
        const FractalBounds bounds(surface);
        double bend = 0.0, rise = 0.0;
        for (double length = 1e-9; length < 1e6; length *= 1.01) {
            EXPECT_GE(bounds.interpolation(length), bend);
            EXPECT_GE(bounds.rise(length), rise);
            bend = bounds.interpolation(length);
            rise = bounds.rise(length);
        }
    }
}

TEST(FractalBounds, WithoutWarpTheyAreThoseOfTheSum) {
    FractalSettings settings = rough(FractalKind::warped, kSeed);
    settings.warp = 0.0;
    const FractalSurface warped(settings);
    settings.kind = FractalKind::fbm;
    const FractalSurface fbm(settings);
    for (const double length : {0.01, 1.0, 100.0}) {
        EXPECT_NEAR(FractalBounds(warped).interpolation(length),
                    FractalBounds(fbm).interpolation(length), 1e-9);
        EXPECT_NEAR(FractalBounds(warped).rise(length), FractalBounds(fbm).rise(length), 1e-9);
    }
}

// Sampling rarely meets the worst case of all octaves at once and would miss an omitted term; in this test every term
// matters.
TEST(FractalBounds, TinyTrianglesBendAsTheChainAndProductRulesSay) {
    constexpr double kWavelength = 512.0, kAmplitude = 100.0, kGain = 0.5, kTiny = 0.05;
    constexpr double kSlope = kNoiseSlope / kWavelength;
    constexpr double kCurvature = kNoiseCurvature / (kWavelength * kWavelength);
    FractalSettings settings = {.kind = FractalKind::ridged,
                                .octave_count = 2,
                                .amplitude = kAmplitude,
                                .wavelength_log2 = 9,
                                .gain = kGain,
                                .heterogeneity = 0.6,
                                .crest_rounding = 0.5,
                                .warp = 0.3};
    const auto expect = [&](double slope, double curvature) {
        const FractalSurface surface(settings);
        const FractalBounds bounds(surface);
        EXPECT_NEAR(bounds.rise(kTiny) / (slope * kTiny), 1.0, 1e-5);
        EXPECT_NEAR(bounds.interpolation(2.0 * kTiny) / (0.5 * curvature * kTiny * kTiny), 1.0,
                    1e-4);
    };
    for (const bool ridged : {true, false}) {
        settings.kind = ridged ? FractalKind::ridged : FractalKind::hybrid;
        const double along = ridged ? std::sqrt(2.0) : std::sqrt(0.5);
        const double first_slope = along * kSlope, second_slope = 2.0 * first_slope;
        const double first_curvature = along * kCurvature + (ridged ? 4.0 * kSlope * kSlope : 0.0);
        const double slope = first_slope + kGain * (second_slope + 0.6 * first_slope);
        const double curvature =
            first_curvature + kGain * (4.0 * first_curvature + 0.6 * first_curvature +
                                       2.0 * second_slope * 0.6 * first_slope);
        expect(kAmplitude * slope, kAmplitude * curvature);
    }
    settings.kind = FractalKind::warped;
    settings.octave_count = 1;
    const double warp = 0.3 * kWavelength;
    const double warp_slope = std::sqrt(2.0) * warp * kSlope * (1.0 + 2.0 * kGain);
    const double warp_curvature = std::sqrt(2.0) * warp * kCurvature * (1.0 + 4.0 * kGain);
    expect(kAmplitude * kSlope * (1.0 + warp_slope),
           kAmplitude *
               (kCurvature * (1.0 + warp_slope) * (1.0 + warp_slope) + kSlope * warp_curvature));
}

}  // namespace terrane::fractal_bounds_test

namespace terrane::internal::cell_deviation_test {

constexpr std::uint64_t kSeed = 67;
constexpr int kCells = 3 * kCellGroup;
constexpr int kSide = kCellSamples;

/// Random cells and the data that CellRow points to.
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
    test::SeededRandom random(kSeed);
    for (const bool has_radii : {false, true}) {
        for (const bool centre_is_foot : {false, true}) {
            Cells cells(has_radii, centre_is_foot, random);
            const CellRow& row = cells.row;
            find_max_deviations(SimdLevel::baseline)(row);
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
    find_max_deviations(SimdLevel::baseline)(cells.row);
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
                find_max_deviations(SimdLevel::baseline)(one.row);
                find_max_deviations(level)(other.row);
                EXPECT_EQ(one.values, other.values);
            }
        }
    }
}

}  // namespace terrane::internal::cell_deviation_test
