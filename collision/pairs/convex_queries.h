// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"
#include "pairs/kernels/manifold.h"
#include "pairs/kernels/separating_axis.h"

#include <terrane/collision/shape_pairs.h>

#include <variant>

// The questions about any two convex shapes: each finds the pair that knows. shape_pairs.h has the
// contracts; questions about compounds choose pairs of parts on top of this.
namespace terrane::internal {

/// A hull that somebody else keeps.
struct HullView {
    Polyhedron shape;
    double reach = 0.0;  ///< largest distance of a vertex from the body frame's origin, metres
};

using ConvexView = std::variant<Sphere, Capsule, Box, HullView>;
using Placed = std::variant<PlacedSphere, PlacedCapsule, PlacedBox, PlacedHull>;

/// @param rotation orthonormal
Placed place(const ConvexView& shape, const Eigen::Matrix3d& rotation,
             const Eigen::Vector3d& centre);
double reach_of(const ConvexView& shape);  ///< bounding radius, metres

Gap find_gap(const Placed& a, const Placed& b);
bool is_touching(const Placed& a, const Placed& b);
Axis find_pseudodistance(const Placed& a, const Placed& b);
/// Points are in the frame of a and b; `gap` is theirs.
std::size_t find_contacts(const Placed& a, const Placed& b, const Gap& gap, double margin,
                          std::array<PairContact, 4>& contacts_out);
/// Nearest points on the surfaces, or the deepest of crossing shapes.
void find_witnesses(const Placed& a, const Placed& b, const Gap& gap, Eigen::Vector3d& on_a_out,
                    Eigen::Vector3d& on_b_out);

/// A convex shape that turns about the origin of its body, or is a body.
struct MovingPart {
    const ConvexView& shape;
    const Pose* body_from_part = nullptr;  ///< none: the body's frame is the shape's
    const Motion& motion;                  ///< of the body; start.rotation is orthonormal
};

struct ConvexCast {
    bool hit = false;
    double fraction = 1.0;
    bool started_in_contact = false;
    std::size_t count = 0;
    std::array<PairContact, 4> contacts;  ///< from the place of body a at `fraction`, world axes
};
/// From the time `from` of both motions to `to`; a miss has the fraction `to`.
ConvexCast cast_convex(const MovingPart& a, const MovingPart& b, double from, double to,
                       const CastSettings& settings);

struct ConvexRay {
    bool hit = false;
    double fraction = 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};
/// From `from` along `way`, in the frame of the shape's placement.
ConvexRay cast_ray(const Placed& shape, const Eigen::Vector3d& from, const Eigen::Vector3d& way);

}  // namespace terrane::internal
