// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

#include <span>

namespace terrane {

/// Where a body will be.
struct BodyMoment {
    double time_s = 0.0;
    WorldPos centre_world = WorldPos::Zero();
};

/// A body that touches ground, or may soon.
struct BodyNeed {
    WorldPos centre_world = WorldPos::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    double radius = 1.0;  ///< bounding, metres
    /// Where it will be, where that is known: as CameraNeed::trajectory.
    std::span<const BodyMoment> trajectory = {};
};

}  // namespace terrane
