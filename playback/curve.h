// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/playback/track.h>

#include <Eigen/Core>

#include <vector>

namespace terrane::internal {

/// A value and its derivative.
struct CurvePoint {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();  ///< per second
};

/// A uniform cubic B-spline: twice continuously differentiable and inside the convex hull of its control points, which
/// it approximates rather than interpolates. Farther than one step outside its control points it is constant.
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

/// Interpolates the points of a track by cubic Hermite segments. The rate at a point is the slope of the parabola
/// through this point and its two neighbours (Catmull-Rom for non-uniform times); zero where the track stands still.
/// Constant before the first and after the last point.
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

/// Moving average over `half_width` neighbours on both sides, applied three times: close to a Gaussian, with support
/// 3 * half_width. End values are repeated beyond the ends. Cost: O(size).
std::vector<double> smoothed(std::vector<double> values, std::ptrdiff_t half_width);
std::vector<Eigen::Vector3d> smoothed(const std::vector<Eigen::Vector3d>& values,
                                      std::ptrdiff_t half_width);

/// Maximum over `half_width` neighbours on both sides. Cost: O(size).
std::vector<double> running_max(const std::vector<double>& values, std::ptrdiff_t half_width);

/// Equidistant points along a polyline. Requires at least two points, with different positions, and spacing > 0. The
/// last point is up to one spacing before the end of the polyline.
std::vector<Eigen::Vector2d> resampled(const std::vector<Eigen::Vector2d>& line, double spacing);

}  // namespace terrane::internal
