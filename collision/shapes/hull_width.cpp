// SPDX-License-Identifier: MIT
// Sources: M. E. Houle, G. T. Toussaint. Computing the width of a set. IEEE Trans. Pattern Analysis and
//          Machine Intelligence 1988.
// Deviations: antipodal pairs of edges are found by bisection: while a direction rotates over an edge from one of its
//             faces to the other, the opposite support vertex changes at each antipodal edge.
#include "base/vector_math.h"
#include "shapes/hull_data.h"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace terrane::internal {
namespace {

double extent_along(const Polyhedron& hull, const Eigen::Vector3d& direction) {
    const double size = length(direction);
    if (!(size > 0.0)) return kInfinity;
    const Eigen::Vector3d unit = direction / size;
    const double high = dot(unit, hull.vertices[find_extreme(hull, unit)]);
    const double low = dot(unit, hull.vertices[find_extreme(hull, -unit)]);
    return high - low;
}

// The directions begin + t turn over an edge, t in [0, 1].
struct Arc {
    const Polyhedron& hull;
    std::uint32_t highest;  // a vertex of the edge
    Eigen::Vector3d begin;
    Eigen::Vector3d turn;

    Eigen::Vector3d at(double t) const { return begin + t * turn; }
    // At most the extent, because the directions are at most unit vectors.
    double depth(std::uint32_t vertex, double t) const {
        return dot(at(t), hull.vertices[highest] - hull.vertices[vertex]);
    }

    // The smaller of `width` and the least extent where the lowest vertex changes between two parameters.
    double least(double from, std::uint32_t low_from, double to, std::uint32_t low_to,
                 double width) const {
        if (low_from == low_to) return width;
        const double bound = std::max(std::min(depth(low_from, from), depth(low_from, to)),
                                      std::min(depth(low_to, from), depth(low_to, to)));
        if (bound >= width * (1.0 - 1e-12)) return width;
        const Eigen::Vector3d between = hull.vertices[low_to] - hull.vertices[low_from];
        const double t = -dot(begin, between) / dot(turn, between);  // both are equally low
        if (!(t > from && t < to)) return width;
        const std::uint32_t low = find_extreme(hull, -at(t));
        if (low == low_from || low == low_to || depth(low, t) <= depth(low_from, t)) {
            return std::min(width, extent_along(hull, at(t)));
        }
        return least(t, low, to, low_to, least(from, low_from, t, low, width));
    }
};

}  // namespace

double compute_width(const Polyhedron& hull) {
    if (hull.faces.size() <= 2) return 0.0;
    double width = kInfinity;
    std::vector<std::uint32_t> below;  // [faces] vertex farthest below
    for (const Polyhedron::Face& face : hull.faces) {
        below.push_back(find_extreme(hull, -face.normal));
        width = std::min(width, face.offset - dot(face.normal, hull.vertices[below.back()]));
    }
    for (const Polyhedron::Edge& edge : hull.edges) {
        const Eigen::Vector3d begin = hull.faces[edge.left].normal;
        const Arc arc{hull, edge.from, begin, hull.faces[edge.right].normal - begin};
        width = arc.least(0.0, below[edge.left], 1.0, below[edge.right], width);
    }
    return std::max(width, 0.0);
}

}  // namespace terrane::internal
