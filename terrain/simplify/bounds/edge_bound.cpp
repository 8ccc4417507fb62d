// SPDX-License-Identifier: MIT
//
// A second certificate (contraction_bound.cpp has the first, and sources): for surfaces that no plane shows without
// folds, as thin bodies have them at their edges. The point with weights w of the corners of an old triangle at u
// maps to that with the same weights of the new one: it moves by w_u (v - u). Triangles of the edge map to the edges
// between v and their apexes, which new triangles have. The map is continuous and onto.
#include "base/vector_math.h"
#include "simplify/bounds/contraction_bound.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Height of a new triangle over its longest edge, unless one that goes is worse.
constexpr double kMinThinShape = 0.02;
constexpr double kMinThinShapeEver = 1e-5;
// Least cosine between a new triangle and the old one in its place.
constexpr double kMinTurnCosine = 0.2;

}  // namespace

bool ContractionBound::evaluate_along_edge(std::uint32_t u, const Ring& ring) {
    if (ring.count < 3) return false;
    for (std::size_t i = 0; i < ring.count; ++i)
        ring_[i] = vertices_[ring.vertices[i]] - vertices_[u];
    if (!do_not_turn(ring)) return false;
    const Eigen::Vector3d& to_target = ring_[0];
    const double moved = length(to_target) * (1.0 + 0x1p-44);
    error_ = 0.0;
    for (std::size_t k = 1; k + 1 < ring.count; ++k) {
        TriangleBound& bound = new_bounds_[k];
        bound = bounds_[ring.triangles[k]];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // From a new to an old point.
            const double step = -to_target[static_cast<Eigen::Index>(axis)] * (1.0 + 0x1p-44);
            bound.low[axis] += std::min(step, 0.0);
            bound.high[axis] += std::max(step, 0.0);
        }
        bound.constant = (bound.constant + moved) * (1.0 + 0x1p-44);
    }
    for (const std::size_t i : {std::size_t{0}, ring.count - 1}) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const double most = (bounds_[ring.triangles[i]].largest() + moved) * (1.0 + 0x1p-44);
        new_bounds_[i == 0 ? 1 : i - 1].include(most);
    }
    for (std::size_t k = 1; k + 1 < ring.count; ++k)
        error_ = std::max(error_, new_bounds_[k].largest());
    return true;
}

// No new triangle is turned over, lies on its neighbour, or is a sliver where none was.
bool ContractionBound::do_not_turn(const Ring& ring) const {
    const auto shape = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& normal) {
        const Eigen::Vector3d edge = b - a;
        return length(normal) / std::max({dot(a, a), dot(b, b), dot(edge, edge)});
    };
    double worst_old = kMinThinShape;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        const Eigen::Vector3d& b = ring_[i + 1 < ring.count ? i + 1 : 0];
        worst_old = std::min(worst_old, shape(ring_[i], b, cross(ring_[i], b)));
    }
    const double least = std::max(worst_old, kMinThinShapeEver);
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        const Eigen::Vector3d a = ring_[i] - ring_[0], b = ring_[i + 1] - ring_[0];
        const Eigen::Vector3d normal = cross(a, b), old_normal = cross(ring_[i], ring_[i + 1]);
        if (!(shape(a, b, normal) >= least)) return false;
        const double lengths = length(normal) * length(old_normal);
        if (!(dot(normal, old_normal) >= kMinTurnCosine * lengths)) return false;
        if (i > 1 && !(dot(normal, before) >= kFoldedCosine * length(normal) * length(before)))
            return false;
        before = normal;
    }
    return true;
}

}  // namespace terrane::internal
