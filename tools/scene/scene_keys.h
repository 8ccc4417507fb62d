// SPDX-License-Identifier: MIT
#pragma once

#include "query/parsing/value_parsing.h"

#include <initializer_list>
#include <string>
#include <string_view>

namespace terrane::tools {

/// Fails unless a value is an object all of whose keys are `known`: "unknown key 'bodies[2].colour'".
///
/// @param path of the value: "bodies[2]"
Parsed<void> check_keys(const nlohmann::ordered_json& value, const std::string& path,
                        std::initializer_list<std::string_view> known);

/// Refuses keys of a shape that read_shape() would ignore. What has no known kind is left to it.
///
/// @param path of the shape: "bodies[2].shape"
Parsed<void> check_shape_keys(const nlohmann::ordered_json& shape, const std::string& path);

/// The number at a key, `otherwise` where there is none; fails where it is outside [low, high].
Parsed<double> read_in_range(const nlohmann::ordered_json& object, const char* key,
                             double otherwise, double low, double high);

}  // namespace terrane::tools
