// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>

#include <span>

namespace terrane {

/// A future position of a body.
struct BodyMoment {
    double time_s = 0.0;                       ///< on the clock of Pager::update()
    WorldPos centre_world = WorldPos::Zero();  ///< of the bounding sphere
};

/// A body that touches ground, or may soon; the pager keeps that ground resident.
struct BodyNeed {
    WorldPos centre_world = WorldPos::Zero();            ///< of the bounding sphere
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, world axes
    double radius = 1.0;                                 ///< bounding, metres
    /// Its future trajectory, if known; rules as of CameraNeed::trajectory.
    std::span<const BodyMoment> trajectory = {};
    /// It waits for ground that is absent: it needs all in its column at once, whatever the height. Contact knows
    /// absent ground by the bounds of its coarser chunks, which may lie above what the source says.
    bool is_waiting = false;
};

}  // namespace terrane
