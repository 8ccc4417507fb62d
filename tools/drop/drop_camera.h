// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/bodies.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/view.h>

#include <memory>
#include <span>

namespace terrane::tools {

/// A camera that looks at the middle of many bodies and goes slowly round them, and never under ground.
class DropCamera {
public:
    /// @param bodies at the start, one at least: how far they are spread says how far the camera stays away
    DropCamera(std::shared_ptr<const HeightSource> source, std::span<const BodyState> bodies);

    /// Follows for dt seconds.
    void follow(std::span<const BodyState> bodies, double dt);

    /// The camera's place and look in `view`, whose picture is kept.
    View view(const View& view) const;
    /// Of the eye over the last call of follow(), metres a second.
    const Eigen::Vector3d& velocity() const { return velocity_; }

private:
    WorldPos find_eye() const;
    WorldPos clear_of_ground(WorldPos eye, double clearance) const;

    std::shared_ptr<const HeightSource> source_;
    double distance_ = 0.0;  // metres from the middle
    double heading_ = 0.0;   // radians, from the middle to the eye
    WorldPos target_world_ = WorldPos::Zero();
    WorldPos eye_world_ = WorldPos::Zero();
    Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace terrane::tools
