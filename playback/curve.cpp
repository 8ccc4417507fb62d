// SPDX-License-Identifier: MIT
//
// Sources: C. de Boor. A Practical Guide to Splines. 1978 (uniform B-splines, parabolic end slopes).
//          P. J. Barry, R. N. Goldman. A recursive evaluation algorithm for a class of Catmull-Rom splines.
//          SIGGRAPH 1988 (uneven knots).
#include "curve.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <utility>

namespace terrane::internal {

SmoothCurve::SmoothCurve(double start_time, double step, std::vector<Eigen::Vector3d> control)
    : start_time_(start_time), step_(step), control_(std::move(control)) {
    TERRANE_ASSERT(!control_.empty() && step_ > 0.0, "a curve needs control points and a step");
}

CurvePoint SmoothCurve::at(double time) const {
    const double last = static_cast<double>(control_.size() - 1);
    // The spline extends one step beyond its outer control points, which are repeated there.
    const double u = std::clamp((time - start_time_) / step_, -1.0, last + 1.0);
    const double cell = std::min(std::floor(u), last);
    const double t = u - cell;
    const double s = 1.0 - t;
    const std::array<double, 4> weight{s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                                       (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                                       t * t * t / 6.0};
    const std::array<double, 4> slope{-0.5 * s * s, 0.5 * t * (3.0 * t - 4.0),
                                      -0.5 * s * (3.0 * s - 4.0), 0.5 * t * t};
    CurvePoint point;
    for (std::size_t i = 0; i < 4; ++i) {
        const double index = std::clamp(cell - 1.0 + static_cast<double>(i), 0.0, last);
        const Eigen::Vector3d& control = control_[static_cast<std::size_t>(index)];
        point.value += weight[i] * control;
        point.rate += slope[i] / step_ * control;
    }
    return point;
}

TrackCurve::TrackCurve(const Track& track) {
    TERRANE_ASSERT(track.has_times && track.points.size() >= 2, "the track must have times");
    const std::size_t count = track.points.size();
    times_.reserve(count);
    values_.reserve(count);
    for (const TrackPoint& point : track.points) {
        times_.push_back(point.time);
        values_.push_back(point.position_world);
    }
    rates_.resize(count);
    const auto slope = [&](std::size_t i) {
        return Eigen::Vector3d((values_[i + 1] - values_[i]) / (times_[i + 1] - times_[i]));
    };
    for (std::size_t i = 1; i + 1 < count; ++i) {
        const double before = times_[i] - times_[i - 1];
        const double after = times_[i + 1] - times_[i];
        // Zero rate at points next to a standstill, to avoid overshoot.
        const bool stands = values_[i] == values_[i - 1] || values_[i] == values_[i + 1];
        rates_[i] =
            stands ? Eigen::Vector3d::Zero()
                   : Eigen::Vector3d((after * slope(i - 1) + before * slope(i)) / (before + after));
    }
    if (count == 2) {
        rates_[0] = rates_[1] = slope(0);
    } else {
        rates_[0] = 2.0 * slope(0) - rates_[1];
        rates_[count - 1] = 2.0 * slope(count - 2) - rates_[count - 2];
    }
}

CurvePoint TrackCurve::at(double time) const {
    if (time < times_.front()) return {values_.front(), Eigen::Vector3d::Zero()};
    if (time > times_.back()) return {values_.back(), Eigen::Vector3d::Zero()};
    const auto after = std::upper_bound(times_.begin(), times_.end(), time);
    const std::size_t i =
        std::min(static_cast<std::size_t>(after - times_.begin()), times_.size() - 1) - 1;
    const double span = times_[i + 1] - times_[i];
    const double t = (time - times_[i]) / span;
    const double s = 1.0 - t;
    return {s * s * (1.0 + 2.0 * t) * values_[i] + t * t * (1.0 + 2.0 * s) * values_[i + 1] +
                span * (s * s * t * rates_[i] - t * t * s * rates_[i + 1]),
            6.0 * s * t / span * (values_[i + 1] - values_[i]) + s * (s - 2.0 * t) * rates_[i] +
                t * (t - 2.0 * s) * rates_[i + 1]};
}

std::vector<double> smoothed(std::vector<double> values, std::ptrdiff_t half_width) {
    const auto count = static_cast<std::ptrdiff_t>(values.size());
    if (count == 0 || half_width <= 0) return values;
    const auto width = static_cast<double>(2 * half_width + 1);
    for (int pass = 0; pass < 3; ++pass) {
        const auto clamped = [&](std::ptrdiff_t i) {
            return values[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, count - 1))];
        };
        std::vector<double> mean(values.size());
        double sum = 0.0;
        for (std::ptrdiff_t i = -half_width; i <= half_width; ++i) sum += clamped(i);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            mean[static_cast<std::size_t>(i)] = sum / width;
            sum += clamped(i + half_width + 1) - clamped(i - half_width);
        }
        values = std::move(mean);
    }
    return values;
}

std::vector<Eigen::Vector3d> smoothed(const std::vector<Eigen::Vector3d>& values,
                                      std::ptrdiff_t half_width) {
    std::vector<Eigen::Vector3d> result(values.size());
    std::vector<double> axis_values(values.size());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < values.size(); ++i) axis_values[i] = values[i][axis];
        const std::vector<double> mean = smoothed(axis_values, half_width);
        for (std::size_t i = 0; i < values.size(); ++i) result[i][axis] = mean[i];
    }
    return result;
}

std::vector<double> running_max(const std::vector<double>& values, std::ptrdiff_t half_width) {
    const auto count = static_cast<std::ptrdiff_t>(values.size());
    std::vector<double> result(values.size());
    std::deque<std::ptrdiff_t> candidates;  // indices of decreasing values: a monotonic queue
    std::ptrdiff_t taken = 0;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        for (; taken < count && taken <= i + half_width; ++taken) {
            const double value = values[static_cast<std::size_t>(taken)];
            while (!candidates.empty() &&
                   values[static_cast<std::size_t>(candidates.back())] <= value) {
                candidates.pop_back();
            }
            candidates.push_back(taken);
        }
        while (candidates.front() < i - half_width) candidates.pop_front();
        result[static_cast<std::size_t>(i)] = values[static_cast<std::size_t>(candidates.front())];
    }
    return result;
}

std::vector<Eigen::Vector2d> resampled(const std::vector<Eigen::Vector2d>& line, double spacing) {
    TERRANE_ASSERT(line.size() >= 2 && spacing > 0.0, "a line has two points and a spacing");
    std::vector<Eigen::Vector2d> result{line.front()};
    double to_next = spacing;
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const Eigen::Vector2d segment = line[i + 1] - line[i];
        const double length = segment.norm();
        double along = 0.0;
        while (length - along >= to_next) {
            along += to_next;
            result.push_back(line[i] + segment * (along / length));
            to_next = spacing;
        }
        to_next -= length - along;
    }
    return result;
}

}  // namespace terrane::internal
