// SPDX-License-Identifier: MIT
#pragma once

#include "source/function/checked_function.h"

namespace terrane::internal {

/// What is known, or estimated, of a function's heights; numbers that are not known are infinite.
struct FunctionBounds {
    double slope = 0.0;      ///< Lipschitz bound over the world and its surroundings
    double curvature = 0.0;  ///< 1/m
    double height = 0.0;     ///< range.high - range.low, metres
    double rounding = 0.0;   ///< of a computed deviation, metres
    double shift = 0.0;      ///< of rounded coordinates, metres

    /// Bound of the deviation of the function from its interpolation over right triangles, metres.
    double deviation(double hypotenuse) const;
    /// Bound of the difference of two heights, metres.
    double rise(double distance) const;
};

/// Estimates slope and curvature: twice the largest first and second differences of samples over the extent, and of
/// patches of the finest spacing.
///
/// Fails: io where the function does
Result<FunctionBounds> estimate_bounds(const CheckedFunction& function, const WorldRect& extent,
                                       double finest_spacing);

/// A bound of the slope at a place, from differences over `distance` and the curvature: 1e-9 m of rounding included.
///
/// Fails: io where the function does
Result<double> slope_at(const CheckedFunction& function, double x, double y, double distance,
                        double curvature);

}  // namespace terrane::internal
