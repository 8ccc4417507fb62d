// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/view.h>

namespace terrane::tools {

/// A camera that follows a vehicle from behind and above, calmer than the vehicle, and never under
/// ground.
class ChaseCamera {
public:
    /// @param source must outlive the camera
    /// @param pose_world of the vehicle: x forward, z up
    ChaseCamera(const HeightSource& source, const Pose& pose_world);

    /// Follows for dt seconds.
    void follow(const Pose& pose_world, double dt);

    /// The camera's place and look in `view`, whose picture is kept.
    View view(const View& view) const;
    /// Of the eye over the last call of follow(), metres a second.
    const Eigen::Vector3d& velocity() const { return velocity_; }

private:
    WorldPos wanted_eye(const Pose& pose_world) const;

    const HeightSource& source_;
    Eigen::Vector3d heading_ = Eigen::Vector3d::UnitX();  // horizontal, about unit
    WorldPos eye_world_ = WorldPos::Zero();
    WorldPos target_world_ = WorldPos::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace terrane::tools
