// SPDX-License-Identifier: MIT
#pragma once

#include "paging/demand/need.h"

#include <terrane/terrain/view.h>

#include <vector>

namespace terrane::internal {

/// A box in the world, metres.
struct Box {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
};

double square_distance(const Box& box, const Eigen::Vector3d& point);
double farthest_from(const Box& box, const Eigen::Vector3d& point);

/// What one camera sees from now to the horizon, as far as it is known or foreseen.
struct Outlook {
    struct Moment {
        double time_s = 0.0;  ///< from now
        Eigen::Vector3d eye_world = Eigen::Vector3d::Zero();
        Frustum frustum{};
        /// Sine of the angle by which the camera may look elsewhere: what a view wider by it holds is
        /// speculation.
        double doubt = 0.0;
        bool is_trusted = true;  ///< false: all of it is speculation
        bool is_jump = false;    ///< nothing lies between it and the moment before
    };
    /// At least one, the first is now; times do not fall.
    std::vector<Moment> moments;
    /// A bound of one metre is seen as the error that is asked for from this far.
    double distance_per_bound = 1.0;
    double near_distance = 1.0;
    /// All eyes.
    Box eyes;

    /// Requires moments.
    void find_eyes();

    /// How much a box is needed whose absence means an error of `bound` metres.
    ///
    /// @param arrival_s when it could be there
    /// @param is_there  nobody asks when its need ends: that may be too early
    Need look(const Box& box, double bound, double arrival_s, bool is_there) const;

    /// What look() says of now alone, without speculation: the ratio, or 0 where it is not needed.
    double ratio_now(const Box& box, double bound) const;
    /// Error over what is asked for, whichever way the camera looks now.
    double ratio_around(const Box& box, double bound) const;
};

}  // namespace terrane::internal
