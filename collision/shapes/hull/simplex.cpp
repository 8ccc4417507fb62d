// SPDX-License-Identifier: MIT
// Sources: A. M. Andrew. Another efficient algorithm for convex hulls in two dimensions. Information
//          Processing Letters 1979 (make_flat_faces).
#include "shapes/hull/simplex.h"

#include "base/vector_math.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace terrane::internal {
namespace {

struct Farthest {
    std::uint32_t point = 0;
    double distance = -1.0;
};

// The first point with the largest `measure`.
template <class Measure>
Farthest find_farthest(std::span<const std::uint32_t> chosen, Measure measure) {
    Farthest best;
    for (const std::uint32_t point : chosen) {
        const double distance = measure(point);
        if (distance > best.distance) best = {point, distance};
    }
    return best;
}

}  // namespace

Simplex find_simplex(const std::vector<LatticePoint>& points, std::span<const std::uint32_t> chosen,
                     double tolerance) {
    Simplex simplex;
    auto& corners = simplex.corners;
    const auto from = [&](std::uint32_t origin) {
        return
            [&, origin](std::uint32_t p) { return length(difference(points[origin], points[p])); };
    };
    corners[0] = find_farthest(chosen, from(chosen[0])).point;
    const Farthest second = find_farthest(chosen, from(corners[0]));
    corners[1] = second.point;
    simplex.thickness = second.distance;
    if (second.distance <= tolerance) return simplex;

    simplex.dimension = 1;
    const LatticePoint& origin = points[corners[0]];
    const Eigen::Vector3d line = difference(origin, points[corners[1]]) / second.distance;
    const Farthest third = find_farthest(chosen, [&](std::uint32_t p) {
        return length(cross(line, difference(origin, points[p])));
    });
    corners[2] = third.point;
    simplex.thickness = third.distance;
    if (third.distance <= tolerance) return simplex;

    simplex.dimension = 2;
    Eigen::Vector3d normal = triangle_normal(origin, points[corners[1]], points[corners[2]]);
    normal /= length(normal);
    const Farthest fourth = find_farthest(chosen, [&](std::uint32_t p) {
        return std::abs(dot(normal, difference(origin, points[p])));
    });
    corners[3] = fourth.point;
    simplex.thickness = fourth.distance;
    if (fourth.distance > tolerance) simplex.dimension = 3;
    return simplex;
}

std::vector<HullFace> make_flat_faces(const std::vector<LatticePoint>& points,
                                      std::span<const std::uint32_t> chosen,
                                      const Simplex& simplex) {
    const auto& corners = simplex.corners;
    Eigen::Vector3d normal =
        triangle_normal(points[corners[0]], points[corners[1]], points[corners[2]]);
    normal /= length(normal);
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (std::abs(normal[i]) > std::abs(normal[axis])) axis = i;
    }
    if (normal[axis] < 0.0) normal = -normal;

    const auto u = static_cast<std::size_t>((axis + 1) % 3);
    const auto v = static_cast<std::size_t>((axis + 2) % 3);
    std::vector<std::uint32_t> sorted(chosen.begin(), chosen.end());
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
        const LatticePoint& p = points[a];
        const LatticePoint& q = points[b];
        return p[u] != q[u] ? p[u] < q[u] : p[v] < q[v];
    });
    std::vector<std::uint32_t> loop;
    const auto walk = [&](std::uint32_t point, std::size_t first) {
        while (loop.size() >= first + 2 &&
               turn(points[loop[loop.size() - 2]], points[loop.back()], points[point], axis) <= 0) {
            loop.pop_back();
        }
        loop.push_back(point);
    };
    for (const std::uint32_t point : sorted) walk(point, 0);  // along the lower side
    const std::size_t upper = loop.size() - 1;
    for (std::size_t i = sorted.size() - 1; i-- > 0;) walk(sorted[i], upper);  // and back
    loop.pop_back();
    if (loop.size() < 3) return {};
    std::vector<HullFace> faces{{normal, loop}, {-normal, loop}};
    std::reverse(faces[1].loop.begin(), faces[1].loop.end());
    return faces;
}

}  // namespace terrane::internal
