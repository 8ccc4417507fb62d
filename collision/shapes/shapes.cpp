// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/vector_math.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/shapes.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane {

const internal::CompoundData& internal::compound_data(const Compound& compound) {
    return *compound.data_;
}

namespace {

using internal::dot;
using internal::length;
using internal::rotated;

// Visits the core points of a shape. Their convex hull, enlarged by the returned radius, is the shape.
template <class Visit>
double visit_core(const ConvexShape& shape, Visit visit) {
    if (const Sphere* sphere = std::get_if<Sphere>(&shape)) {
        visit(Eigen::Vector3d(0.0, 0.0, 0.0));
        return sphere->radius;
    }
    if (const Capsule* capsule = std::get_if<Capsule>(&shape)) {
        visit(Eigen::Vector3d(0.0, 0.0, -capsule->half_height));
        visit(Eigen::Vector3d(0.0, 0.0, capsule->half_height));
        return capsule->radius;
    }
    if (const Box* box = std::get_if<Box>(&shape)) {
        internal::BoxStorage storage;
        const internal::Polyhedron corners = internal::box_polyhedron(box->half_extents, storage);
        for (const Eigen::Vector3d& corner : corners.vertices) visit(corner);
        return 0.0;
    }
    for (const Eigen::Vector3d& vertex : std::get<ConvexHull>(shape).vertices()) visit(vertex);
    return 0.0;
}

double support_of(const ConvexShape& shape, const Eigen::Vector3d& direction) {
    return std::visit([&](const auto& each) { return support_distance(each, direction); }, shape);
}

Result<void> check_part(const CompoundPart& part, std::size_t index) {
    constexpr double kOrthonormal = 1e-6;
    char text[240];
    const auto check_each = [](const auto& each) { return each.validate(); };
    if (Result<void> shape = std::visit(check_each, part.shape); !shape) {
        return fail(ErrorCode::invalid_argument,
                    "compound part " + std::to_string(index) + ": " + shape.error().message);
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double offset = part.body_from_part.translation[axis];
        if (std::abs(offset) <= Compound::kLargestOffset) continue;  // false for NaN
        std::snprintf(text, sizeof text,
                      "translation of compound part %zu must be -1e5 to 1e5 m, got %c %.6g", index,
                      "xyz"[axis], offset);
        return fail(ErrorCode::invalid_argument, text);
    }
    const Eigen::Matrix3d& rotation = part.body_from_part.rotation;
    // The determinant of a mirror is negative; NaN fails its test.
    const double off = internal::determinant(rotation) > 0.0 ? internal::column_error(rotation)
                                                             : internal::kInfinity;
    if (off <= kOrthonormal) return {};
    std::snprintf(
        text, sizeof text,
        "rotation of compound part %zu must be orthonormal to 1e-6 with determinant 1, got "
        "one that is off by %.3g",
        index, off);
    return fail(ErrorCode::invalid_argument, text);
}

void add_part(const CompoundPart& part, internal::CompoundData& data_out) {
    const Pose& pose = part.body_from_part;
    Aabb bounds = internal::empty_box();
    double farthest = 0.0;
    const double radius = visit_core(part.shape, [&](const Eigen::Vector3d& point) {
        const Eigen::Vector3d placed = pose.translation + rotated(pose.rotation, point);
        farthest = std::max(farthest, length(placed));
        for (int axis = 0; axis < 3; ++axis) {
            bounds.low[axis] = std::min(bounds.low[axis], placed[axis]);
            bounds.high[axis] = std::max(bounds.high[axis], placed[axis]);
        }
    });
    for (int axis = 0; axis < 3; ++axis) {
        bounds.low[axis] -= radius;
        bounds.high[axis] += radius;
    }
    data_out.parts.push_back(part);
    data_out.bounds.push_back(bounds);
    data_out.bounding_radius = std::max(data_out.bounding_radius, farthest + radius);
    const double half_extent =
        std::visit([](const auto& each) { return smallest_half_extent(each); }, part.shape);
    data_out.smallest_half_extent = std::min(data_out.smallest_half_extent, half_extent);
}

Result<void> check_count(std::size_t count, const char* what) {
    if (count >= 1 && count <= Compound::kMaxParts) return {};
    char text[120];
    std::snprintf(text, sizeof text, "a compound needs 1 to %zu %s, got %zu", Compound::kMaxParts,
                  what, count);
    return fail(ErrorCode::invalid_argument, text);
}

}  // namespace

Compound::Compound(std::shared_ptr<const internal::CompoundData> data) : data_(std::move(data)) {}

Result<Compound> Compound::create(std::span<const CompoundPart> parts) {
    TERRANE_TRY(check_count(parts.size(), "parts"));
    auto data = std::make_shared<internal::CompoundData>();
    for (std::size_t i = 0; i < parts.size(); ++i) {
        TERRANE_TRY(check_part(parts[i], i));
        add_part(parts[i], *data);
    }
    data->tree = internal::make_aabb_tree(data->bounds);
    return Compound(std::move(data));
}

