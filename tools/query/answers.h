// SPDX-License-Identifier: MIT
#pragma once

#include "query/object_picker.h"
#include "query/query_ground.h"
#include "query/questions.h"
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/terrain/ground.h>

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <vector>

// Formatting of values in answers of `terrane query`.
namespace terrane::tools {

nlohmann::ordered_json as_array(const Eigen::Vector3d& v);

/// `{"vertex":i}`, `{"edge":[i,j]}` or `{"face":i}`, numbered as in ShapeFeature.
nlohmann::ordered_json as_object(const ShapeFeature& feature);

/// The text of `status` in answers.
const char* name_of(QueryStatus status);

/// Writes the status of an unusable answer. Returns false if the answer is usable.
bool write_fault(QueryStatus status, nlohmann::ordered_json& answer);

// Answers to questions with a shape as `other`, which do not use the ground.

void answer_pair(const ShapeQuestion& question, const OtherShape& other,
                 nlohmann::ordered_json& answer);
void answer_pair_cast(const CastQuestion& question, const OtherShape& other,
                      nlohmann::ordered_json& answer);
void answer_shape_ray(const RayQuestion& question, const OtherShape& other,
                      nlohmann::ordered_json& answer);

/// The motion between two poses that rotates by at most half a turn.
Motion motion_to(const Pose& start, const WorldPos& to_world, const Eigen::Matrix3d& to_rotation);

/// What a pick or a ray can hit besides the ground.
struct PickScene {
    std::vector<PlacedBody> bodies = {};               ///< of a scene, in their initial state
    std::shared_ptr<const SceneObjects> objects = {};  ///< of a scene; null: none
    /// Ground of scattered objects, with its volumes: no objects stand where a volume replaces it.
    std::shared_ptr<const HeightSource> source = {};
    std::optional<ObjectPicker> picker = {};  ///< created by the first pick or ray

    bool is_empty() const { return bodies.empty() && objects == nullptr; }
};

/// Answers with the nearest hit of ground, bodies and objects on the ray through a point of a picture. At equal
/// distances the ground comes first, then bodies by index, then objects in the order of ObjectPicker::ray().
void answer_pick(const PickQuestion& question, QueryGround& ground, PickScene& scene,
                 nlohmann::ordered_json& answer);

/// Answers one line with the id, `status` and the result.
///
/// The answer depends only on the question, the terrain and the contact spacing, not on earlier questions. It is
/// `not_resident` only if the ground for the question exceeds the memory ceiling, or the source cannot be read.
///
/// @param scene bodies and objects for picks and rays
nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground, PickScene& scene);
/// The same, with only the ground.
nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground);

/// `{"status":"invalid","message":..}`, as answer_query() returns for an invalid line.
nlohmann::ordered_json invalid_answer(const std::string& message);

}  // namespace terrane::tools
