// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

namespace terrane {

/// A motion with constant velocity and constant spin over t in [0, 1].
struct Motion {
    Pose start;  ///< world_from_shape at t = 0
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();      ///< metres, world axes
    Eigen::Vector3d rotation_vector = Eigen::Vector3d::Zero();  ///< radians, world axes

    /// Pose at t. Own sine and cosine, so that the bits do not depend on the C library.
    Pose at(double t) const;
};

/// The shorter turn that takes one rotation to another, as a rotation vector in world axes.
Eigen::Vector3d rotation_vector_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

/// A rotation matrix made orthonormal again, after many small products.
Eigen::Matrix3d orthonormalized(const Eigen::Matrix3d& rotation);

/// Settings of a cast.
struct CastSettings {
    /// A hit is reported where the distance is between 0 and this, metres, > 0; never later than the
    /// first touch. A pass within it may be reported as a hit.
    double tolerance = 1e-4;
    /// Contacts at the start that move apart are passed over until they close again.
    bool skip_separating = false;
};

}  // namespace terrane
