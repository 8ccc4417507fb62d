// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace terrane::tools {

enum class Rounding { nearest, up, down };

/// A number to so many significant digits, without an exponent from 1e-4 to 1e15: "5334", "0.01235".
///
/// @param digits 1 to 17
std::string rounded_text(double value, int digits, Rounding rounding);

/// A value of a summary as people read it, by its key: measured figures to 4 digits; certified bounds rounded up to 4;
/// places, sizes of the terrain's grid and heights to 9; what the command line said, counts and words as they are.
std::string figure_text(const std::string& key, const nlohmann::ordered_json& value);

/// What a key means, in words, with its unit: "Depth, m" for depth_m.
std::string figure_title(const std::string& key);

/// What a reader must know not to be misled by a figure of this summary; "" for most.
std::string figure_note(const std::string& key, const nlohmann::ordered_json& summary);

}  // namespace terrane::tools
