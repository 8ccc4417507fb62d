// SPDX-License-Identifier: MIT
#include "query/parsing/shape_parsing.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

namespace terrane::tools {
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

// The single key of a shape and its value.
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
        if (const Result<void> good = check(*shape); !good) return wrong(good.error().message);
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

}  // namespace terrane::tools
