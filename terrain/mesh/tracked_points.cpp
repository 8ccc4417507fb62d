// SPDX-License-Identifier: MIT
#include "mesh/tracked_points.h"

#include "base/vector_math.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {

TrackedPoints::TrackedPoints(std::span<const Eigen::Vector3d> vertices,
                             std::span<const StarMesh::Triangle> triangles)
    : first_(triangles.size(), kNone) {
    std::vector<std::uint8_t> is_added(vertices.size(), 0);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        for (const std::uint32_t v : triangles[i]) {
            if (is_added[v] != 0) continue;
            is_added[v] = 1;
            points_.push_back({vertices[v], first_[i]});
            first_[i] = static_cast<std::uint32_t>(points_.size() - 1);
        }
    }
}

double TrackedPoints::measure(std::span<const std::uint32_t> from, std::span<const Target> to,
                              double limit) {
    from_.assign(from.begin(), from.end());
    target_triangles_.clear();
    prisms_.clear();
    assigned_.clear();
    errors_.assign(to.size(), 0.0);
    for (const Target& target : to) {
        target_triangles_.push_back(target.triangle);
        const auto& [a, b, c] = target.corners;
        const Eigen::Vector3d first = b - a, second = c - a, normal = cross(first, second);
        const double square = dot(normal, normal);
        if (square > 0.0) {
            prisms_.push_back({a, cross(second, normal) / square, cross(normal, first) / square,
                               normal / std::sqrt(square)});
        } else {
            const Eigen::Vector3d none = Eigen::Vector3d::Zero();
            prisms_.push_back({a, none, none, none});
        }
    }
    double largest = 0.0;
    for (const std::uint32_t triangle : from) {
        for (std::uint32_t i = first_[triangle]; i != kNone; i = points_[i].next) {
            std::uint32_t target = 0;
            const double distance = nearest(points_[i].position, to, target);
            assigned_.push_back({i, target});
            errors_[target] = std::max(errors_[target], distance);
            largest = std::max(largest, distance);
            if (largest > limit) return largest;
        }
    }
    return largest;
}

// If the point is above or below a target, its distance from the target's plane; otherwise from the nearest target.
double TrackedPoints::nearest(const Eigen::Vector3d& p, std::span<const Target> to,
                              std::uint32_t& target_out) const {
    double least = kInfinity;
    for (std::uint32_t i = 0; i < prisms_.size(); ++i) {
        const Prism& prism = prisms_[i];
        const Eigen::Vector3d from = p - prism.origin;
        const double second = dot(prism.to_second, from), third = dot(prism.to_third, from);
        if (!(second >= 0.0 && third >= 0.0 && second + third <= 1.0)) continue;
        const double distance = std::abs(dot(prism.normal, from));
        // a triangle without area has no plane
        if (!(distance < least) || dot(prism.normal, prism.normal) == 0.0) continue;
        least = distance;
        target_out = i;
    }
    if (least < kInfinity) return least;
    for (std::uint32_t i = 0; i < to.size(); ++i) {
        const double distance = distance_to_triangle(p, to[i].corners);
        if (!(distance < least)) continue;
        least = distance;
        target_out = i;
    }
    return least;
}

void TrackedPoints::commit() {
    for (const std::uint32_t triangle : from_) first_[triangle] = kNone;
    for (const std::uint32_t triangle : target_triangles_) {
        // triangles of later meshes may be new
        if (triangle >= first_.size()) first_.resize(triangle + std::size_t{1}, kNone);
    }
    for (const Assigned& assigned : assigned_) {
        std::uint32_t& first = first_[target_triangles_[assigned.target]];
        points_[assigned.point].next = first;
        first = assigned.point;
    }
}

}  // namespace terrane::internal
