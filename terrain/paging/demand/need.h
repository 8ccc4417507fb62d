// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>
#include <terrane/terrain/view.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace terrane::internal {

/// Reason for a need, highest priority first.
enum class NeedClass : std::uint8_t {
    root,         ///< required for any drawing or contact
    contact,      ///< a body or a required region touches the chunk, or will
    drawn,        ///< without the chunk, a camera's error exceeds its threshold, or will
    speculation,  ///< the same if the camera turns or moves in an unpredicted direction
    none,
};

/// Priority and time of a chunk's need; times in seconds from now.
struct Need {
    NeedClass why = NeedClass::none;
    double begin_s = std::numeric_limits<double>::infinity();  ///< start; 0: now
    /// End of the need; infinite if beyond the horizon.
    double end_s = 0.0;
    /// (Largest screen error without the chunk) / (the camera's threshold), from the chunk's earliest arrival on.
    double ratio = 0.0;

    bool is_needed() const { return why != NeedClass::none; }
    bool is_needed_now() const { return is_needed() && begin_s <= 0.0; }
};

/// Combines the needs of two clients: the higher class; within a class the earlier start, the later end and the larger
/// ratio.
inline Need combine(const Need& a, const Need& b) {
    if (a.why != b.why) return a.why < b.why ? a : b;
    return {a.why, a.begin_s < b.begin_s ? a.begin_s : b.begin_s,
            a.end_s > b.end_s ? a.end_s : b.end_s, a.ratio > b.ratio ? a.ratio : b.ratio};
}

/// A needed absent chunk.
struct LoadCandidate {
    ChunkKey key;
    Need need;
    /// Seconds until the load must start, so that this chunk and its urgent descendants arrive in time; negative if it
    /// is already too late.
    double slack_s = 0.0;
    /// Whether a camera or a required region needs the chunk or its descendants; otherwise bodies do.
    bool is_to_be_drawn = true;
    bool can_wait = false;  ///< the load may be postponed to a later update
};

/// Total order of loading: by class; late chunks (slack_s <= 0) before others; late chunks by larger error, others by
/// smaller slack; then by level and key.
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

/// The view of one camera from now to the horizon, known or predicted.
struct PredictedView {
    /// The camera at one time.
    struct CameraState {
        double time_s = 0.0;  ///< from now
        Eigen::Vector3d eye_world = Eigen::Vector3d::Zero();
        Frustum frustum{};
        /// Sine of the angle by which the predicted view direction may be wrong. Content outside the frustum but within
        /// this angle of it is loaded as speculation. 0: none; 1: in any direction.
        double direction_margin = 0.0;
        bool is_trusted = true;  ///< false: the whole view is speculation
        bool is_jump = false;  ///< discontinuity: no motion between the previous state and this one
    };
    /// At least one state; the first is the present; times do not decrease.
    std::vector<CameraState> states;
    /// Distance, per metre of an error bound, at which the bound projects to the camera's threshold.
    double distance_per_bound = 1.0;
    double near_distance = 1.0;
    /// Bounding box of the eyes of all states.
    WorldBox eye_bounds;

    /// Computes eye_bounds. Requires at least one state.
    void update_eye_bounds();

    /// The need for a chunk whose absence causes an error of up to `bound` metres in a box.
    ///
    /// @param arrival_s   earliest time at which the chunk can be resident, seconds from now
    /// @param is_resident true: the caller does not use end_s, which may then be too early
    Need find_need(const WorldBox& box, double bound, double arrival_s, bool is_resident) const;

    /// Error / threshold in the current view, without speculation; 0 if find_need() would find no need now.
    double visible_ratio(const WorldBox& box, double bound) const;
    /// Error / threshold from the current eye, if the box were in view.
    double ratio_in_any_direction(const WorldBox& box, double bound) const;
};

}  // namespace terrane::internal
