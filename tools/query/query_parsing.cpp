// SPDX-License-Identifier: MIT
#include "query/query_parsing.h"

#include "output/summary.h"
#include "query/quaternion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;
template <class T>
using Parsed = tl::expected<T, std::string>;

constexpr int kMaxNesting = 64;
constexpr double kMaxCoordinate = 1e9;
constexpr double kUnitTolerance = 1e-6;

tl::unexpected<std::string> wrong(std::string message) {
    return tl::unexpected<std::string>(std::move(message));
}

/// A value in a message, cut where it is long.
std::string shown(const Json& value) {
    std::string text = to_line(value);
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    return text;
}

/// How deep a line's brackets go: what is deeper would take the stack of whoever walks it.
int nesting_of(std::string_view line) {
    int depth = 0;
    int deepest = 0;
    bool in_text = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (in_text) {
            if (c == '\\') ++i;
            if (c == '"') in_text = false;
        } else if (c == '"') {
            in_text = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return deepest;
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
        return wrong(fmt::format("{} must be within 1e9 m of the origin, got {}", key, *value));
    }
    return value;
}

/// [count] numbers.
template <std::size_t count>
Parsed<std::array<double, count>> read_array(const Json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end()) return wrong(fmt::format("{} is missing", key));
    const bool has_numbers =
        found->is_array() && found->size() == count &&
        std::all_of(found->begin(), found->end(), [](const Json& v) { return v.is_number(); });
    if (!has_numbers) {
        return wrong(fmt::format("{} must be {} numbers, got {}", key, count, shown(*found)));
    }
    std::array<double, count> values{};
    for (std::size_t i = 0; i < count; ++i) values[i] = (*found)[i].template get<double>();
    return values;
}

