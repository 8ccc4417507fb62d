// SPDX-License-Identifier: MIT
#include "query/parsing/value_parsing.h"

#include "output/summary.h"
#include "query/parsing/quaternion.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxCoordinate = 2e9;
constexpr double kUnitTolerance = 1e-6;

}  // namespace

tl::unexpected<std::string> wrong(std::string message) {
    return tl::unexpected<std::string>(std::move(message));
}

std::string shown(const Json& value) {
    std::string text = to_line(value);
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
}

Parsed<double> read_number(const Json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end()) return wrong(fmt::format("{} is missing", key));
    if (!found->is_number()) {
        return wrong(fmt::format("{} must be a number, got {}", key, shown(*found)));
    }
    return found->get<double>();
}

Parsed<double> read_coordinate(const Json& object, const char* key) {
    const Parsed<double> value = read_number(object, key);
    if (value && !(std::abs(*value) <= kMaxCoordinate)) {
        return wrong(fmt::format("{} must be within 2e9 m of the origin, got {:.6g}", key, *value));
    }
    return value;
}

Parsed<WorldPos> read_point(const Json& object, const char* key) {
    const Parsed<std::array<double, 3>> values = read_array<3>(object, key);
    if (!values) return wrong(values.error());
    const WorldPos point_world((*values)[0], (*values)[1], (*values)[2]);
    if (!(point_world.cwiseAbs().maxCoeff() <= kMaxCoordinate)) {
        return wrong(fmt::format("{} must be within 2e9 m of the origin, got {}", key,
                                 shown(*object.find(key))));
    }
    return point_world;
}

Parsed<Eigen::Matrix3d> read_rotation(const Json& object, const char* key,
                                      const Eigen::Matrix3d& otherwise) {
    if (!object.contains(key)) return otherwise;
    const Parsed<std::array<double, 4>> q = read_array<4>(object, key);
    if (!q) return wrong(q.error());
    double square = 0.0;
    for (const double component : *q) square += component * component;
    if (!(std::abs(std::sqrt(square) - 1.0) <= kUnitTolerance)) {
        return wrong(fmt::format("{} must be [w, x, y, z] of length 1 to 1e-6, got length {:.6g}",
                                 key, std::sqrt(square)));
    }
    return matrix_from_quaternion(*q);
}

Parsed<Pose> read_pose(const Json& object, PositionAbsent absent) {
    Pose pose;
    if (absent == PositionAbsent::is_wrong || object.contains("position")) {
        const Parsed<WorldPos> position = read_point(object, "position");
        if (!position) return wrong(position.error());
        pose.translation = *position;
    }
    const Parsed<Eigen::Matrix3d> rotation =
        read_rotation(object, "rotation", Eigen::Matrix3d::Identity());
    if (!rotation) return wrong(rotation.error());
    pose.rotation = *rotation;
    return pose;
}

}  // namespace terrane::tools
