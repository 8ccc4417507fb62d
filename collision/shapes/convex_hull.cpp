// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "shapes/hull_data.h"

#include <terrane/collision/convex_hull.h>

#include <cstdio>
#include <utility>

namespace terrane {

ConvexHull::ConvexHull(std::shared_ptr<const internal::HullData> data) : data_(std::move(data)) {}

Result<ConvexHull> ConvexHull::create(std::span<const Eigen::Vector3d> points) {
    char text[200];
    if (points.empty() || points.size() > kMaxPoints) {
        std::snprintf(text, sizeof text, "a convex hull needs 1 to %zu points, got %zu", kMaxPoints,
                      points.size());
        return fail(ErrorCode::invalid_argument, text);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            // Written so that NaN is refused.
            if (std::abs(points[i][axis]) <= kLargestCoordinate) continue;
            std::snprintf(text, sizeof text,
                          "coordinates of hull point %zu must be -1e5 to 1e5 m, got %c %.6g", i,
                          "xyz"[axis], points[i][axis]);
            return fail(ErrorCode::invalid_argument, text);
        }
    }
    return ConvexHull(internal::make_hull_data(points));
}

std::span<const Eigen::Vector3d> ConvexHull::vertices() const { return data_->vertices; }

std::size_t ConvexHull::face_count() const { return data_->faces.size(); }

std::span<const std::uint32_t> ConvexHull::face(std::size_t index) const {
    const internal::Polyhedron::Face& face = data_->faces[index];
    return std::span(data_->loops).subspan(face.first, face.count);
}

Result<void> check(const ConvexHull&) { return {}; }

double bounding_radius(const ConvexHull& hull) { return internal::hull_data(hull).bounding_radius; }

double smallest_half_extent(const ConvexHull& hull) {
    return internal::hull_data(hull).smallest_half_extent;
}

double support_distance(const ConvexHull& hull, const Eigen::Vector3d& direction_body) {
    const internal::Polyhedron& polyhedron = internal::polyhedron(hull);
    const std::uint32_t vertex = internal::find_extreme(polyhedron, direction_body);
    return internal::dot(direction_body, polyhedron.vertices[vertex]);
}

namespace internal {

const HullData& hull_data(const ConvexHull& hull) { return *hull.data_; }

const Polyhedron& polyhedron(const ConvexHull& hull) { return hull_data(hull).polyhedron; }

}  // namespace internal
}  // namespace terrane
