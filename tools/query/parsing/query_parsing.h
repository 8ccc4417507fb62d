// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>
#include <terrane/terrain/view.h>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace terrane::tools {

/// The highest surface; with `below` the highest one at or below that height, where volumes fold the ground.
struct HeightQuestion {
    double x = 0.0, y = 0.0;
    std::optional<double> below = {};
};

/// The shape of `other`, which replaces the ground. At rest its end pose is its start.
struct OtherShape {
    Shape shape;
    Pose start;
    WorldPos to_world = WorldPos::Zero();
    Eigen::Matrix3d to_rotation = Eigen::Matrix3d::Identity();
};

struct RayQuestion {
    WorldPos from_world = WorldPos::Zero();
    WorldPos to_world = WorldPos::Zero();
    std::optional<OtherShape> other;
};

enum class ShapeOp { test, find, distance, pseudodistance };

struct ShapeQuestion {
    ShapeOp op = ShapeOp::test;
    Shape shape;
    Pose world_from_shape;
    std::optional<OtherShape> other;
};

struct CastQuestion {
    Shape shape;
    Pose start;
    WorldPos to_world = WorldPos::Zero();
    Eigen::Matrix3d to_rotation = Eigen::Matrix3d::Identity();
    bool skip_separating = false;
    std::optional<OtherShape> other;
};

/// What a camera shows at a point of its picture.
struct PickQuestion {
    View view;
    double x_px = 0.0, y_px = 0.0;  ///< from the left and the top edge; pixel i spans i to i + 1
    double far_distance = 0.0;      ///< metres from the eye; nothing is met beyond
};

using Question =
    std::variant<HeightQuestion, RayQuestion, ShapeQuestion, CastQuestion, PickQuestion>;

/// One line of input.
struct QueryLine {
    nlohmann::ordered_json id;  ///< echoed in the answer; discarded where the line has none
    bool has_id = false;
    /// The question, or an error message.
    tl::expected<Question, std::string> question;
};

/// Parses `{"id":..,"op":..,..}`. Ignores unknown keys. Coordinates are within 2e9 m of the origin; a rotation is
/// [w, x, y, z] of length 1 within 1e-6, the identity where it is absent.
QueryLine parse_query(std::string_view line);

}  // namespace terrane::tools
