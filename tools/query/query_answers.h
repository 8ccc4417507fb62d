// SPDX-License-Identifier: MIT
#pragma once

#include "query/query_ground.h"
#include "query/parsing/query_parsing.h"

#include <nlohmann/json.hpp>

namespace terrane::tools {

/// Answers one line: the id, `status`, and what was asked for.
///
/// The answer depends on the terrain and the contact spacing alone, not on what was asked before; only
/// a memory ceiling that the question does not fit under makes it `not_resident`.
nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground);

/// `{"status":"invalid","message":..}`, as answer_query() gives for a bad line.
nlohmann::ordered_json invalid_answer(const std::string& message);

}  // namespace terrane::tools