Result<Compound> Compound::from_triangles(std::span<const Eigen::Vector3d> vertices,
                                          std::span<const std::array<std::uint32_t, 3>> triangles) {
    TERRANE_TRY(check_count(triangles.size(), "triangles"));
    auto data = std::make_shared<internal::CompoundData>();
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const std::string name = "triangle " + std::to_string(i);
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = triangles[i][k];
            if (vertex >= vertices.size()) {
                return fail(ErrorCode::invalid_argument, name + " names vertex " +
                                                             std::to_string(vertex) + " of " +
                                                             std::to_string(vertices.size()));
            }
            corners[k] = vertices[vertex];
        }
        const Result<ConvexHull> hull = ConvexHull::create(corners);
        if (!hull) return fail(ErrorCode::invalid_argument, name + ": " + hull.error().message);
        add_part({*hull, Pose()}, *data);
    }
    data->tree = internal::make_aabb_tree(data->bounds);
    return Compound(std::move(data));
}

std::span<const CompoundPart> Compound::parts() const { return data_->parts; }

std::span<const Aabb> Compound::bounds() const { return data_->bounds; }

std::span<const internal::AabbNode> internal::part_tree(const Compound& compound) {
    return compound_data(compound).tree;
}

double bounding_radius(const Compound& compound) { return compound.data_->bounding_radius; }

double smallest_half_extent(const Compound& compound) {
    return compound.data_->smallest_half_extent;
}

double support_distance(const Compound& compound, const Eigen::Vector3d& direction_body) {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const CompoundPart& part : compound.parts()) {
        const Eigen::Vector3d direction =
            internal::rotated_back(part.body_from_part.rotation, direction_body);
        farthest = std::max(farthest, dot(direction_body, part.body_from_part.translation) +
                                          support_of(part.shape, direction));
    }
    return farthest;
}

namespace {

constexpr double kLargestSize = 1e5;  // metres; beyond it tolerances of 1e-9 m are meaningless

Result<void> check_size(const char* name, double value) {
    if (value >= 0.0 && value <= kLargestSize) return {};  // false for NaN
    char text[160];
    std::snprintf(text, sizeof text, "%s must be 0 to 1e5 m, got %.6g", name, value);
    return fail(ErrorCode::invalid_argument, text);
}

double bounding_radius(const Sphere& sphere) { return sphere.radius; }
double bounding_radius(const Capsule& capsule) { return capsule.radius + capsule.half_height; }
double bounding_radius(const Box& box) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::sqrt(half.x() * half.x() + half.y() * half.y() + half.z() * half.z());
}

double smallest_half_extent(const Sphere& sphere) { return sphere.radius; }
double smallest_half_extent(const Capsule& capsule) { return capsule.radius; }
double smallest_half_extent(const Box& box) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::min({half.x(), half.y(), half.z()});
}

double support_distance(const Sphere& sphere, const Eigen::Vector3d&) { return sphere.radius; }
double support_distance(const Capsule& capsule, const Eigen::Vector3d& direction_body) {
    return capsule.radius + capsule.half_height * std::abs(direction_body.z());
}
double support_distance(const Box& box, const Eigen::Vector3d& direction_body) {
    const Eigen::Vector3d& half = box.half_extents;
    return std::abs(direction_body.x()) * half.x() + std::abs(direction_body.y()) * half.y() +
           std::abs(direction_body.z()) * half.z();
}

}  // namespace

Result<void> Sphere::validate() const { return check_size("sphere radius", radius); }

Result<void> Capsule::validate() const {
    TERRANE_TRY(check_size("capsule radius", radius));
    return check_size("capsule half_height", half_height);
}

Result<void> Box::validate() const {
    TERRANE_TRY(check_size("box half_extents x", half_extents.x()));
    TERRANE_TRY(check_size("box half_extents y", half_extents.y()));
    return check_size("box half_extents z", half_extents.z());
}

Result<void> validate(const Shape& shape) {
    return std::visit([](const auto& each) { return each.validate(); }, shape);
}

double bounding_radius(const Shape& shape) {
    return std::visit([](const auto& each) { return bounding_radius(each); }, shape);
}

double smallest_half_extent(const Shape& shape) {
    return std::visit([](const auto& each) { return smallest_half_extent(each); }, shape);
}

double default_contact_tolerance(const Shape& shape) {
    return std::min(0.01, 0.1 * smallest_half_extent(shape));
}

double support_distance(const Shape& shape, const Eigen::Vector3d& direction_body) {
    return std::visit([&](const auto& each) { return support_distance(each, direction_body); },
                      shape);
}

}  // namespace terrane
