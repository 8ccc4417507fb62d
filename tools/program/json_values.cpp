// SPDX-License-Identifier: MIT
#include "program/json_values.h"

#include "program/command.h"
#include "program/geometry.h"
#include "program/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMaxCoordinate = 2e9;
constexpr double kUnitTolerance = 1e-6;
constexpr int kMaxNesting = 64;

/// Nesting depth of the brackets of a text: limited, because functions on values recurse.
int nesting_of(std::string_view text) {
    int depth = 0;
    int deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string) {
            if (c == '\\') ++i;
            if (c == '"') in_string = false;
        } else if (c == '"') {
            in_string = true;
        } else if (c == '[' || c == '{') {
            deepest = std::max(deepest, ++depth);
        } else if (c == ']' || c == '}') {
            --depth;
        }
    }
    return deepest;
}

}  // namespace

tl::unexpected<std::string> wrong(std::string message) {
    return tl::unexpected<std::string>(std::move(message));
}

Parsed<Json> parse_json(std::string_view text) {
    if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        return wrong("UTF-16 text, which must be UTF-8");
    if (nesting_of(text) > kMaxNesting)
        return wrong(fmt::format("brackets go deeper than {}", kMaxNesting));
    try {
        return Json::parse(text);
    } catch (const Json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
        std::string_view what = error.what();
        for (const std::string_view before : {"] ", "parse error at "}) {
            const std::size_t begin = what.find(before);
            if (begin != std::string_view::npos) what.remove_prefix(begin + before.size());
        }
        return wrong(std::string(what));
    }
}

