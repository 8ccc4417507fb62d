// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/playback/camera_trajectory.h>
#include <terrane/terrain/pager.h>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane::tools {

/// Spheres of radius 1 m on the true ground under a camera: the first below the eye, the others around it, within 150 m
/// to each side. Their horizontal offsets from the eye are constant, so that they jump with it. A pure function of the
/// terrain and the camera.
class GroundBodies {
public:
    static constexpr double kRadius = 1.0;  // metres

    /// @param source must outlive it
    GroundBodies(const HeightSource& source, std::size_t count) : source_(&source), count_(count) {}

    std::size_t count() const { return count_; }
    WorldPos place(std::size_t body, const CameraPose& camera) const;
    /// The needs of all bodies: horizontal velocity of the camera, vertical velocity from the ground below.
    std::vector<BodyNeed> needs(const CameraPose& camera) const;
    /// BodyNeed::trajectory of a body over a whole path.
    ///
    /// @param clock the pager's time at the start of the path, seconds
    std::vector<BodyMoment> trajectory(std::size_t body, std::span<const PathMoment> path,
                                       double clock) const;

private:
    const HeightSource* source_;
    std::size_t count_;
};

/// Whether all chunks of a level under a sphere are resident; the part beyond the world does not count.
bool has_ground(const ResidentSet& resident, int level, const WorldPos& centre_world,
                double radius);

}  // namespace terrane::tools
