// SPDX-License-Identifier: MIT
#pragma once

#include "page/ground_bodies.h"

#include <terrane/playback/camera_path.h>
#include <terrane/terrain/pager.h>

#include <span>
#include <vector>

namespace terrane::tools {

/// Known future of a path for a pager: fills CameraNeed::trajectory and BodyNeed::trajectory.
class Foresight {
public:
    struct Settings {
        bool is_complete = false;  ///< oracle: the whole remaining path is known
        double announce = 0.0;     ///< without is_complete: seconds ahead that jumps are known
        double horizon = 0.0;      ///< length of the trajectories, seconds
        double clock = 0.0;        ///< the pager's time at the start of the path, seconds
    };

    /// @param path   must outlive it
    /// @param bodies must outlive it
    Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings);

    /// Sets the trajectories that are known, and leaves the others empty. Valid until the next call.
    ///
    /// @param time seconds from the start of the path
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
