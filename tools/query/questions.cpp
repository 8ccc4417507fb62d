// SPDX-License-Identifier: MIT
#include "query/questions.h"

#include "program/json_values.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::size_t kRead_bytes = std::size_t{1} << 16;

}  // namespace

LineReader::LineReader(int file_descriptor, std::function<void()> before_wait)
    : file_descriptor_(file_descriptor), before_wait_(std::move(before_wait)) {}

LineReader::Status LineReader::next(std::string_view& line_out) {
    bool is_too_long = false;
    std::size_t searched = begin_;
    for (;;) {
        const std::size_t line_end = buffer_.find('\n', searched);
        if (line_end != std::string::npos || (at_end_ && begin_ < buffer_.size())) {
            const std::size_t end = line_end == std::string::npos ? buffer_.size() : line_end;
            line_out = std::string_view(buffer_).substr(begin_, end - begin_);
            begin_ = line_end == std::string::npos ? end : end + 1;
            if (is_too_long || line_out.size() > kMaxLine_bytes) return Status::too_long;
            if (line_out.ends_with('\r')) line_out.remove_suffix(1);
            return Status::line;
        }
        if (at_end_) return is_too_long ? Status::too_long : Status::end;
        buffer_.erase(0, begin_);
        begin_ = 0;
        if (buffer_.size() > kMaxLine_bytes) {
            is_too_long = true;
            buffer_.clear();
        }
        searched = buffer_.size();
        before_wait_();
        buffer_.resize(searched + kRead_bytes);
        const ssize_t count = read(file_descriptor_, buffer_.data() + searched, kRead_bytes);
        buffer_.resize(searched + static_cast<std::size_t>(count > 0 ? count : 0));
        if (count == 0) at_end_ = true;
        if (count < 0 && errno != EINTR) return Status::failed;
    }
}

namespace {

using Json = nlohmann::ordered_json;

constexpr double kUsualFov_deg = 60.0;
constexpr double kLeastFov_deg = 0.1, kMostFov_deg = 179.0;
constexpr double kUsualFar = 1e5, kMostFar = 1e9;
constexpr double kMostSide_px = 1e6;
// Least sine of the angle between `forward` and `up`.
constexpr double kLeastSine = 1e-6;

Parsed<double> read_number_or(const Json& object, const char* key, double otherwise) {
    if (!object.contains(key)) return otherwise;
    return read_number(object, key);
}

/// Reads a direction and scales it to length 1.
Parsed<Eigen::Vector3d> read_direction(const Json& object, const char* key) {
    const auto numbers = read_array<3>(object, key);
    if (!numbers) return wrong(numbers.error());
    const auto& [x, y, z] = *numbers;
    const double most = std::max({std::abs(x), std::abs(y), std::abs(z)});
    if (!std::isfinite(x + y + z) || !(most > 0.0))
        return wrong(fmt::format("{} must be a direction, got {}", key, shown(object.at(key))));
    // scaled first, because the square of a small number may underflow
    return Eigen::Vector3d((Eigen::Vector3d(x, y, z) / most).normalized());
}

Parsed<Eigen::Vector3d> read_forward(const Json& object, const WorldPos& eye_world) {
    if (object.contains("look") == object.contains("forward"))
        return wrong(object.contains("look") ? "look and forward exclude each other"
                                             : "look is missing, and forward too");
    if (object.contains("forward")) return read_direction(object, "forward");
    const Parsed<WorldPos> look = read_point(object, "look");
    if (!look) return wrong(look.error());
    const Eigen::Vector3d way = *look - eye_world;
    if (way == Eigen::Vector3d::Zero()) return wrong("eye and look must be apart");
    return Eigen::Vector3d(way.normalized());
}

/// Turns the view about `forward` until a direction is up in the picture.
Parsed<void> turn_up(const Eigen::Vector3d& up, View& view) {
    const Eigen::Vector3d right = view.forward.cross(up);
    if (!(right.norm() > kLeastSine)) return wrong("up must not be along the line of sight");
    view.up = right.normalized().cross(view.forward);
    return {};
}

Parsed<std::array<int, 2>> read_size(const Json& object) {
    const auto size = read_array<2>(object, "size");
    if (!size) return wrong(size.error());
    std::array<int, 2> pixels{};
    for (std::size_t i = 0; i < 2; ++i) {
        const double side = (*size)[i];
        if (!(side >= 1.0 && side <= kMostSide_px) || side != std::floor(side)) {
            return wrong(fmt::format("size must be two whole numbers from 1 to 1e6, got {}",
                                     shown(object.at("size"))));
        }
        pixels[i] = static_cast<int>(side);
    }
    return pixels;
}

}  // namespace

