// SPDX-License-Identifier: MIT
//
// The lift of a sphere or capsule over a face is that of its support point against the face's normal, where this point
// lies over the face; else it is on the face's rim: over an edge, in whose vertical plane the section of the shape is a
// moving disc, or over a corner. The plane of the face bounds all of these from above.
#include "ground/column/round_column.h"

#include "base/vector_math.h"
#include "ground/frame/triangle_plane.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// The s in [-1, 1] that maximises linear * s + reach * sqrt(square - (offset + rate * s)^2), among those for which the
// root is real. False where there is none.
bool find_round_maximum(double linear, double reach, double square, double offset, double rate,
                        double& s_out) {
    if (square < 0.0) return false;
    double first = -1.0;
    double last = 1.0;
    if (rate == 0.0) {
        if (offset * offset > square) return false;
        s_out = linear > 0.0 ? 1.0 : (linear < 0.0 ? -1.0 : 0.0);
        return true;
    }
    const double root = std::sqrt(square);
    first = std::max(first, std::min((-root - offset) / rate, (root - offset) / rate));
    last = std::min(last, std::max((-root - offset) / rate, (root - offset) / rate));
    if (first > last) return false;
    // With d = offset + rate s: maximise (linear / rate) d + reach sqrt(square - d^2).
    const double along = linear / rate;
    const double size = std::sqrt(along * along + reach * reach);
    const double d = size > 0.0 ? root * (along / size) : 0.0;
    s_out = std::clamp((d - offset) / rate, first, last);
    return true;
}

// Lift over the vertical plane through an edge that starts at `a`. `end_out` is -1 or 1 where the maximum is beyond the
// first or second end of the edge, else 0.
double lift_over_edge(const LocalShape& shape, const Eigen::Vector3d& a,
                      const Eigen::Vector3d& edge, int& end_out) {
    const double run = std::sqrt(edge[0] * edge[0] + edge[1] * edge[1]);
    const Eigen::Vector3d along(edge[0] / run, edge[1] / run, 0.0);
    const Eigen::Vector3d out(along[1], -along[0], 0.0);
    const Eigen::Vector3d from = shape.centre - a;
    // The section with that plane: discs whose centres move with s.
    const double grade = edge[2] / run;
    const double distance = dot(out, from);
    const double rate = dot(out, shape.core);
    const double rise = grade * dot(along, shape.core) - shape.core[2];
    const double reach = std::sqrt(grade * grade + 1.0);
    const double square = shape.radius * shape.radius;
    double s = 0.0;
    end_out = 0;
    if (!find_round_maximum(rise, reach, square, distance, rate, s)) return -kInfinity;
    const double d = distance + rate * s;
    const double r = std::sqrt(std::max(0.0, square - d * d));
    const double u = dot(along, from) + s * dot(along, shape.core) + r * grade / reach;
    if (u < 0.0) end_out = -1;
    if (u > run) end_out = 1;
    return grade * u - (from[2] + s * shape.core[2] - r / reach);
}

// Lift over a corner of the ground.
double lift_over_corner(const LocalShape& shape, const Eigen::Vector3d& corner) {
    const Eigen::Vector3d from = shape.centre - corner;
    const double square = shape.radius * shape.radius;
    const double core_run =
        std::sqrt(shape.core[0] * shape.core[0] + shape.core[1] * shape.core[1]);
    double across = 0.0;
    double offset = 0.0;
    if (core_run > 0.0) {
        across = (from[0] * shape.core[1] - from[1] * shape.core[0]) / core_run;
        offset = (from[0] * shape.core[0] + from[1] * shape.core[1]) / core_run;
    } else {
        across = std::sqrt(from[0] * from[0] + from[1] * from[1]);
    }
    double s = 0.0;
    if (!find_round_maximum(-shape.core[2], 1.0, square - across * across, offset, core_run, s)) {
        return -kInfinity;
    }
    const double d = offset + core_run * s;
    const double r = std::sqrt(std::max(0.0, square - across * across - d * d));
    return -(from[2] + s * shape.core[2] - r);
}

}  // namespace

double lift_over_rim(const LocalShape& shape, const std::array<Eigen::Vector3d, 3>& corners,
                     const Eigen::Vector3d& most) {
    double lift = -kInfinity;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d& a = corners[i];
        const Eigen::Vector3d& b = corners[(i + 1) % 3];
        const Eigen::Vector3d edge = b - a;
        // Only where the point is inside by more than rounding.
        const double slack = 1e-9 * (edge[0] * edge[0] + edge[1] * edge[1]);
        if (left_of(a, b, most) > slack) continue;
        int end = 0;
        const double over_edge = lift_over_edge(shape, a, edge, end);
        lift = std::max(lift, end == 0 ? over_edge : lift_over_corner(shape, end < 0 ? a : b));
    }
    return lift;
}

double compute_round_lift(const LocalShape& shape, const Triangle& triangle) {
    const TrianglePlane plane(triangle);
    double lift = -kInfinity;
    double highest = -kInfinity;
    Eigen::Vector3d most = shape.centre;
    for (const double s : {-1.0, 1.0}) {
        const Eigen::Vector3d lowest =
            shape.centre + s * shape.core - shape.radius * triangle.normal;
        const double above = plane.above(lowest);
        if (above > highest) {
            highest = above;
            most = lowest;
        }
        if (above > lift && is_over(lowest, triangle)) lift = above;
    }
    return lift < highest ? std::max(lift, lift_over_rim(shape, triangle.v, most)) : lift;
}

}  // namespace terrane::internal
