// SPDX-License-Identifier: MIT
#include "page/foresight.h"

#include <algorithm>
#include <array>

namespace terrane::tools {

Foresight::Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings)
    : path_(&path), bodies_(&bodies), settings_(settings), body_trajectories_(bodies.count()) {
    if (!settings_.is_complete) return;
    const std::vector<PathMoment> moments = path_moments(path);
    camera_trajectory_ = camera_trajectory(moments, settings_.clock);
    for (std::size_t body = 0; body < bodies.count(); ++body) {
        body_trajectories_[body] = bodies.trajectory(body, moments, settings_.clock);
    }
}

void Foresight::set_trajectories(double time, CameraNeed& camera, std::span<BodyNeed> bodies) {
    if (settings_.is_complete) {
        const double now = settings_.clock + time;
        camera.trajectory = trajectory_ahead(std::span<const CameraMoment>(camera_trajectory_), now,
                                             settings_.horizon);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            bodies[i].trajectory = trajectory_ahead(
                std::span<const BodyMoment>(body_trajectories_[i]), now, settings_.horizon);
        }
        return;
    }
    const auto jump = std::upper_bound(path_->jumps().begin(), path_->jumps().end(), time);
    if (jump != path_->jumps().end() && *jump <= time + settings_.announce) {
        announce_jump(time, *jump, camera, bodies);
    }
}

// The trajectory of an announced jump: straight at the current velocity up to the jump, straight from its target after.
void Foresight::announce_jump(double time, double jump, CameraNeed& camera,
                              std::span<BodyNeed> bodies) {
    const CameraPose now = path_->at(time);
    CameraPose leaving = now, arriving = path_->at(jump), last = arriving;
    const double rest = std::max(0.0, time + settings_.horizon - jump);
    leaving.eye_world += (jump - time) * now.velocity;
    last.eye_world += rest * arriving.velocity;
    const std::array<PathMoment, 4> moments{
        PathMoment{time, false, now}, PathMoment{jump, true, leaving},
        PathMoment{jump, false, arriving}, PathMoment{jump + rest, false, last}};
    camera_trajectory_ = camera_trajectory(moments, settings_.clock);
    camera.trajectory = camera_trajectory_;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        body_trajectories_[i] = bodies_->trajectory(i, moments, settings_.clock);
        bodies[i].trajectory = body_trajectories_[i];
    }
}

}  // namespace terrane::tools
