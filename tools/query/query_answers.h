// SPDX-License-Identifier: MIT
#pragma once

#include "query/loading/query_ground.h"
#include "query/parsing/query_parsing.h"
#include "query/pick_answers.h"

#include <nlohmann/json.hpp>

namespace terrane::tools {

/// Answers one line with the id, `status` and the result.
///
/// The answer depends only on the terrain and the contact spacing, not on earlier questions; it is `not_resident` only
/// where the question needs more than the memory ceiling, or the source cannot be read.
///
/// @param scene bodies and objects that picks may meet
nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground, PickScene& scene);
/// The same, with nothing but the ground to pick.
nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground);

/// `{"status":"invalid","message":..}`, as answer_query() gives for a bad line.
nlohmann::ordered_json invalid_answer(const std::string& message);

}  // namespace terrane::tools
