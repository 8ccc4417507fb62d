// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/shapes.h>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

// Parsing of JSON values. Errors are messages that name the key and show the value.
namespace terrane::tools {

template <class T>
using Parsed = tl::expected<T, std::string>;

tl::unexpected<std::string> wrong(std::string message);

/// Parses a JSON text in UTF-8. A message gives line and column of the error.
Parsed<nlohmann::ordered_json> parse_json(std::string_view text);

/// The text of a value for a message, shortened if it is long.
std::string shown(const nlohmann::ordered_json& value);

Parsed<double> read_number(const nlohmann::ordered_json& object, const char* key);

/// Read one coordinate or a point, metres. Fail if a coordinate is more than 2e9 m from 0.
Parsed<double> read_coordinate(const nlohmann::ordered_json& object, const char* key);
Parsed<WorldPos> read_point(const nlohmann::ordered_json& object, const char* key);

/// Reads a quaternion [w, x, y, z] of length 1 within 1e-6. Returns `otherwise` if the key is absent.
Parsed<Eigen::Matrix3d> read_rotation(const nlohmann::ordered_json& object, const char* key,
                                      const Eigen::Matrix3d& otherwise);

enum class PositionAbsent { is_wrong, is_origin };

/// Reads `position` and `rotation`. If `rotation` is absent, the pose has the identity rotation.
Parsed<Pose> read_pose(const nlohmann::ordered_json& object, PositionAbsent absent);

/// The numbers of an array of `count` numbers; absent for any other value.
template <std::size_t count>
std::optional<std::array<double, count>> numbers_of(const nlohmann::ordered_json& value) {
    const bool has_numbers =
        value.is_array() && value.size() == count &&
        std::all_of(value.begin(), value.end(), [](const auto& v) { return v.is_number(); });
    if (!has_numbers) return {};
    std::array<double, count> numbers{};
    for (std::size_t i = 0; i < count; ++i) numbers[i] = value[i].template get<double>();
    return numbers;
}

/// Reads an array of `count` numbers.
template <std::size_t count>
Parsed<std::array<double, count>> read_array(const nlohmann::ordered_json& object,
                                             const char* key) {
    const auto found = object.find(key);
    if (found == object.end()) return wrong(std::string(key) + " is missing");
    const std::optional<std::array<double, count>> numbers = numbers_of<count>(*found);
    if (numbers) return *numbers;
    return wrong(std::string(key) + " must be " + std::to_string(count) + " numbers, got " +
                 shown(*found));
}

/// Parses the shape at `key` of an object: `{"sphere":{"radius":r}}`, `{"capsule":{"radius":r,"half_height":h}}`,
/// `{"box":{"half_extents":[..]}}`, `{"hull":{"points":[[..]..]}}` or
/// `{"compound":[{"shape":S,"position":..,"rotation":..}..]}`. Parts of a compound cannot be compounds; a
/// part without a position is at the origin.
Parsed<Shape> read_shape(const nlohmann::ordered_json& object, const char* key);

/// Fails unless a value is an object with only `known` keys: "unknown key 'bodies[2].colour'".
///
/// @param path of the value in the file, for messages: "bodies[2]"
Parsed<void> check_keys(const nlohmann::ordered_json& value, const std::string& path,
                        std::initializer_list<std::string_view> known);

/// Refuses keys of a shape that read_shape() would ignore. Unknown kinds are left to read_shape().
///
/// @param path of the shape in the file, for messages: "bodies[2].shape"
Parsed<void> check_shape_keys(const nlohmann::ordered_json& shape, const std::string& path);

/// The number at a key, or `otherwise` if the key is absent. Fails if the number is outside [low, high].
Parsed<double> read_in_range(const nlohmann::ordered_json& object, const char* key,
                             double otherwise, double low, double high);

}  // namespace terrane::tools
