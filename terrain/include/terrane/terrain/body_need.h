// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

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
    /// Whether the body is parked on ground that is not resident. The pager then loads the chunks under and over it at
    /// once, whatever their heights: contact bounds absent ground by coarser chunks, which may be far above the
    /// interval of the source.
    bool is_waiting = false;
};

}  // namespace terrane
