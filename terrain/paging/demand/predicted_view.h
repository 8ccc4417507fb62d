// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/need.h"

#include <terrane/terrain/view.h>

#include <vector>

namespace terrane::internal {

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
