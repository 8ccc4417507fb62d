// SPDX-License-Identifier: MIT
//
// Source: C. Ericson. Real-Time Collision Detection. 2005, 5.1.5, as the nearest of plane and edges.
#include "support/meshes/mesh_distance.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::test {
namespace {

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b) {
    const Eigen::Vector3d along = b - a;
    const double square = along.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - a).dot(along) / square, 0.0, 1.0) : 0.0;
    return (p - a - t * along).norm();
}

double farthest(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& from,
                const MeshTriangles& to, int per_edge) {
    // The largest of the smallest: a sample is done with as soon as a triangle is nearer than the largest so far.
    double largest = 0.0;
    for (const auto& t : from) {
        std::size_t last = 0;
        for (int i = 0; i <= per_edge; ++i) {
            for (int j = 0; i + j <= per_edge; ++j) {
                const double u = static_cast<double>(i) / per_edge,
                             v = static_cast<double>(j) / per_edge;
                const Eigen::Vector3d p = vertices[t[0]] + u * (vertices[t[1]] - vertices[t[0]]) +
                                          v * (vertices[t[2]] - vertices[t[0]]);
                double smallest = std::numeric_limits<double>::infinity();
                for (std::size_t k = 0; k < to.size() && smallest > largest; ++k) {
                    // Begins at the triangle that decided the sample before.
                    const std::size_t index = (last + k) % to.size();
                    const auto& o = to[index];
                    const double distance =
                        distance_to_triangle(p, vertices[o[0]], vertices[o[1]], vertices[o[2]]);
                    if (distance >= smallest) continue;
                    smallest = distance;
                    if (smallest <= largest) last = index;
                }
                largest = std::max(largest, smallest);
            }
        }
    }
    return largest;
}

}  // namespace

double distance_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                            const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const double edges = std::min(
        {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double doubled = normal.norm();
    // the normal of a needle is rounding
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (!(doubled > 1e-9 * longest)) return edges;
    const bool is_over = normal.dot((b - a).cross(p - a)) >= 0.0 &&
                         normal.dot((c - b).cross(p - b)) >= 0.0 &&
                         normal.dot((a - c).cross(p - c)) >= 0.0;
    return is_over ? std::abs(normal.dot(p - a)) / doubled : edges;
}

double measured_distance(std::span<const Eigen::Vector3d> vertices, const MeshTriangles& a,
                         const MeshTriangles& b, int per_edge) {
    return std::max(farthest(vertices, a, b, per_edge), farthest(vertices, b, a, per_edge));
}

}  // namespace terrane::test
