// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_picker.h"
#include "query/loading/query_ground.h"
#include "query/parsing/query_parsing.h"
#include "scene/scene_objects.h"
#include "world/placed_body.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

/// What a pick may meet besides the ground.
struct PickScene {
    std::vector<PlacedBody> bodies = {};                   ///< of a scene, as they start
    std::shared_ptr<const SceneObjects> objects = {};      ///< of a scene; null: none
    std::shared_ptr<const HeightSource> heightfield = {};  ///< that scattered objects stand on
    std::optional<ObjectPicker> picker = {};  ///< of the objects; the first pick makes it
};

/// The nearest of ground, bodies and objects on the ray through a point of a picture. Where several are equally near:
/// ground before bodies before objects, and the least index among bodies, as ObjectPicker::ray() among objects.
void answer_pick(const PickQuestion& question, QueryGround& ground, PickScene& scene,
                 nlohmann::ordered_json& answer);

}  // namespace terrane::tools
