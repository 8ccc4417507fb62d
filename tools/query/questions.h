// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"
#include "scene/terrain_options.h"

#include <terrane/collision/shapes.h>
#include <terrane/dem/georeference.h>
#include <terrane/terrain/view.h>

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace terrane::tools {

/// Reads lines from a file descriptor for interactive use: calls back before each blocking read, so that the caller can
/// flush its answers.
class LineReader {
public:
    /// Enough for the largest hull or compound, with all digits.
    static constexpr std::size_t kMaxLine_bytes = std::size_t{1} << 24;

    enum class Status {
        line,      ///< a line; the last one may lack a line end
        too_long,  ///< a line of more than kMaxLine_bytes, which was skipped
        end,       ///< end of input
        failed,    ///< read error: see errno
    };

    /// @param before_wait called before each read that may block
    LineReader(int file_descriptor, std::function<void()> before_wait);

    /// The next line without its line end (LF or CR LF); valid until the next call.
    Status next(std::string_view& line_out);

private:
    int file_descriptor_;
    std::function<void()> before_wait_;
    std::string buffer_;
    std::size_t begin_ = 0;  ///< start of the unread part
    bool at_end_ = false;
};

/// Asks for the highest surface; with `below`, for the highest one at or below that height, as in a cave.
struct HeightQuestion {
    double x = 0.0, y = 0.0;
    std::optional<double> below = {};
};

/// The shape at the key `other`, which replaces the ground. If it rests, its end pose equals its start pose.
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

/// Asks which surface a camera shows at a point of its picture.
struct PickQuestion {
    View view;
    double x_px = 0.0, y_px = 0.0;  ///< from the left and the top edge; pixel i spans i to i + 1
    double far_distance = 0.0;      ///< metres from the eye; farther hits are ignored
};

using Question =
    std::variant<HeightQuestion, RayQuestion, ShapeQuestion, CastQuestion, PickQuestion>;

/// One line of input.
struct QueryLine {
    nlohmann::ordered_json id;  ///< repeated in the answer; `discarded` if the line has none
    bool has_id = false;
    bool wants_lonlat = false;  ///< see LonlatKeys
    /// The question, or an error message.
    tl::expected<Question, std::string> question;
};

/// Longitudes and latitudes in lines of `terrane query`: degrees in WGS 84.
///
/// `lonlat`, [longitude, latitude], stands for the keys x and y of a question; [longitude, latitude, z] stands for its
/// position. `from_lonlat`, `to_lonlat`, `eye_lonlat` and `look_lonlat` stand for from, to, eye and look. z is that of
/// the world. The answer to a question with such a key, or with "lonlat": true, has the longitude and latitude of its
/// point, or of x and y, at `lonlat`.
class LonlatKeys {
public:
    /// @param terrain must outlive the object
    explicit LonlatKeys(const Terrain& terrain) : terrain_(terrain) {}

    /// Replaces the keys of a line by world positions. Returns whether the answer has a longitude and latitude. The
    /// first line with such a key opens the georeference.
    Parsed<bool> replace(nlohmann::ordered_json& question);
    /// Adds the longitude and latitude to an answer.
    void add_to(nlohmann::ordered_json& answer, const Question& question) const;

private:
    Parsed<WorldPos> place(const nlohmann::ordered_json& object, const std::string& key,
                           std::size_t count);
    Parsed<bool> replace_in(nlohmann::ordered_json& object);

    const Terrain& terrain_;
    std::optional<Result<Georeference>> georeference_;
};

/// Parses `{"id":..,"op":..,..}`. Ignores unknown keys. Coordinates must be within 2e9 m of 0. A rotation is [w, x, y,
/// z] of length 1 within 1e-6, by default the identity.
///
/// @param lonlat null: ignores keys of longitude and latitude
QueryLine parse_query(std::string_view line, LonlatKeys* lonlat = nullptr);

/// Parses a pick: `{"eye":[x,y,z],"look":[x,y,z],"fov_deg":60,"size":[w,h],"pixel":[x,y],"far_m":100000}`, with the
/// names of flags of `terrane mesh`. `forward`, a direction of any length, may take the place of `look`. `up` is the
/// direction that is up in the picture, by default z, or north if the camera looks straight up or down. The pixel must
/// be within the picture, including its edges. fov_deg is 0.1 to 179, by default 60; far_m is above 0, at most 1e9.
Parsed<PickQuestion> read_pick(const nlohmann::ordered_json& object);

}  // namespace terrane::tools