Parsed<PickQuestion> read_pick(const Json& object) {
    if (object.contains("other")) return wrong("pick is asked of the scene, not of other");
    const Parsed<WorldPos> eye = read_point(object, "eye");
    if (!eye) return wrong(eye.error());
    const Parsed<Eigen::Vector3d> forward = read_forward(object, *eye);
    if (!forward) return wrong(forward.error());
    const Parsed<double> fov_deg = read_number_or(object, "fov_deg", kUsualFov_deg);
    if (!fov_deg) return wrong(fov_deg.error());
    if (!(*fov_deg >= kLeastFov_deg && *fov_deg <= kMostFov_deg))
        return wrong(fmt::format("fov_deg must be 0.1 to 179, got {:.6g}", *fov_deg));
    const Parsed<std::array<int, 2>> size = read_size(object);
    if (!size) return wrong(size.error());
    const auto pixel = read_array<2>(object, "pixel");
    if (!pixel) return wrong(pixel.error());
    const auto [x_px, y_px] = *pixel;
    const auto [width, height] = *size;
    if (!(x_px >= 0.0 && x_px <= width && y_px >= 0.0 && y_px <= height)) {
        return wrong(fmt::format("pixel must be within the picture of {} x {}, got {}", width,
                                 height, shown(object.at("pixel"))));
    }
    const Parsed<double> far_distance = read_number_or(object, "far_m", kUsualFar);
    if (!far_distance) return wrong(far_distance.error());
    if (!(*far_distance > 0.0 && *far_distance <= kMostFar))
        return wrong(fmt::format("far_m must be above 0, at most 1e9, got {:.6g}", *far_distance));

    // looks from the origin, because large coordinates of the eye would cost precision of the direction
    Result<View> view =
        look_at(WorldPos::Zero(), *forward, *fov_deg * std::numbers::pi / 180.0, width, height);
    if (!view) return wrong(view.error().message);
    view->eye_world = *eye;
    if (object.contains("up")) {
        const Parsed<Eigen::Vector3d> up = read_direction(object, "up");
        if (!up) return wrong(up.error());
        if (auto ok = turn_up(*up, *view); !ok) return wrong(ok.error());
    }
    return PickQuestion{.view = *view, .x_px = x_px, .y_px = y_px, .far_distance = *far_distance};
}

