// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/convex_core.h"
#include "pairs/manifold.h"

#include <terrane/collision/shape_pairs.h>

#include <variant>

// Queries of any two cores by GJK and the separating axis search. Pairs with a closed form do not use them.
namespace terrane::internal {

/// Signature of find_separating_axis(); two boxes have a faster implementation.
using AxisFinder = Axis (*)(const Core& a, const Core& b, double enough);

Gap find_core_gap(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// Whether the gap is at most touch_of(a, b); cheaper than find_core_gap().
bool is_core_touching(const Core& a, const Core& b, AxisFinder find_axis = find_separating_axis);

/// Pseudodistance of two polyhedra, without radii.
Axis find_polyhedra_pseudodistance(const Core& a, const Core& b,
                                   AxisFinder find_axis = find_separating_axis);

// Every pair of convex shapes has these four functions. a comes before b in the order sphere, capsule, box, hull.
//
//   find_gap             signed distance, normal, nearest points
//   find_contacts        adds contacts to a manifold with the gap's normal
//   is_touching          whether the gap is at most `touch_of`, at lower cost
//   find_pseudodistance  see shape_pairs.h

#define TERRANE_PAIR(A, B)                                                          \
    Gap find_gap(const A& a, const B& b);                                           \
    void find_contacts(const A& a, const B& b, const Gap& gap, Manifold& manifold); \
    bool is_touching(const A& a, const B& b);                                       \
    Axis find_pseudodistance(const A& a, const B& b);

TERRANE_PAIR(PlacedSphere, PlacedSphere)
TERRANE_PAIR(PlacedSphere, PlacedCapsule)
TERRANE_PAIR(PlacedSphere, PlacedBox)
TERRANE_PAIR(PlacedSphere, PlacedHull)
TERRANE_PAIR(PlacedCapsule, PlacedCapsule)
TERRANE_PAIR(PlacedCapsule, PlacedBox)
TERRANE_PAIR(PlacedCapsule, PlacedHull)
TERRANE_PAIR(PlacedBox, PlacedBox)
TERRANE_PAIR(PlacedBox, PlacedHull)
TERRANE_PAIR(PlacedHull, PlacedHull)

#undef TERRANE_PAIR

/// Pseudodistance of two sphere-swept cores: (d^2 - R^2) / (2 R), with the distance d of the cores and the sum R of the
/// radii, or d if R is 0.
inline double swept_pseudodistance(double core_distance, double radii) {
    if (radii == 0.0) return core_distance;
    return (core_distance - radii) * ((core_distance + radii) / (2.0 * radii));
}

// Queries of two convex shapes, dispatched by the types of the pair. shape_pairs.h has the contracts; queries of
// compounds call these functions for pairs of parts.

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
/// Witness points: the nearest points on the surfaces, or the deepest ones if the shapes overlap.
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
/// First point of the segment `from` to `from + displacement` inside or on a shape; all in one frame.
ConvexRay cast_ray(const PlacedConvex& shape, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& displacement);

}  // namespace terrane::internal