std::string shown(const Json& value) {
    std::string text = to_line(value);
    if (text.size() <= 60) return text;
    std::size_t end = 57;
    // not within a character of UTF-8
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
    return text.substr(0, end) + "...";
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

namespace {

using Json = nlohmann::ordered_json;

Parsed<Shape> read_sphere(const Json& sizes) {
    const Parsed<double> radius = read_number(sizes, "radius");
    if (!radius) return wrong(radius.error());
    return Sphere{.radius = *radius};
}

Parsed<Shape> read_capsule(const Json& sizes) {
    const Parsed<double> radius = read_number(sizes, "radius");
    if (!radius) return wrong(radius.error());
    const Parsed<double> half_height = read_number(sizes, "half_height");
    if (!half_height) return wrong(half_height.error());
    return Capsule{.radius = *radius, .half_height = *half_height};
}

Parsed<Shape> read_box(const Json& sizes) {
    const Parsed<std::array<double, 3>> halves = read_array<3>(sizes, "half_extents");
    if (!halves) return wrong(halves.error());
    return Box{.half_extents = {(*halves)[0], (*halves)[1], (*halves)[2]}};
}

Parsed<Shape> read_hull(const Json& sizes) {
    const auto found = sizes.find("points");
    if (found == sizes.end()) return wrong("points is missing");
    if (!found->is_array()) {
        return wrong(fmt::format("points must be an array of points, got {}", shown(*found)));
    }
    std::vector<Eigen::Vector3d> points;
    points.reserve(found->size());
    for (const Json& point : *found) {
        const std::optional<std::array<double, 3>> numbers = numbers_of<3>(point);
        if (!numbers) {
            return wrong(
                fmt::format("points[{}] must be 3 numbers, got {}", points.size(), shown(point)));
        }
        points.emplace_back((*numbers)[0], (*numbers)[1], (*numbers)[2]);
    }
    const Result<ConvexHull> hull = ConvexHull::create(points);
    if (!hull) return wrong(hull.error().message);
    return *hull;
}

// The only key of the object that describes a shape, and the value of that key.
struct Named {
    std::string kind;
    const Json& content;
};

Parsed<Named> read_kind(const Json& object, const char* key) {
    const auto found = object.find(key);
    if (found == object.end()) return wrong(fmt::format("{} is missing", key));
    if (!found->is_object() || found->size() != 1) {
        return wrong(fmt::format("{} must be an object with one key, got {}", key, shown(*found)));
    }
    return Named{found->begin().key(), found->begin().value()};
}

Parsed<Shape> read_convex(const Named& named, const char* key, const char* choices) {
    const auto& [kind, sizes] = named;
    struct Reader {
        const char* name;
        Parsed<Shape> (*read)(const Json& sizes);
    };
    constexpr std::array<Reader, 4> kReaders{{{"sphere", read_sphere},
                                              {"capsule", read_capsule},
                                              {"box", read_box},
                                              {"hull", read_hull}}};
    for (const auto& [name, read] : kReaders) {
        if (kind != name) continue;
        if (!sizes.is_object()) {
            return wrong(fmt::format("{} must be an object, got {}", kind, shown(sizes)));
        }
        const Parsed<Shape> shape = read(sizes);
        if (!shape) return wrong(shape.error());
        if (const Result<void> good = validate(*shape); !good) return wrong(good.error().message);
        return shape;
    }
    return wrong(fmt::format("{} must be {}, got {}", key, choices, shown(kind)));
}

Parsed<CompoundPart> read_part(const Json& object) {
    if (!object.is_object()) {
        return wrong(fmt::format("must be an object, got {}", shown(object)));
    }
    const Parsed<Named> named = read_kind(object, "shape");
    if (!named) return wrong(named.error());
    if (named->kind == "compound") return wrong("shape must not be a compound in a compound");
    const Parsed<Shape> shape = read_convex(*named, "shape", "sphere, capsule, box or hull");
    if (!shape) return wrong(shape.error());
    const Parsed<Pose> pose = read_pose(object, PositionAbsent::is_origin);
    if (!pose) return wrong(pose.error());
    CompoundPart part{.shape = Sphere{}, .body_from_part = *pose};
    std::visit(
        [&](const auto& each) {
            if constexpr (std::is_constructible_v<ConvexShape, decltype(each)>) part.shape = each;
        },
        *shape);
    return part;
}

Parsed<Shape> read_compound(const Json& list) {
    if (!list.is_array()) {
        return wrong(fmt::format("compound must be an array of parts, got {}", shown(list)));
    }
    std::vector<CompoundPart> parts;
    parts.reserve(list.size());
    for (const Json& each : list) {
        Parsed<CompoundPart> part = read_part(each);
        if (!part) return wrong(fmt::format("compound[{}]: {}", parts.size(), part.error()));
        parts.push_back(*std::move(part));
    }
    const Result<Compound> compound = Compound::create(parts);
    if (!compound) return wrong(compound.error().message);
    return *compound;
}

}  // namespace

Parsed<Shape> read_shape(const Json& object, const char* key) {
    const Parsed<Named> named = read_kind(object, key);
    if (!named) return wrong(named.error());
    if (named->kind == "compound") return read_compound(named->content);
    return read_convex(*named, key, "sphere, capsule, box, hull or compound");
}

namespace {

using Json = nlohmann::ordered_json;

/// Refuses keys of a compound's part that read_shape() would ignore. read_shape() refuses unknown kinds of shapes.
Parsed<void> check_part_keys(const Json& part, const std::string& path) {
    if (const Parsed<void> good = check_keys(part, path, {"shape", "position", "rotation"});
        !good) {
        return good;
    }
    const auto shape = part.find("shape");
    return shape == part.end() ? Parsed<void>{} : check_shape_keys(*shape, path + ".shape");
}

}  // namespace

Parsed<void> check_keys(const nlohmann::ordered_json& value, const std::string& path,
                        std::initializer_list<std::string_view> known) {
    if (!value.is_object()) {
        return wrong(fmt::format("{} must be an object, got {}", path, shown(value)));
    }
    for (const auto& item : value.items()) {
        if (std::ranges::find(known, item.key()) != known.end()) continue;
        const std::vector<std::string> words(known.begin(), known.end());
        return wrong(fmt::format("unknown key '{}.{}'{}", path, item.key(),
                                 did_you_mean(item.key(), words)));
    }
    return {};
}

Parsed<void> check_shape_keys(const Json& shape, const std::string& path) {
    if (!shape.is_object() || shape.size() != 1) return {};
    const std::string& kind = shape.begin().key();
    const Json& content = shape.begin().value();
    const std::string inner = path + "." + kind;
    if (kind == "compound" && content.is_array()) {
        for (std::size_t i = 0; i < content.size(); ++i) {
            const Parsed<void> good = check_part_keys(content[i], fmt::format("{}[{}]", inner, i));
            if (!good) return good;
        }
    }
    if (!content.is_object()) return {};
    if (kind == "sphere") return check_keys(content, inner, {"radius"});
    if (kind == "capsule") return check_keys(content, inner, {"radius", "half_height"});
    if (kind == "box") return check_keys(content, inner, {"half_extents"});
    if (kind == "hull") return check_keys(content, inner, {"points"});
    return {};
}

Parsed<double> read_in_range(const nlohmann::ordered_json& object, const char* key,
                             double otherwise, double low, double high) {
    if (!object.contains(key)) return otherwise;
    const Parsed<double> value = read_number(object, key);
    if (value && !(*value >= low && *value <= high)) {
        return wrong(
            fmt::format("{} must be {:.6g} to {:.6g}, got {:.6g}", key, low, high, *value));
    }
    return value;
}

}  // namespace terrane::tools
