// SPDX-License-Identifier: MIT
#include "query/parsing/query_parsing.h"

#include "query/parsing/pick_parsing.h"
#include "query/parsing/shape_parsing.h"
#include "query/parsing/value_parsing.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kMaxNesting = 64;

/// Nesting depth of the brackets of a line: limited, because the parser recurses.
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

Parsed<Question> read_height(const Json& object) {
    const Parsed<double> x = read_coordinate(object, "x");
    if (!x) return wrong(x.error());
    const Parsed<double> y = read_coordinate(object, "y");
    if (!y) return wrong(y.error());
    return HeightQuestion{.x = *x, .y = *y};
}

Parsed<Question> read_height_below(const Json& object) {
    Parsed<Question> question = read_height(object);
    if (!question) return question;
    const Parsed<double> z = read_coordinate(object, "z");
    if (!z) return wrong(z.error());
    std::get<HeightQuestion>(*question).below = *z;
    return question;
}

// A shape with start and end pose; without `to` the end is the start.
Parsed<OtherShape> read_moving(const Json& object) {
    const Parsed<Shape> shape = read_shape(object, "shape");
    if (!shape) return wrong(shape.error());
    const Parsed<Pose> start = read_pose(object, PositionAbsent::is_wrong);
    if (!start) return wrong(start.error());
    OtherShape moving{
        .shape = *shape, .start = *start, .to_world = start->translation, .to_rotation = {}};
    if (object.contains("to")) {
        const Parsed<WorldPos> to = read_point(object, "to");
        if (!to) return wrong(to.error());
        moving.to_world = *to;
    }
    const Parsed<Eigen::Matrix3d> to_rotation =
        read_rotation(object, "to_rotation", start->rotation);
    if (!to_rotation) return wrong(to_rotation.error());
    moving.to_rotation = *to_rotation;
    return moving;
}

// The shape of `other`, if present.
Parsed<std::optional<OtherShape>> read_other(const Json& object) {
    const auto found = object.find("other");
    if (found == object.end()) return std::optional<OtherShape>();
    if (!found->is_object()) {
        return wrong(fmt::format("other must be an object, got {}", shown(*found)));
    }
    Parsed<OtherShape> other = read_moving(*found);
    if (!other) return wrong("other: " + other.error());
    return std::optional<OtherShape>(*std::move(other));
}

Parsed<Question> read_ray(const Json& object) {
    const Parsed<WorldPos> from = read_point(object, "from");
    if (!from) return wrong(from.error());
    const Parsed<WorldPos> to = read_point(object, "to");
    if (!to) return wrong(to.error());
    const Parsed<std::optional<OtherShape>> other = read_other(object);
    if (!other) return wrong(other.error());
    return RayQuestion{.from_world = *from, .to_world = *to, .other = *other};
}

Parsed<Question> read_shape_question(const Json& object, ShapeOp op) {
    const Parsed<Shape> shape = read_shape(object, "shape");
    if (!shape) return wrong(shape.error());
    const Parsed<Pose> pose = read_pose(object, PositionAbsent::is_wrong);
    if (!pose) return wrong(pose.error());
    const Parsed<std::optional<OtherShape>> other = read_other(object);
    if (!other) return wrong(other.error());
    return ShapeQuestion{.op = op, .shape = *shape, .world_from_shape = *pose, .other = *other};
}

Parsed<Question> read_cast(const Json& object) {
    const Parsed<OtherShape> moving = read_moving(object);
    if (!moving) return wrong(moving.error());
    const Parsed<std::optional<OtherShape>> other = read_other(object);
    if (!other) return wrong(other.error());
    // at least one shape must have a `to`
    if (!object.contains("to") && !(*other && object["other"].contains("to"))) {
        return wrong("to is missing");
    }
    CastQuestion cast{.shape = moving->shape,
                      .start = moving->start,
                      .to_world = moving->to_world,
                      .to_rotation = moving->to_rotation,
                      .other = *other};
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
    if (*op == "height" || *op == "height_below") {
        if (object.contains("other")) {
            return wrong(op->get<std::string>() + " is asked of the ground, not of other");
        }
        return *op == "height" ? read_height(object) : read_height_below(object);
    }
    if (*op == "ray") return read_ray(object);
    if (*op == "cast") return read_cast(object);
    if (*op == "test") return read_shape_question(object, ShapeOp::test);
    if (*op == "find") return read_shape_question(object, ShapeOp::find);
    if (*op == "distance") return read_shape_question(object, ShapeOp::distance);
    if (*op == "pseudodistance") return read_shape_question(object, ShapeOp::pseudodistance);
    if (*op == "pick") {
        const Parsed<PickQuestion> pick = read_pick(object);
        if (!pick) return wrong(pick.error());
        return *pick;
    }
    return wrong(
        fmt::format("op must be height, height_below, ray, test, find, distance, pseudodistance, "
                    "cast or pick, got {}",
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
