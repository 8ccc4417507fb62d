// SPDX-License-Identifier: MIT
//
// Let a right triangle have hypotenuse l: it lies in the circle of radius r = l / 2 around the middle O of its
// hypotenuse. For p = sum w_i v_i of the corners, w_i >= 0 of sum 1,
//
//   sum w_i |p - v_i|^2 = r^2 - |p - O|^2 <= r^2,   and so   sum w_i |p - v_i| <= r.
//
// The deviation of h from its linear interpolation is h(p) - sum w_i h(v_i). With a Lipschitz bound L each of the
// differences is at most L |p - v_i|, and their mean at most L r. With a curvature M, Taylor's theorem at p gives
// h(v_i) = h(p) + grad h(p) (v_i - p) + R_i, |R_i| <= M |p - v_i|^2 / 2; the gradients cancel, as
// sum w_i (v_i - p) = 0, and the rest is at most M r^2 / 2. Both are attained, at O, by a cone and by a paraboloid.
//
// Sources:
//   S. Waldron. The error in linear interpolation at the vertices of a simplex. SIAM J. Numer. Anal. 35(3), 1998
//   (the second bound; the triangle's circumcentre is in it).
#include "source/function/function_bounds.h"

#include "source/bounds/rounding.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::internal {
namespace {

// Samples along the side of the grid over the extent, and of a patch; patches along its side.
constexpr int kGridSamples = 65;
constexpr int kPatchSamples = 5;
constexpr int kPatches = 8;
// What lies between the samples may be steeper.
constexpr double kEstimateFactor = 2.0;

// Raises the bounds to the largest differences of a square grid of samples.
Result<void> raise_to_differences(const CheckedFunction& function, double x, double y,
                                  double step_x, double step_y, int samples,
                                  FunctionBounds& bounds) {
    std::array<double, std::size_t{kGridSamples} * kGridSamples> heights{};
    const auto at = [samples](int column, int row) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(samples) +
               static_cast<std::size_t>(column);
    };
    for (int row = 0; row < samples; ++row) {
        for (int column = 0; column < samples; ++column) {
            const Result<double> height = function.at(x + step_x * column, y + step_y * row);
            if (!height) return tl::unexpected(height.error());
            heights[at(column, row)] = *height;
        }
    }
    const auto raise = [&](double before, double here, double after, double step) {
        const double first = std::max(std::abs(here - before), std::abs(after - here)) / step;
        const double second = std::abs(before - 2.0 * here + after) / (step * step);
        bounds.slope = std::max(bounds.slope, first);
        bounds.curvature = std::max(bounds.curvature, second);
    };
    for (int row = 1; row + 1 < samples; ++row) {
        for (int column = 1; column + 1 < samples; ++column) {
            const double here = heights[at(column, row)];
            raise(heights[at(column - 1, row)], here, heights[at(column + 1, row)], step_x);
            raise(heights[at(column, row - 1)], here, heights[at(column, row + 1)], step_y);
            raise(heights[at(column - 1, row - 1)], here, heights[at(column + 1, row + 1)],
                  std::sqrt(step_x * step_x + step_y * step_y));
        }
    }
    return {};
}

}  // namespace

double FunctionBounds::deviation(double hypotenuse) const {
    const double radius = 0.5 * hypotenuse + shift;
    return (std::min({slope * radius, 0.5 * curvature * radius * radius, height}) + rounding) *
           kOutward;
}

double FunctionBounds::rise(double distance) const {
    return (std::min(slope * (distance + shift), height) + rounding) * kOutward;
}

Result<FunctionBounds> estimate_bounds(const CheckedFunction& function, const WorldRect& extent,
                                       double finest_spacing) {
    FunctionBounds bounds;
    const double width = extent.east - extent.west, depth = extent.north - extent.south;
    if (auto done =
            raise_to_differences(function, extent.west, extent.south, width / (kGridSamples - 1),
                                 depth / (kGridSamples - 1), kGridSamples, bounds);
        !done) {
        return tl::unexpected(done.error());
    }
    for (int row = 0; row < kPatches; ++row) {
        for (int column = 0; column < kPatches; ++column) {
            if (auto done =
                    raise_to_differences(function, extent.west + width * (column + 0.4) / kPatches,
                                         extent.south + depth * (row + 0.4) / kPatches,
                                         finest_spacing, finest_spacing, kPatchSamples, bounds);
                !done) {
                return tl::unexpected(done.error());
            }
        }
    }
    bounds.slope *= kEstimateFactor;
    bounds.curvature *= kEstimateFactor;
    return bounds;
}

Result<double> slope_at(const CheckedFunction& function, double x, double y, double distance,
                        double curvature) {
    std::array<double, 4> heights{};
    constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    for (std::size_t i = 0; i < kSides.size(); ++i) {
        const Result<double> height =
            function.at(x + distance * kSides[i][0], y + distance * kSides[i][1]);
        if (!height) return tl::unexpected(height.error());
        heights[i] = *height;
    }
    // A central difference over 2 d is the mean of a derivative that is off by at most M t at the distance t.
    const double along_x = (heights[1] - heights[0]) / (2.0 * distance);
    const double along_y = (heights[3] - heights[2]) / (2.0 * distance);
    return std::sqrt(along_x * along_x + along_y * along_y) + 0.5 * kSqrt2 * curvature * distance +
           kHeightAccuracy / distance;
}

}  // namespace terrane::internal
