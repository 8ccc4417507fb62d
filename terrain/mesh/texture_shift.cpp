// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "base/vector_math.h"

#include <terrane/terrain/texture_shift.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace terrane {
namespace {

using Triangle = TriangleMesh::Triangle;

// Position and texture coordinates times metres per coordinate.
using Point = std::array<double, 5>;

double dot(const Point& a, const Point& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
}

Point minus(const Point& a, const Point& b) {
    Point made;
    for (std::size_t k = 0; k < made.size(); ++k) made[k] = a[k] - b[k];
    return made;
}

// Squared distance from the origin to the segment from a in a direction.
double to_segment(const Point& a, const Point& along) {
    const double square = dot(along, along);
    const double t = square > 0.0 ? std::clamp(-dot(a, along) / square, 0.0, 1.0) : 0.0;
    Point nearest;
    for (std::size_t k = 0; k < nearest.size(); ++k) nearest[k] = a[k] + t * along[k];
    return dot(nearest, nearest);
}

// Squared distance from a point to a triangle.
double squared_distance(const Point& p, const std::array<Point, 3>& corners) {
    const Point a = minus(corners[0], p), first = minus(corners[1], corners[0]),
                second = minus(corners[2], corners[0]);
    const double ff = dot(first, first), fs = dot(first, second), ss = dot(second, second);
    const double fa = -dot(first, a), sa = -dot(second, a);
    const double determinant = ff * ss - fs * fs;
    if (determinant > 0.0) {
        // weights of the corners at the point of the plane that is nearest
        const double u = (fa * ss - sa * fs) / determinant, v = (sa * ff - fa * fs) / determinant;
        if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) {
            Point nearest;
            for (std::size_t k = 0; k < nearest.size(); ++k)
                nearest[k] = a[k] + u * first[k] + v * second[k];
            return dot(nearest, nearest);
        }
    }
    const Point b = minus(corners[1], p);
    return std::min({to_segment(a, first), to_segment(a, second),
                     to_segment(b, minus(corners[2], corners[1]))});
}

std::uint16_t material_of(const TriangleMesh& mesh, std::uint32_t vertex) {
    return mesh.materials.empty() ? std::uint16_t{0} : mesh.materials[vertex];
}

}  // namespace

double metres_per_texture_coordinate(const TriangleMesh& mesh) {
    if (mesh.texture_coordinates.empty()) return 0.0;
    double area = 0.0, area_of_texture = 0.0;
    for (const Triangle& t : mesh.triangles) {
        const Eigen::Vector3d& p = mesh.positions[t[0]];
        area +=
            internal::length(internal::cross(mesh.positions[t[1]] - p, mesh.positions[t[2]] - p));
        const auto at = [&](std::size_t i) -> Eigen::Vector2d {
            return mesh.texture_coordinates[t[i]].cast<double>();
        };
        const Eigen::Vector2d first = at(1) - at(0), second = at(2) - at(0);
        area_of_texture += std::abs(first.x() * second.y() - first.y() * second.x());
    }
    return area_of_texture > 0.0 ? std::sqrt(area / area_of_texture) : 0.0;
}

double texture_shift_m(const TriangleMesh& mesh, std::span<const Triangle> level,
                       std::size_t most_samples) {
    const double scale = metres_per_texture_coordinate(mesh);
    const auto point_of = [&](std::uint32_t vertex) -> Point {
        const Eigen::Vector3d& p = mesh.positions[vertex];
        Point made = {p.x(), p.y(), p.z(), 0.0, 0.0};
        if (mesh.texture_coordinates.empty()) return made;
        made[3] = scale * static_cast<double>(mesh.texture_coordinates[vertex].x());
        made[4] = scale * static_cast<double>(mesh.texture_coordinates[vertex].y());
        return made;
    };
    std::vector<Aabb> boxes;
    for (const Triangle& t : level) {
        Aabb& box = boxes.emplace_back(internal::empty_box());
        for (const std::uint32_t vertex : t) internal::include(mesh.positions[vertex], 0.0, box);
    }
    const std::vector<internal::AabbNode> tree = internal::make_aabb_tree(boxes);
    std::vector<bool> is_used(mesh.positions.size());
    for (const Triangle& t : mesh.triangles) {
        for (const std::uint32_t vertex : t) is_used[vertex] = true;
    }
    const std::size_t stride = mesh.positions.size() / std::max<std::size_t>(most_samples, 1) + 1;
    double largest = 0.0;
    for (std::size_t i = 0; i < mesh.positions.size(); i += stride) {
        if (!is_used[i]) continue;
        const auto vertex = static_cast<std::uint32_t>(i);
        const Point p = point_of(vertex);
        const Eigen::Vector3d& place = mesh.positions[vertex];
        double least = internal::kInfinity;
        internal::visit_leaves_up_to(
            tree, least,
            [&](const Aabb& box) {
                double square = 0.0;
                for (int axis = 0; axis < 3; ++axis) {
                    const double outside =
                        std::max({box.low[axis] - place[axis], place[axis] - box.high[axis], 0.0});
                    square += outside * outside;
                }
                return square;
            },
            [&](std::uint32_t item) {
                const Triangle& t = level[item];
                if (material_of(mesh, t[0]) == material_of(mesh, vertex)) {
                    least = std::min(least, squared_distance(p, {point_of(t[0]), point_of(t[1]),
                                                                 point_of(t[2])}));
                }
                // no triangle is nearer than what would not change the result
                return least <= largest * largest ? -internal::kInfinity : least;
            });
        largest = std::max(largest, std::sqrt(least));
    }
    return largest;
}

}  // namespace terrane