Parsed<WorldPos> read_point(const Json& object, const char* key) {
    const Parsed<std::array<double, 3>> values = read_array<3>(object, key);
    if (!values) return wrong(values.error());
    const WorldPos point_world((*values)[0], (*values)[1], (*values)[2]);
    if (!(point_world.cwiseAbs().maxCoeff() <= kMaxCoordinate)) {
        return wrong(fmt::format("{} must be within 1e9 m of the origin, got {}", key,
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
        return wrong(fmt::format("{} must be [w, x, y, z] of length 1 to 1e-6, got length {}", key,
                                 std::sqrt(square)));
    }
    return matrix_from_quaternion(*q);
}

Parsed<Shape> read_shape(const Json& object) {
    const auto found = object.find("shape");
    if (found == object.end()) return wrong("shape is missing");
    if (!found->is_object() || found->size() != 1) {
        return wrong(fmt::format("shape must be an object with one key, got {}", shown(*found)));
    }
    const std::string kind = found->begin().key();
    const Json& sizes = found->begin().value();
    if (kind == "hull" || kind == "compound") {
        return wrong(fmt::format("shape {} is not supported yet", kind));
    }
    if (kind != "sphere" && kind != "capsule" && kind != "box") {
        return wrong(fmt::format("shape must be sphere, capsule or box, got {}", shown(kind)));
    }
    if (!sizes.is_object()) {
        return wrong(fmt::format("{} must be an object, got {}", kind, shown(sizes)));
    }
    Shape shape;
    if (kind == "box") {
        const Parsed<std::array<double, 3>> halves = read_array<3>(sizes, "half_extents");
        if (!halves) return wrong(halves.error());
        shape = Box{.half_extents = {(*halves)[0], (*halves)[1], (*halves)[2]}};
    } else {
        const Parsed<double> radius = read_number(sizes, "radius");
        if (!radius) return wrong(radius.error());
        shape = Sphere{.radius = *radius};
        if (kind == "capsule") {
            const Parsed<double> half_height = read_number(sizes, "half_height");
            if (!half_height) return wrong(half_height.error());
            shape = Capsule{.radius = *radius, .half_height = *half_height};
        }
    }
    if (const Result<void> good = check(shape); !good) return wrong(good.error().message);
    return shape;
}

Parsed<Pose> read_pose(const Json& object) {
    const Parsed<WorldPos> position = read_point(object, "position");
    if (!position) return wrong(position.error());
    const Parsed<Eigen::Matrix3d> rotation =
        read_rotation(object, "rotation", Eigen::Matrix3d::Identity());
    if (!rotation) return wrong(rotation.error());
    return Pose{.rotation = *rotation, .translation = *position};
}

Parsed<Question> read_height(const Json& object) {
    const Parsed<double> x = read_coordinate(object, "x");
    if (!x) return wrong(x.error());
    const Parsed<double> y = read_coordinate(object, "y");
    if (!y) return wrong(y.error());
    return HeightQuestion{.x = *x, .y = *y};
}

Parsed<Question> read_ray(const Json& object) {
    const Parsed<WorldPos> from = read_point(object, "from");
    if (!from) return wrong(from.error());
    const Parsed<WorldPos> to = read_point(object, "to");
    if (!to) return wrong(to.error());
    return RayQuestion{.from_world = *from, .to_world = *to};
}

Parsed<Question> read_shape_question(const Json& object, ShapeOp op) {
    const Parsed<Shape> shape = read_shape(object);
    if (!shape) return wrong(shape.error());
    const Parsed<Pose> pose = read_pose(object);
    if (!pose) return wrong(pose.error());
    return ShapeQuestion{.op = op, .shape = *shape, .world_from_shape = *pose};
}

Parsed<Question> read_cast(const Json& object) {
    const Parsed<Shape> shape = read_shape(object);
    if (!shape) return wrong(shape.error());
    const Parsed<Pose> start = read_pose(object);
    if (!start) return wrong(start.error());
    const Parsed<WorldPos> to = read_point(object, "to");
    if (!to) return wrong(to.error());
    const Parsed<Eigen::Matrix3d> to_rotation =
        read_rotation(object, "to_rotation", start->rotation);
    if (!to_rotation) return wrong(to_rotation.error());
    CastQuestion cast{
        .shape = *shape, .start = *start, .to_world = *to, .to_rotation = *to_rotation};
    if (const auto skip = object.find("skip_separating"); skip != object.end()) {
        if (!skip->is_boolean()) {
            return wrong(
                fmt::format("skip_separating must be true or false, got {}", shown(*skip)));
        }
        cast.skip_separating = skip->get<bool>();
    }
    return cast;
}

Parsed<Question> read_question(const Json& object) {
    const auto op = object.find("op");
    if (op == object.end()) return wrong("op is missing");
    if (object.contains("other")) return wrong("shape against shape (other) is not supported yet");
    if (*op == "height") return read_height(object);
    if (*op == "ray") return read_ray(object);
    if (*op == "cast") return read_cast(object);
    if (*op == "test") return read_shape_question(object, ShapeOp::test);
    if (*op == "find") return read_shape_question(object, ShapeOp::find);
    if (*op == "distance") return read_shape_question(object, ShapeOp::distance);
    if (*op == "pseudodistance") return read_shape_question(object, ShapeOp::pseudodistance);
    return wrong(
        fmt::format("op must be height, ray, test, find, distance, pseudodistance or cast, got {}",
                    shown(*op)));
}

}  // namespace

QueryLine parse_query(std::string_view line) {
    QueryLine parsed{.id = {}, .has_id = false, .question = wrong("")};
    if (nesting_of(line) > kMaxNesting) {
        parsed.question = wrong(fmt::format("brackets go deeper than {}", kMaxNesting));
        return parsed;
    }
    const Json object = Json::parse(line, nullptr, false);
    if (!object.is_object()) {
        parsed.question =
            wrong(object.is_discarded() ? "the line is not JSON that can be read"
                                        : "the line must be a JSON object, got " + shown(object));
        return parsed;
    }
    if (const auto id = object.find("id"); id != object.end()) {
        parsed.id = *id;
        parsed.has_id = true;
    }
    parsed.question = read_question(object);
    return parsed;
}

}  // namespace terrane::tools
