// SPDX-License-Identifier: MIT
#pragma once

#include "camera/camera_trajectory.h"

#include <terrane/terrain/pager.h>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane::tools {

/// Balls of a metre's radius on the true ground under a camera: the first below the eye, the others
/// around it, within 150 m to each side. They keep their places as seen from the eye, and so jump with
/// it. A pure function of the terrain and the camera.
class GroundBodies {
public:
    static constexpr double kRadius = 1.0;  // metres

    /// @param source outlives it
    GroundBodies(const HeightSource& source, std::size_t count) : source_(&source), count_(count) {}

    std::size_t count() const { return count_; }
    WorldPos place(std::size_t body, const CameraPose& camera) const;
    /// What each of them tells a pager: along with the camera, up and down with the ground.
    std::vector<BodyNeed> needs(const CameraPose& camera) const;
    /// What a body's BodyNeed::way tells of all of a path.
    ///
    /// @param clock the pager's time at the path's beginning, seconds
    std::vector<BodyMoment> trajectory(std::size_t body, std::span<const PathMoment> path,
                                double clock) const;

private:
    const HeightSource* source_;
    std::size_t count_;
};

/// Whether all ground that a ball may touch is there at a level: each chunk under it, as far as there
/// is ground.
bool has_ground(const ResidentSet& resident, int level, const WorldPos& centre_world,
                double radius);

}  // namespace terrane::tools
