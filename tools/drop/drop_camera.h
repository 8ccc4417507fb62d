// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/view.h>

#include <memory>
#include <span>

namespace terrane::tools {

/// A camera that looks at the mean position of many bodies, circles slowly around it, and stays above the ground.
class DropCamera {
public:
    /// @param bodies at the start, at least one; their spread sets the distance of the camera
    DropCamera(std::shared_ptr<const HeightSource> source, std::span<const BodyState> bodies);

    /// Follows for dt seconds.
    void follow(std::span<const BodyState> bodies, double dt);

    /// `view` with the camera's position and orientation; field of view and size are kept.
    View view(const View& view) const;
    /// Mean velocity of the eye during the last follow(), m/s.
    const Eigen::Vector3d& velocity() const { return velocity_; }

private:
    WorldPos find_eye() const;
    WorldPos clear_of_ground(WorldPos eye, double clearance) const;

    std::shared_ptr<const HeightSource> source_;
    double distance_ = 0.0;  // metres from the target
    double heading_ = 0.0;   // of the eye seen from the target, radians from east
    WorldPos target_world_ = WorldPos::Zero();
    WorldPos eye_world_ = WorldPos::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace terrane::tools
