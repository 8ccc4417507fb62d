// SPDX-License-Identifier: MIT
#include "paging/demand/need.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {

bool has_priority_over(const LoadCandidate& a, const LoadCandidate& b) {
    if (a.need.why != b.need.why) return a.need.why < b.need.why;
    const bool is_late_a = a.slack_s <= 0.0;
    const bool is_late_b = b.slack_s <= 0.0;
    if (is_late_a != is_late_b) return is_late_a;
    if (is_late_a && a.need.ratio != b.need.ratio) return a.need.ratio > b.need.ratio;
    if (a.slack_s != b.slack_s) return a.slack_s < b.slack_s;
    if (a.key.level != b.key.level) return a.key.level < b.key.level;
    return a.key < b.key;
}

namespace {

// Sine of the angle by which the frustum is widened for visibility, because needs are computed less often than frames
// are drawn, and chunks are approximated by boxes.
constexpr double kSeenMargin = 0.05;

// Reduction of the ratio outside the frustum, per sine of the angle to the frustum.
constexpr double kOutsideLoss = 0.7;
// The ratio of a need is its maximum over this time from its start, seconds.
constexpr double kSoon_s = 0.5;

// Sine of the angle between a box and the frustum: 0 if they overlap, 1 from a right angle on.
double sine_outside(const PredictedView::CameraState& state, const WorldBox& box) {
    const Eigen::Vector3d centre = 0.5 * (box.low + box.high) - state.eye_world;
    const Eigen::Vector3d half = 0.5 * (box.high - box.low);
    double outside = 0.0;
    for (const Eigen::Vector3d& normal : state.frustum.normals) {
        const double reach = std::abs(normal.x()) * half.x() + std::abs(normal.y()) * half.y() +
                             std::abs(normal.z()) * half.z();
        outside = std::max(outside, -(normal.dot(centre) + reach));
    }
    return outside > 0.0 ? std::min(1.0, outside / centre.norm()) : 0.0;
}

// Approximate minimum squared distance to a box as the eye moves between two states.
double square_distance_between(const WorldBox& box, const Eigen::Vector3d& from,
                               const Eigen::Vector3d& to) {
    const Eigen::Vector3d motion = to - from;
    const double length = motion.squaredNorm();
    if (!(length > 0.0)) return square_distance(box, from);
    // alternating projection between segment and box, twice: accurate enough for flat boxes
    Eigen::Vector3d target = 0.5 * (box.low + box.high);
    Eigen::Vector3d place = from;
    for (int round = 0; round < 2; ++round) {
        place = from + std::clamp((target - from).dot(motion) / length, 0.0, 1.0) * motion;
        target = place.cwiseMax(box.low).cwiseMin(box.high);
    }
    return (target - place).squaredNorm();
}

}  // namespace

double square_distance(const WorldBox& box, const Eigen::Vector3d& point) {
    return (box.low - point).cwiseMax(point - box.high).cwiseMax(0.0).squaredNorm();
}

double farthest_from(const WorldBox& box, const Eigen::Vector3d& point) {
    return (box.low - point).cwiseAbs().cwiseMax((box.high - point).cwiseAbs()).norm();
}

void PredictedView::update_eye_bounds() {
    eye_bounds = {states.front().eye_world, states.front().eye_world};
    for (const CameraState& state : states) {
        eye_bounds.low = eye_bounds.low.cwiseMin(state.eye_world);
        eye_bounds.high = eye_bounds.high.cwiseMax(state.eye_world);
    }
}

Need PredictedView::find_need(const WorldBox& box, double bound, double arrival_s,
                              bool is_resident) const {
    const double distance = distance_per_bound * bound;
    Need need;
    if (!(distance > near_distance)) return need;
    const double square = distance * distance;
    const Eigen::Vector3d apart = (box.low - eye_bounds.high)
                                      .cwiseMax(eye_bounds.low - box.high)
                                      .cwiseMax(Eigen::Vector3d::Zero());
    if (apart.squaredNorm() > square) return need;

    const double last_s = states.back().time_s;
    double from_before = 0.0;  // distance at the previous state
    double sine_before = 1.0;
    bool is_trusted_before = true;
    for (std::size_t i = 0; i < states.size(); ++i) {
        const CameraState& state = states[i];
        const double from =
            std::max(near_distance, std::sqrt(square_distance(box, state.eye_world)));
        const bool has_before = i > 0 && !state.is_jump;
        double nearest = from;
        if (has_before && from >= distance && from_before >= distance) {
            // the minimum may lie between the two states
            nearest = std::max(near_distance, std::sqrt(square_distance_between(
                                                  box, states[i - 1].eye_world, state.eye_world)));
        }
        const double before = has_before ? from_before : from;
        double off = 1.0;
        double off_before = has_before ? sine_before : 1.0;
        const bool was_trusted = is_trusted_before;
        const bool is_near = nearest < distance;
        // computed only if used
        if (is_near || (i + 1 < states.size() && from < 2.0 * distance)) {
            off = sine_outside(state, box);
        }
        from_before = from;
        sine_before = off;
        is_trusted_before = state.is_trusted;
        if (!is_near) continue;
        const double least_off = from < distance ? off : std::min(off, off_before);
        const bool is_seen = least_off <= kSeenMargin;
        const double direction_margin = kSeenMargin + state.direction_margin;
        const double end_s =
            i + 1 == states.size() ? std::numeric_limits<double>::infinity() : states[i + 1].time_s;
        // a need does not end while the box is temporarily out of view
        if (need.is_needed()) need.end_s = std::max(need.end_s, end_s);
        if (!is_seen &&
            (direction_margin < 1.0 ? least_off > direction_margin : state.direction_margin <= 0.0))
            continue;
        // outside the frustum the ratio is reduced; there is no need if it is 1 or less
        const double ratio = distance / nearest * (is_seen ? 1.0 : 1.0 - kOutsideLoss * least_off);
        if (!(ratio > 1.0)) continue;
        const bool is_trusted = state.is_trusted && (was_trusted || i == 0);
        Need here{is_seen && is_trusted ? NeedClass::drawn : NeedClass::speculation, state.time_s,
                  state.time_s, 0.0};
        if (has_before) {
            // the need starts between the two states, interpolated by distance, or at the first of them
            const CameraState& last = states[i - 1];
            const double share = before > distance && before > nearest
                                     ? (before - distance) / (before - nearest)
                                     : 0.0;
            here.begin_s = last.time_s + share * (state.time_s - last.time_s);
        }
        here.end_s = end_s;
        const double soon_s =
            std::max(arrival_s, need.is_needed() ? need.begin_s : here.begin_s) + kSoon_s;
        const bool counts = here.end_s >= std::min(arrival_s, last_s) && here.begin_s <= soon_s;
        if (counts) here.ratio = ratio;
        need = combine(need, here);
        if (is_resident && need.why == NeedClass::drawn && here.begin_s > soon_s) break;
    }
    return need;
}

double PredictedView::visible_ratio(const WorldBox& box, double bound) const {
    const double distance = distance_per_bound * bound;
    const double from =
        std::max(near_distance, std::sqrt(square_distance(box, states.front().eye_world)));
    if (from >= distance || sine_outside(states.front(), box) > kSeenMargin) return 0.0;
    return distance / from;
}

double PredictedView::ratio_in_any_direction(const WorldBox& box, double bound) const {
    const double from =
        std::max(near_distance, std::sqrt(square_distance(box, states.front().eye_world)));
    return distance_per_bound * bound / from;
}

}  // namespace terrane::internal
