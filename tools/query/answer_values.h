// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/ground_contact.h>
#include <terrane/terrain/ground.h>

#include <nlohmann/json.hpp>

// Values in an answer of `terrane query`.
namespace terrane::tools {

nlohmann::ordered_json as_array(const Eigen::Vector3d& v);

/// `{"vertex":i}`, `{"edge":[i,j]}` or `{"face":i}`, numbered as ShapeFeature says.
nlohmann::ordered_json as_object(const ShapeFeature& feature);

/// As `status` has it.
const char* name_of(GroundStatus status);

/// Writes the status of an unusable answer; false where the answer is usable.
bool write_fault(QueryStatus status, nlohmann::ordered_json& answer);

}  // namespace terrane::tools