namespace {

using Json = nlohmann::ordered_json;

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

// Reads a shape with its start and end poses. Without `to` the end pose is the start pose.
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

// Reads the shape at `other`, if that key is present.
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

namespace {

constexpr const char* kLonlat = "lonlat";
constexpr const char* kLonlatPoints[] = {"from", "to", "eye", "look"};

}  // namespace

Parsed<WorldPos> LonlatKeys::place(const Json& object, const std::string& key, std::size_t count) {
    const Json& value = object.at(key);
    bool is_good = value.is_array() && value.size() == count;
    for (std::size_t i = 0; is_good && i < count; ++i) is_good = value[i].is_number();
    if (!is_good) {
        return wrong(fmt::format("{} must be [longitude, latitude{}], got {}", key,
                                 count == 3 ? ", z" : "", shown(value)));
    }
    if (!georeference_) georeference_ = georeference_of(terrain_);
    if (!*georeference_) {
        return wrong(
            fmt::format("{} needs a raster with a CRS: {}", key, georeference_->error().message));
    }
    WorldPos p_world = (*georeference_)
                           ->world_from_lonlat(Eigen::Vector3d(value[0].get<double>(),
                                                               value[1].get<double>(), 0.0));
    if (!p_world.head<2>().allFinite()) {
        return wrong(fmt::format("{} {} has no place in the raster's CRS", key, shown(value)));
    }
    p_world.z() = count == 3 ? value[2].get<double>() : 0.0;
    return p_world;
}

Parsed<bool> LonlatKeys::replace_in(Json& object) {
    bool has_any = false;
    const auto put = [&](const std::string& from, const char* to) -> Parsed<void> {
        if (!object.contains(from)) return {};
        if (object.contains(to))
            return wrong(fmt::format("{} and {} exclude each other", from, to));
        const Parsed<WorldPos> p_world = place(object, from, 3);
        if (!p_world) return wrong(p_world.error());
        object[to] = Json::array({p_world->x(), p_world->y(), p_world->z()});
        has_any = true;
        return {};
    };
    for (const char* key : kLonlatPoints) {
        if (const auto done = put(std::string(key) + "_lonlat", key); !done)
            return wrong(done.error());
    }
    if (const auto found = object.find(kLonlat); found != object.end() && !found->is_boolean()) {
        const bool is_flat =
            object.contains("op") && (object["op"] == "height" || object["op"] == "height_below");
        if (!is_flat) {
            if (const auto done = put(kLonlat, "position"); !done) return wrong(done.error());
            return true;
        }
        if (object.contains("x") || object.contains("y")) {
            return wrong("lonlat and x, y exclude each other");
        }
        const Parsed<WorldPos> p_world = place(object, kLonlat, 2);
        if (!p_world) return wrong(p_world.error());
        object["x"] = p_world->x();
        object["y"] = p_world->y();
        has_any = true;
    }
    return has_any;
}

Parsed<bool> LonlatKeys::replace(Json& question) {
    const auto asked = question.find(kLonlat);
    bool is_asked = asked != question.end() && asked->is_boolean() && asked->get<bool>();
    if (is_asked) {
        if (!georeference_) georeference_ = georeference_of(terrain_);
        if (!*georeference_) {
            return wrong("lonlat needs a raster with a CRS: " + georeference_->error().message);
        }
    }
    const Parsed<bool> has_any = replace_in(question);
    if (!has_any) return has_any;
    const auto other = question.find("other");
    if (other == question.end() || !other->is_object()) return is_asked || *has_any;
    const Parsed<bool> has_other = replace_in(*other);
    if (!has_other) return wrong("other: " + has_other.error());
    return is_asked || *has_any || *has_other;
}

void LonlatKeys::add_to(Json& answer, const Question& question) const {
    if (!georeference_ || !*georeference_) return;
    WorldPos p_world;
    if (const auto* height = std::get_if<HeightQuestion>(&question)) {
        p_world = {height->x, height->y, 0.0};
    } else if (const auto point = answer.find("point"); point != answer.end()) {
        p_world = {(*point)[0].get<double>(), (*point)[1].get<double>(), (*point)[2].get<double>()};
    } else {
        return;
    }
    const Eigen::Vector3d lonlat = (*georeference_)->lonlat_from_world(p_world);
    answer[kLonlat] = Json::array({lonlat.x(), lonlat.y()});
}

QueryLine parse_query(std::string_view line, LonlatKeys* lonlat) {
    QueryLine parsed{.id = {}, .has_id = false, .wants_lonlat = false, .question = wrong("")};
    Parsed<Json> object = parse_json(line);
    if (!object) {
        // of the only line
        constexpr std::string_view kLine = "line 1, ";
        std::string fault = object.error();
        if (fault.starts_with(kLine)) fault.erase(0, kLine.size());
        parsed.question = wrong("the line is no JSON: " + fault);
        return parsed;
    }
    if (!object->is_object()) {
        parsed.question = wrong("the line must be a JSON object, got " + shown(*object));
        return parsed;
    }
    if (const auto id = object->find("id"); id != object->end()) {
        parsed.id = *id;
        parsed.has_id = true;
    }
    if (lonlat != nullptr) {
        const Parsed<bool> replaced = lonlat->replace(*object);
        if (!replaced) {
            parsed.question = wrong(replaced.error());
            return parsed;
        }
        parsed.wants_lonlat = *replaced;
    }
    parsed.question = read_question(*object);
    return parsed;
}

}  // namespace terrane::tools
