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

namespace {

// The part of a rate that does not exceed twice the velocity over an adjacent interval, in plan, and is 0 to twice its
// climb, in height.
Eigen::Vector3d limited(Eigen::Vector3d rate, const Eigen::Vector3d& velocity) {
    const double speed = rate.head<2>().norm(), most = 2.0 * velocity.head<2>().norm();
    if (speed > most) rate.head<2>() *= most / speed;
    const double climb = 2.0 * velocity.z();
    rate.z() = std::clamp(rate.z(), std::min(0.0, climb), std::max(0.0, climb));
    return rate;
}

}  // namespace

// Distance from uniform motion. On a piece of h seconds with velocity v and rates a and b at its ends, let t go from 0
// to 1 and s = 1 - t. The difference of the piece and of uniform motion is h s t (s (a - v) - t (b - v)).
//   - With |a|, |b| <= 2 |v| it is at most h |v| s t (2 + |s - t|) <= 0.53 h |v|, and h |v| is the chord's length.
//   - It is at most h / 4 max(|a - v|, |b - v|), which decides whether the piece is split.
//   - A split leaves pieces of up to kBlendTime with the rate v at one end: h s^2 t |a - v| <= 4 / 27 * 3 h |v|, which
//     is at most 1.34 s of motion.
// Speed. The rate is 6 s t v + s (s - 2 t) a + t (t - 2 s) b. With |a|, |b| <= 2 |v| it is largest in the middle of the
// piece: (18 s t - 2) |v| between its thirds, so 2.5 |v|, and less than 2.2 |v| elsewhere.
// Heights. Where each rate is 0 to three times v, the piece is monotone: F. N. Fritsch, R. E. Carlson. Monotone
// piecewise cubic interpolation. SIAM Journal on Numerical Analysis 17(2), 1980.
TrackCurve::TrackCurve(const Track& track) {
    TERRANE_ASSERT(track.has_times && track.points.size() >= 2, "the track must have times");
    const std::vector<TrackPoint>& points = track.points;
    const std::size_t last = points.size() - 1;
    const auto span = [&](std::size_t i) { return points[i + 1].time - points[i].time; };
    const auto velocity = [&](std::size_t i) {
        return Eigen::Vector3d((points[i + 1].position_world - points[i].position_world) / span(i));
    };
    std::vector<Eigen::Vector3d> rates(points.size(), velocity(0));
    for (std::size_t i = 1; i < last; ++i) {
        const double before = span(i - 1), after = span(i);
        const Eigen::Vector3d slope =
            (after * velocity(i - 1) + before * velocity(i)) / (before + after);
        rates[i] = limited(limited(slope, velocity(i - 1)), velocity(i));
    }
    if (last > 1) {
        rates[0] = limited(2.0 * velocity(0) - rates[1], velocity(0));
        rates[last] = limited(2.0 * velocity(last - 1) - rates[last - 1], velocity(last - 1));
    }
    for (std::size_t i = 0; i < last; ++i) {
        const TrackPoint& from = points[i];
        const TrackPoint& to = points[i + 1];
        const Eigen::Vector3d v = velocity(i);
        add_knot(from.time, from.position_world, rates[i]);
        const double turn = std::max((rates[i] - v).norm(), (rates[i + 1] - v).norm());
        if (!(0.25 * span(i) * turn > kMostDrift * v.norm())) continue;
        const double blend = std::min(kBlendTime, 0.5 * span(i));
        add_knot(from.time + blend, from.position_world + blend * v, v);
        if (span(i) > 2.0 * kBlendTime) add_knot(to.time - blend, to.position_world - blend * v, v);
    }
    add_knot(points[last].time, points[last].position_world, rates[last]);
}

void TrackCurve::add_knot(double time, const Eigen::Vector3d& value, const Eigen::Vector3d& rate) {
    times_.push_back(time);
    values_.push_back(value);
    rates_.push_back(rate);
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
    // Relative to the first point, so that equal coordinates of both give the same one between them.
    const Eigen::Vector3d chord = values_[i + 1] - values_[i];
    return {values_[i] + t * t * (1.0 + 2.0 * s) * chord +
                span * (s * s * t * rates_[i] - t * t * s * rates_[i + 1]),
            6.0 * s * t / span * chord + s * (s - 2.0 * t) * rates_[i] +
                t * (t - 2.0 * s) * rates_[i + 1]};
}

// The integral slides from point to point, relative to the point in the middle of its window. Rounding errors are
// therefore proportional to the extent of a window. Neither the length of the polyline nor its distance from the origin
// matters.
std::vector<Eigen::Vector3d> windowed_means(const std::vector<double>& at,
                                            const std::vector<Eigen::Vector3d>& points,
                                            double half_width) {
    const std::size_t last = points.size() - 1;
    TERRANE_ASSERT(last >= 1 && at.size() == points.size(), "a polyline has two points");
    const double half = std::min(half_width, 0.5 * (at[last] - at[0]));
    // The polyline with as much of its reflections as the windows reach.
    std::vector<double> u;
    std::vector<Eigen::Vector3d> p;
    const auto reflect = [&](std::size_t end, std::size_t i) {
        u.push_back(2.0 * at[end] - at[i]);
        p.emplace_back(2.0 * points[end] - points[i]);
    };
    std::size_t count = 1;
    while (count < last && at[count] - at[0] < half) ++count;
    for (std::size_t i = count; i > 0; --i) reflect(0, i);
    u.insert(u.end(), at.begin(), at.end());
    p.insert(p.end(), points.begin(), points.end());
    for (std::size_t i = last; i > 0; --i) {
        reflect(last, i - 1);
        if (!(at[last] - at[i - 1] < half)) break;
    }
    const std::size_t end = u.size() - 1;
    // The mean place between a point and the polyline's place `length` beyond, towards a neighbour.
    const auto mean_towards = [&](std::size_t from, std::size_t to, double length) {
        const double span = std::abs(u[to] - u[from]);
        const double share = span > 0.0 ? std::clamp(length / span, 0.0, 1.0) : 0.0;
        return Eigen::Vector3d(p[from] + 0.5 * share * (p[to] - p[from]));
    };
    std::size_t first = 0, past = 0;  // outermost points in the window
    Eigen::Vector3d integral = Eigen::Vector3d::Zero();
    Eigen::Vector3d middle = p[0];
    const auto piece = [&](std::size_t i) {
        return Eigen::Vector3d((u[i + 1] - u[i]) * (0.5 * (p[i] + p[i + 1]) - middle));
    };
    std::vector<Eigen::Vector3d> result;
    result.reserve(points.size());
    for (std::size_t i = 0; i <= last; ++i) {
        const double low = at[i] - half, high = at[i] + half;
        integral += (u[past] - u[first]) * (middle - points[i]);
        middle = points[i];
        for (; past < end && u[past + 1] <= high; ++past) integral += piece(past);
        for (; first < past && u[first] < low; ++first) integral -= piece(first);
        if (first == past) integral.setZero();
        Eigen::Vector3d sum = integral;
        if (first > 0) {
            const double length = u[first] - low;
            sum += length * (mean_towards(first, first - 1, length) - middle);
        }
        if (past < end) {
            const double length = high - u[past];
            sum += length * (mean_towards(past, past + 1, length) - middle);
        }
        result.emplace_back(middle + sum / (2.0 * half));
    }
    result.front() = points.front();  // without the rounding
    result.back() = points.back();
    return result;
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
