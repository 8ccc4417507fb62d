// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// A motion with constant velocity and constant spin over t in [0, 1], about the origin of the body.
struct Motion {
    Pose start;                                                 ///< at t = 0, world from body
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();      ///< metres, world axes
    Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();  ///< axis times radians, world axes

    /// Pose at t. With its own sine and cosine, so that results do not depend on the C library.
    Pose at(double t) const;
};

/// The shorter rotation from one orientation to another, as a rotation vector in world axes, radians.
Eigen::Vector3d rotation_vector_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

/// The rotation matrix near one that rounding of many products has made not quite orthonormal.
Eigen::Matrix3d orthonormalized(const Eigen::Matrix3d& rotation);

/// Settings of cast().
struct CastSettings {
    /// A hit is reported at a distance between 0 and this, metres, > 0; never later than the first touch. A motion that
    /// passes within this distance without touching may be reported as a hit. A cast against the ground is `invalid`
    /// where doubles along its motion are more than a quarter of this apart: beyond 1.1e11 m for the default.
    double tolerance = 1e-4;
    /// Contacts at the start that separate are ignored until they close again.
    bool skip_separating = false;
};

}  // namespace terrane
