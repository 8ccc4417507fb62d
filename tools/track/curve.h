// SPDX-License-Identifier: MIT
#pragma once

#include "track/track.h"

#include <Eigen/Core>

#include <vector>

namespace terrane::tools {

/// A value and how fast it changes.
struct CurvePoint {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< a second
};

/// A uniform cubic B-spline: twice continuously differentiable, inside the hull of its control
/// points, near them rather than through them. Before the first and behind the last control point it
/// stands still.
class SmoothCurve {
public:
    SmoothCurve() = default;
    /// Requires at least one control point and step > 0.
    ///
    /// @param start_time time of the first control point, seconds
    /// @param step       between control points, seconds
    SmoothCurve(double start_time, double step, std::vector<Eigen::Vector3d> control);

    CurvePoint at(double time) const;
    bool is_empty() const { return control_.empty(); }

private:
    double start_time_ = 0.0;
    double step_ = 1.0;
    std::vector<Eigen::Vector3d> control_;
};

/// Goes through the points of a track: cubic Hermite pieces whose rates at the points are those of
/// the parabola through a point and its neighbours (Catmull-Rom for uneven times), and zero where the
/// track stands. Stands still before the first and behind the last point.
class TrackCurve {
public:
    TrackCurve() = default;
    /// Requires a track with times.
    explicit TrackCurve(const Track& track);

    CurvePoint at(double time) const;
    double duration() const { return times_.empty() ? 0.0 : times_.back(); }

private:
    std::vector<double> times_;
    std::vector<Eigen::Vector3d> values_;
    std::vector<Eigen::Vector3d> rates_;
};

/// Mean over `half_width` neighbours on both sides, three times over: close to a Gaussian, and with
/// no reach beyond 3 * half_width. Ends are continued by their last value. Cost: O(size).
std::vector<double> smoothed(std::vector<double> values, std::ptrdiff_t half_width);
std::vector<Eigen::Vector3d> smoothed(const std::vector<Eigen::Vector3d>& values,
                                      std::ptrdiff_t half_width);

/// Largest value among `half_width` neighbours on both sides. Cost: O(size).
std::vector<double> running_max(const std::vector<double>& values, std::ptrdiff_t half_width);

/// Points at equal distances along a line of points. Requires two points or more that are apart, and
/// spacing > 0; the last point is the line's own, or up to a spacing before it.
std::vector<Eigen::Vector2d> resampled(const std::vector<Eigen::Vector2d>& line, double spacing);

}  // namespace terrane::tools
