// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace terrane::tools {

struct HeightQuestion {
    double x = 0.0, y = 0.0;
};

/// A shape to ask about instead of the ground. Where it does not move, it ends where it starts.
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

using Question = std::variant<HeightQuestion, RayQuestion, ShapeQuestion, CastQuestion>;

/// One line of input.
struct QueryLine {
    nlohmann::ordered_json id;  ///< echoed in the answer; discarded where the line has none
    bool has_id = false;
    /// The question, or the sentence that says what is wrong with it.
    tl::expected<Question, std::string> question;
};

/// Reads `{"id":..,"op":..,..}`. Keys that mean nothing here are ignored. Coordinates are at most
/// 1e9 m from the origin; a rotation is [w, x, y, z] of length 1 to 1e-6, and none where it is absent.
QueryLine parse_query(std::string_view line);

}  // namespace terrane::tools
