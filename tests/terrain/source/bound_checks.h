// SPDX-License-Identifier: MIT
#pragma once

#include "source/source_checks.h"
#include "support/random.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

/// check_source()'s checks of the promises of a HeightSource, on chosen grids. Failures are added to the running test.
namespace terrane::test {

using Triangle = internal::LatticeTriangle;

/// Largest deviation of the true surface from the triangle over the corners, at random points.
inline double measure(const HeightSource& source, const Triangle& triangle, int points,
                      Random& random) {
    const Lattice& lattice = source.lattice();
    std::array<double, 3> xs{}, ys{}, heights{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
        xs[corner] = lattice.x(triangle[corner].x);
        ys[corner] = lattice.y(triangle[corner].y);
        heights[corner] = source.height(xs[corner], ys[corner]);
    }
    double largest = 0.0;
    for (int point = 0; point < points; ++point) {
        double a = random.between(0.0, 1.0), b = random.between(0.0, 1.0);
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        const double c = 1.0 - a - b;
        const double x = a * xs[0] + b * xs[1] + c * xs[2];
        const double y = a * ys[0] + b * ys[1] + c * ys[2];
        const double plane = a * heights[0] + b * heights[1] + c * heights[2];
        largest = std::max(largest, std::abs(source.height(x, y) - plane));
    }
    return largest;
}

/// The diamond of a vertex at spacing s, as height_source.h defines it.
inline std::array<Triangle, 2> diamond(std::int64_t x, std::int64_t y, std::int64_t s) {
    return internal::diamond({x, y}, s);
}

inline std::size_t at(const SampleGrid& grid, int column, int row) {
    return static_cast<std::size_t>(row * grid.columns + column);
}

inline std::vector<float> vertex_bounds(const HeightSource& source, const SampleGrid& grid) {
    std::vector<float> bounds(grid.size(), -1.0f);
    EXPECT_TRUE(source.vertex_bounds(grid, bounds).has_value());
    return bounds;
}

inline std::vector<float> cell_bounds(const HeightSource& source, const SampleGrid& grid) {
    std::vector<float> bounds(static_cast<std::size_t>((grid.columns - 1) * (grid.rows - 1)),
                              -1.0f);
    EXPECT_TRUE(source.cell_bounds(grid, bounds).has_value());
    return bounds;
}

/// One grid of a source, checked as check_source() checks every grid.
class GridChecks {
public:
    GridChecks(const HeightSource& source, const SampleGrid& grid,
               const SourceCheckSettings& settings = {.nesting_slack = 1.0})
        : checks_(source, settings, kEverywhere) {
        EXPECT_TRUE(checks_.ask(grid, answers_));
    }
    ~GridChecks() { EXPECT_TRUE(checks_.report().is_clean()) << to_text(checks_.report()); }
    GridChecks(const GridChecks&) = delete;
    GridChecks& operator=(const GridChecks&) = delete;

    internal::SourceChecks* operator->() { return &checks_; }
    const internal::GridAnswers& answers() const { return answers_; }

private:
    static constexpr double kFar = std::numeric_limits<double>::infinity();
    static constexpr WorldRect kEverywhere{-kFar, -kFar, kFar, kFar};

    internal::SourceChecks checks_;
    internal::GridAnswers answers_;
};

/// The bounds of a grid's vertices and cells are not below the deviations measured in their triangles.
///
/// @param points  per triangle
/// @return the largest ratio of measured deviation to bound
inline double check_bounds(const HeightSource& source, const SampleGrid& grid, int points,
                           Random& random) {
    GridChecks checks(source, grid, {.seed = random.bits(), .points = points});
    checks->check_values(checks.answers());
    checks->check_bounds(checks.answers());
    return checks->report().tightest;
}

/// Within a grid, bounds of centres are at least those of adjacent midpoints, and bounds of midpoints at least those of
/// adjacent cells, exactly.
inline void check_nesting_of_spacing(const HeightSource& source, const SampleGrid& grid) {
    GridChecks checks(source, grid);
    checks->check_nesting_within(checks.answers());
    checks->check_nesting_of_cells(checks.answers());
}

/// Bounds of vertices and cells computed together have the bits of those computed separately.
inline void check_mesh_bounds(const HeightSource& source, const SampleGrid& grid) {
    GridChecks checks(source, grid);
    checks->check_mesh_bounds(checks.answers());
}

/// Bounds of a grid's vertices are at least those of their children, exactly. Requires step > 1.
inline void check_nesting(const HeightSource& source, const SampleGrid& grid) {
    GridChecks checks(source, grid);
    checks->check_nesting_within(checks.answers());
    checks->check_nesting_below(checks.answers());
}

/// Samples, bounds and flags of a grid do not depend on the grid that contains it: larger and finer grids give the same
/// bits.
inline void check_same_bits(const HeightSource& source, const SampleGrid& grid) {
    GridChecks checks(source, grid);
    checks->check_window(checks.answers());
    checks->check_levels(checks.answers());
}

/// A grid whose corner is at a multiple of twice the step, within +-reach steps of the origin.
inline SampleGrid random_grid(std::int64_t step, std::int64_t reach, int columns, int rows,
                              Random& random) {
    const auto corner = [&] {
        return 2 * step *
               static_cast<std::int64_t>(
                   std::floor(random.between(-0.5, 0.5) * static_cast<double>(reach)));
    };
    const std::int64_t x = corner();
    return {{x, corner()}, step, columns, rows};
}

}  // namespace terrane::test

namespace terrane {

/// Name of a parametrised test's fractal.
inline std::string name_of(FractalKind kind) {
    constexpr std::array<const char*, 4> kNames{"fbm", "ridged", "hybrid", "warped"};
    return kNames[static_cast<std::size_t>(kind)];
}

inline void PrintTo(FractalKind kind, std::ostream* out) { *out << name_of(kind); }

namespace test {

inline const auto kAllFractalKinds = testing::Values(FractalKind::fbm, FractalKind::ridged,
                                                     FractalKind::hybrid, FractalKind::warped);

}  // namespace test
}  // namespace terrane
