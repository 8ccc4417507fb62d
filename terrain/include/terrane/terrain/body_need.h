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

/// A body that touches ground or may touch it soon; the pager keeps this ground resident.
struct BodyNeed {
    WorldPos centre_world = WorldPos::Zero();            ///< of the bounding sphere
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, world axes
    double radius = 1.0;                                 ///< of the bounding sphere, metres
    /// The body's future trajectory, if known; the rules of CameraNeed::trajectory apply.
    std::span<const BodyMoment> trajectory = {};
    /// Whether the body is parked because ground is not resident. The pager then loads the chunks under and over it at
    /// once, whatever their heights. Contact bounds absent ground by coarser chunks, and these bounds may be far above
    /// HeightSource::interval().
    bool is_waiting = false;
};

}  // namespace terrane
