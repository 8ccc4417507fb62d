// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"
#include "pairs/kernels/manifold.h"
#include "pairs/kernels/separating_axis.h"

#include <terrane/collision/shape_pairs.h>

#include <variant>

// Queries of two convex shapes, dispatched to the function of their pair. shape_pairs.h has the contracts; queries of
// compounds call these for pairs of parts.
namespace terrane::internal {

/// A non-owning view of a convex hull.
struct HullView {
    Polyhedron shape;
    double reach = 0.0;  ///< bounding radius about the body frame's origin, metres
};

using ConvexView = std::variant<Sphere, Capsule, Box, HullView>;
using PlacedConvex = std::variant<PlacedSphere, PlacedCapsule, PlacedBox, PlacedHull>;

/// @param rotation orthonormal
PlacedConvex place(const ConvexView& shape, const Eigen::Matrix3d& rotation,
                   const Eigen::Vector3d& centre);
double reach_of(const ConvexView& shape);  ///< bounding radius, metres

Gap find_gap(const PlacedConvex& a, const PlacedConvex& b);
bool is_touching(const PlacedConvex& a, const PlacedConvex& b);
Axis find_pseudodistance(const PlacedConvex& a, const PlacedConvex& b);
/// @param gap find_gap(a, b)
std::size_t find_contacts(const PlacedConvex& a, const PlacedConvex& b, const Gap& gap,
                          double margin, std::array<PairContact, 4>& contacts_out);
/// Witness points: nearest points on the surfaces, or the deepest where the shapes overlap.
void find_witnesses(const PlacedConvex& a, const PlacedConvex& b, const Gap& gap,
                    Eigen::Vector3d& on_a_out, Eigen::Vector3d& on_b_out);

/// A convex part of a moving body.
struct MovingPart {
    const ConvexView& shape;
    const Pose* body_from_part = nullptr;  ///< null: identity
    const Motion& motion;                  ///< of the body; start.rotation is orthonormal
};

struct ConvexCast {
    bool hit = false;
    double fraction = 1.0;
    bool started_in_contact = false;
    std::size_t count = 0;
    std::array<PairContact, 4>
        contacts;  ///< points relative to body a's origin at `fraction`, world axes
};
/// Casts over the times `from` to `to` of both motions; a miss has the fraction `to`.
ConvexCast cast_convex(const MovingPart& a, const MovingPart& b, double from, double to,
                       const CastSettings& settings);

struct ConvexRay {
    bool hit = false;
    double fraction = 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};
/// First point of the segment `from` to `from + displacement` in a shape; all in one frame.
ConvexRay cast_ray(const PlacedConvex& shape, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& displacement);

}  // namespace terrane::internal
