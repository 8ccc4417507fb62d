// SPDX-License-Identifier: MIT
#include "page/foresight.h"

#include <algorithm>
#include <array>

namespace terrane::tools {

Foresight::Foresight(const CameraPath& path, const GroundBodies& bodies, const Settings& settings)
    : path_(&path), bodies_(&bodies), settings_(settings), body_ways_(bodies.count()) {
    if (!settings_.is_complete) return;
    const std::vector<PathMoment> moments = path_moments(path);
    camera_way_ = camera_way(moments, settings_.clock);
    for (std::size_t body = 0; body < bodies.count(); ++body) {
        body_ways_[body] = bodies.way(body, moments, settings_.clock);
    }
}

void Foresight::tell(double time, CameraNeed& camera, std::span<BodyNeed> bodies) {
    if (settings_.is_complete) {
        const double now = settings_.clock + time;
        camera.way = way_ahead(std::span<const CameraMoment>(camera_way_), now, settings_.horizon);
        for (std::size_t i = 0; i < bodies.size(); ++i) {
            bodies[i].way =
                way_ahead(std::span<const BodyMoment>(body_ways_[i]), now, settings_.horizon);
        }
        return;
    }
    const auto jump = std::upper_bound(path_->jumps().begin(), path_->jumps().end(), time);
    if (jump != path_->jumps().end() && *jump <= time + settings_.announce) {
        tell_jump(time, *jump, camera, bodies);
    }
}

// Who announces a jump knows where it leads, and goes straight on until then and from there.
void Foresight::tell_jump(double time, double jump, CameraNeed& camera,
                          std::span<BodyNeed> bodies) {
    const CameraPose now = path_->at(time);
    CameraPose leaving = now, arriving = path_->at(jump), last = arriving;
    const double rest = std::max(0.0, time + settings_.horizon - jump);
    leaving.eye_world += (jump - time) * now.velocity;
    last.eye_world += rest * arriving.velocity;
    const std::array<PathMoment, 4> moments{
        PathMoment{time, false, now}, PathMoment{jump, true, leaving},
        PathMoment{jump, false, arriving}, PathMoment{jump + rest, false, last}};
    camera_way_ = camera_way(moments, settings_.clock);
    camera.way = camera_way_;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        body_ways_[i] = bodies_->way(i, moments, settings_.clock);
        bodies[i].way = body_ways_[i];
    }
}

}  // namespace terrane::tools
