// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/scatter.h>

namespace terrane::tools {

/// The pose of a scattered object, without its scale.
inline Pose pose_of(const ScatterPoint& point) {
    const double c = point.half_turn_cosine, s = point.half_turn_sine;
    Pose pose;
    pose.rotation << c * c - s * s, -2.0 * c * s, 0.0, 2.0 * c * s, c * c - s * s, 0.0, 0.0, 0.0,
        1.0;
    pose.translation = point.position_world;
    return pose;
}

}  // namespace terrane::tools
