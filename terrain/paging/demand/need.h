// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>
#include <terrane/terrain/view.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::internal {

/// Why a chunk is needed, in order of priority: the smallest is loaded first.
enum class NeedClass : std::uint8_t {
    root,         ///< nothing can be drawn or stood on without it
    contact,      ///< a body or a required region touches it, or will
    drawn,        ///< a camera's error will be above its threshold without it
    speculation,  ///< a camera's error would be, if it turned or moved in an unpredicted direction
    none,
};

/// How much a chunk is needed, and when; times in seconds from now.
struct Need {
    NeedClass why = NeedClass::none;
    double begin_s = std::numeric_limits<double>::infinity();  ///< 0: now
    /// When the need ends; infinite if beyond the horizon.
    double end_s = 0.0;
    /// Largest screen error without the chunk over the camera's threshold, from its earliest arrival on.
    double ratio = 0.0;

    bool is_needed() const { return why != NeedClass::none; }
    bool is_needed_now() const { return is_needed() && begin_s <= 0.0; }
};

/// The need of two clients together: the higher class; within a class the earlier begin, the later end,
/// the larger ratio.
inline Need combine(const Need& a, const Need& b) {
    if (a.why != b.why) return a.why < b.why ? a : b;
    return {a.why, a.begin_s < b.begin_s ? a.begin_s : b.begin_s,
            a.end_s > b.end_s ? a.end_s : b.end_s, a.ratio > b.ratio ? a.ratio : b.ratio};
}

/// An absent chunk that is needed.
struct LoadCandidate {
    ChunkKey key;
    Need need;
    /// Time left until its load must begin so that it, and the chunks that need it as their parent, are
    /// in time; seconds, negative where that is too late already.
    double slack_s = 0.0;
    bool can_wait = false;  ///< the load may be postponed to a later update
};

/// Order of loading, total: by class; late (slack_s <= 0) before the others; late ones by larger error,
/// others by smaller slack; then by level and key.
bool has_priority_over(const LoadCandidate& a, const LoadCandidate& b);

/// An axis-aligned box, world, metres.
struct WorldBox {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
};

/// Squared distance from a point to a box; 0 inside.
double square_distance(const WorldBox& box, const Eigen::Vector3d& point);
/// Distance from a point to the farthest corner of a box.
double farthest_from(const WorldBox& box, const Eigen::Vector3d& point);

/// What one camera sees from now to the horizon, known or predicted.
struct PredictedView {
    /// The camera at one time.
    struct CameraState {
        double time_s = 0.0;  ///< from now
        Eigen::Vector3d eye_world = Eigen::Vector3d::Zero();
        Frustum frustum{};
        /// Uncertainty of the view direction, as a sine: what only a frustum widened by it contains is
        /// speculation.
        double direction_margin = 0.0;
        bool is_trusted = true;  ///< false: all of the view is speculation
        bool is_jump = false;    ///< discontinuity: no motion between the state before and this one
    };
    /// At least one; the first is now; times do not decrease.
    std::vector<CameraState> states;
    /// Distance, per metre of bound, at which a bound is seen as the camera's error threshold.
    double distance_per_bound = 1.0;
    double near_distance = 1.0;
    /// Encloses the eyes of all states.
    WorldBox eye_bounds;

    /// Sets eye_bounds. Requires states.
    void update_eye_bounds();

    /// How much the content of a box is needed without which the error there is `bound` metres.
    ///
    /// @param arrival_s   when it could be resident
    /// @param is_resident the caller does not use Need::end_s, which may then be too early
    Need find_need(const WorldBox& box, double bound, double arrival_s, bool is_resident) const;

    /// Error over threshold in the present view, without speculation; 0 where find_need() would find none.
    double visible_ratio(const WorldBox& box, double bound) const;
    /// Error over threshold from the present eye, in any view direction.
    double ratio_in_any_direction(const WorldBox& box, double bound) const;
};

}  // namespace terrane::internal
