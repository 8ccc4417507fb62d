// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/query_parsing.h"

#include <terrane/collision/ground_cast.h>

// Answers to questions with a shape as `other`: they do not use the ground.
namespace terrane::tools {

void answer_pair(const ShapeQuestion& question, const OtherShape& other,
                 nlohmann::ordered_json& answer);
void answer_pair_cast(const CastQuestion& question, const OtherShape& other,
                      nlohmann::ordered_json& answer);
void answer_shape_ray(const RayQuestion& question, const OtherShape& other,
                      nlohmann::ordered_json& answer);

/// The motion from a pose to another one, rotating by the smaller angle.
Motion motion_to(const Pose& start, const WorldPos& to_world, const Eigen::Matrix3d& to_rotation);

}  // namespace terrane::tools
