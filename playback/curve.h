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

/// Interpolates the points of a track by cubic Hermite pieces: once continuously differentiable, constant before the
/// first and after the last point. The rate at a point is the slope of the parabola through this point and its two
/// neighbours (Catmull-Rom for uneven times), limited in plan to twice the speed over both adjacent intervals, and in
/// height to 0 to twice the climb over both. Therefore between two points, whatever the intervals, compared with
/// uniform motion along the chord:
///   - the curve's distance from the uniform motion at the same time is at most 0.53 times the length of the chord, and
///     at most kMostDrift seconds times the uniform speed;
///   - the curve's speed is at most 2.5 times the uniform speed;
///   - the curve's height is between the heights of the two points.
/// Where plain pieces would go beyond kMostDrift, as at a corner between long intervals, the curve follows the middle
/// of the chord exactly, and differs from the chord only within kBlendTime of the points.
class TrackCurve {
public:
    static constexpr double kMostDrift = 1.5;  ///< seconds of motion
    static constexpr double kBlendTime = 3.0;  ///< seconds

    TrackCurve() = default;
    /// Requires a track with times.
    explicit TrackCurve(const Track& track);

    CurvePoint at(double time) const;
    double duration() const { return times_.empty() ? 0.0 : times_.back(); }

private:
    void add_knot(double time, const Eigen::Vector3d& value, const Eigen::Vector3d& rate);

    std::vector<double> times_;
    std::vector<Eigen::Vector3d> values_;
    std::vector<Eigen::Vector3d> rates_;
};

/// The means of a polyline over `half_width` before and after each of its points. Beyond its ends the polyline
/// continues as its point reflection about the end, so that both ends keep their places; `half_width` is limited to
/// half of the polyline's range. A point moves by at most half_width / 2 times the polyline's greatest rate, and rates
/// do not grow. Requires two points or more. Cost: O(size).
///
/// @param at parameters of the points, such as times, strictly increasing
std::vector<Eigen::Vector3d> windowed_means(const std::vector<double>& at,
                                            const std::vector<Eigen::Vector3d>& points,
                                            double half_width);

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
