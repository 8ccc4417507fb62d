// SPDX-License-Identifier: MIT
#include "paging/demand/predicted_view.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Sine of the angle by which a view is widened for what counts as seen: loads are decided between
// frames, and chunks are boxes.
constexpr double kSeenMargin = 0.05;

// What is looked for beyond a view counts less, the further beside it.
constexpr double kBesideLoss = 0.7;
// A need is judged by the error soon after it begins.
constexpr double kSoon_s = 0.5;

// Sine of how far a box lies beside a view, 0 where the view holds some of it, 1 where it is further
// than a right angle off.
double beside(const Outlook::Moment& moment, const Box& box) {
    const Eigen::Vector3d centre = 0.5 * (box.low + box.high) - moment.eye_world;
    const Eigen::Vector3d half = 0.5 * (box.high - box.low);
    double outside = 0.0;
    for (const Eigen::Vector3d& normal : moment.frustum.normals) {
        const double reach = std::abs(normal.x()) * half.x() + std::abs(normal.y()) * half.y() +
                             std::abs(normal.z()) * half.z();
        outside = std::max(outside, -(normal.dot(centre) + reach));
    }
    return outside > 0.0 ? std::min(1.0, outside / centre.norm()) : 0.0;
}

// How near the eye comes to a box on its way from one moment to the next.
double square_distance_between(const Box& box, const Eigen::Vector3d& from,
                               const Eigen::Vector3d& to) {
    const Eigen::Vector3d way = to - from;
    const double length = way.squaredNorm();
    if (!(length > 0.0)) return square_distance(box, from);
    // towards the box's nearest point, twice: exact enough for boxes in the plane
    Eigen::Vector3d aim = 0.5 * (box.low + box.high);
    Eigen::Vector3d place = from;
    for (int round = 0; round < 2; ++round) {
        place = from + std::clamp((aim - from).dot(way) / length, 0.0, 1.0) * way;
        aim = place.cwiseMax(box.low).cwiseMin(box.high);
    }
    return (aim - place).squaredNorm();
}

}  // namespace

double square_distance(const Box& box, const Eigen::Vector3d& point) {
    return (box.low - point).cwiseMax(point - box.high).cwiseMax(0.0).squaredNorm();
}

double farthest_from(const Box& box, const Eigen::Vector3d& point) {
    return (box.low - point).cwiseAbs().cwiseMax((box.high - point).cwiseAbs()).norm();
}

void Outlook::find_eyes() {
    eyes = {moments.front().eye_world, moments.front().eye_world};
    for (const Moment& moment : moments) {
        eyes.low = eyes.low.cwiseMin(moment.eye_world);
        eyes.high = eyes.high.cwiseMax(moment.eye_world);
    }
}

Need Outlook::look(const Box& box, double bound, double arrival_s, bool is_there) const {
    const double distance = distance_per_bound * bound;
    Need need;
    if (!(distance > near_distance)) return need;
    const double square = distance * distance;
    const Eigen::Vector3d apart =
        (box.low - eyes.high).cwiseMax(eyes.low - box.high).cwiseMax(Eigen::Vector3d::Zero());
    if (apart.squaredNorm() > square) return need;

    const double last_s = moments.back().time_s;
    double from_before = 0.0;  // of the moment before
    double beside_before = 1.0;
    bool is_trusted_before = true;
    for (std::size_t i = 0; i < moments.size(); ++i) {
        const Moment& moment = moments[i];
        const double from =
            std::max(near_distance, std::sqrt(square_distance(box, moment.eye_world)));
        const bool has_before = i > 0 && !moment.is_jump;
        double nearest = from;
        if (has_before && from >= distance && from_before >= distance) {
            // it may be passed between the two
            nearest =
                std::max(near_distance, std::sqrt(square_distance_between(
                                            box, moments[i - 1].eye_world, moment.eye_world)));
        }
        const double before = has_before ? from_before : from;
        double off = 1.0;
        double off_before = has_before ? beside_before : 1.0;
        const bool was_trusted = is_trusted_before;
        const bool is_near = nearest < distance;
        // looked at only where it matters
        if (is_near || (i + 1 < moments.size() && from < 2.0 * distance)) {
            off = beside(moment, box);
        }
        from_before = from;
        beside_before = off;
        is_trusted_before = moment.is_trusted;
        if (!is_near) continue;
        const double least_off = from < distance ? off : std::min(off, off_before);
        const bool is_seen = least_off <= kSeenMargin;
        const double doubt = kSeenMargin + moment.doubt;
        const double end_s = i + 1 == moments.size() ? std::numeric_limits<double>::infinity()
                                                     : moments[i + 1].time_s;
        // what is out of view for a while is not passed
        if (need.is_needed()) need.end_s = std::max(need.end_s, end_s);
        if (!is_seen && (doubt < 1.0 ? least_off > doubt : moment.doubt <= 0.0)) continue;
        // what lies beside counts for less, and for nothing where that is less than is asked for
        const double ratio = distance / nearest * (is_seen ? 1.0 : 1.0 - kBesideLoss * least_off);
        if (!(ratio > 1.0)) continue;
        const bool is_trusted = moment.is_trusted && (was_trusted || i == 0);
        Need here{is_seen && is_trusted ? NeedClass::drawn : NeedClass::speculation, moment.time_s,
                  moment.time_s, 0.0};
        if (has_before) {
            // somewhere between the two moments it came near, or into view
            const Moment& last = moments[i - 1];
            const double share = before > distance && before > nearest
                                     ? (before - distance) / (before - nearest)
                                     : 0.0;
            here.begin_s = last.time_s + share * (moment.time_s - last.time_s);
        }
        here.end_s = end_s;
        const double soon_s =
            std::max(arrival_s, need.is_needed() ? need.begin_s : here.begin_s) + kSoon_s;
        const bool counts = here.end_s >= std::min(arrival_s, last_s) && here.begin_s <= soon_s;
        if (counts) here.ratio = ratio;
        need = both(need, here);
        if (is_there && need.why == NeedClass::drawn && here.begin_s > soon_s) break;
    }
    return need;
}

double Outlook::ratio_now(const Box& box, double bound) const {
    const double distance = distance_per_bound * bound;
    const double from =
        std::max(near_distance, std::sqrt(square_distance(box, moments.front().eye_world)));
    if (from >= distance || beside(moments.front(), box) > kSeenMargin) return 0.0;
    return distance / from;
}

double Outlook::ratio_around(const Box& box, double bound) const {
    const double from =
        std::max(near_distance, std::sqrt(square_distance(box, moments.front().eye_world)));
    return distance_per_bound * bound / from;
}

}  // namespace terrane::internal
