// SPDX-License-Identifier: MIT
#pragma once

#include "page/ground_bodies.h"
#include "camera/camera_path.h"

#include <terrane/terrain/pager.h>

#include <span>
#include <vector>

namespace terrane::tools {

/// What a pager is told of the future, beside velocities: CameraNeed::way and BodyNeed::way.
class Foresight {
public:
    struct Settings {
        bool is_complete = false;  ///< all of the path that is left: an oracle
        double announce = 0.0;     ///< otherwise: jumps, so many seconds ahead
        double horizon = 0.0;      ///< seconds of the way that are told
        double clock = 0.0;        ///< the pager's time at the path's beginning, seconds
    };

    /// @param path, bodies outlive it
    Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings);

    /// Sets the ways, or leaves them empty; what they point to lives until the next call.
    ///
    /// @param time seconds of the path
    void set_trajectories(double time, CameraNeed& camera, std::span<BodyNeed> bodies);

private:
    void announce_jump(double time, double jump, CameraNeed& camera, std::span<BodyNeed> bodies);

    const CameraPath* path_;
    const GroundBodies* bodies_;
    Settings settings_;
    std::vector<CameraMoment> camera_trajectory_;
    std::vector<std::vector<BodyMoment>> body_trajectories_;
};

}  // namespace terrane::tools
