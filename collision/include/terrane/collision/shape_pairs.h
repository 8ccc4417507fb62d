// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

// Queries of two shapes, a and b. Poses are world_from_shape; rotations must be orthonormal to 1e-6 and are
// orthonormalized. Results depend on the relative pose only: distances and depths have the same bits if the difference
// of the translations has.
//
// Accuracy, unless a function says otherwise: 1e-12 times the sum of the sizes of both shapes and the distance between
// their origins. Shapes closer than 1e-12 of their sizes touch.
//
// A compound is the union of its parts. Queries traverse a bounding volume tree, so that the cost depends only on the
// parts near the other shape.
//
// Threads:   any number at once
// Allocates: nothing
namespace terrane {

/// One point where two shapes touch or are closer than the margin.
struct PairContact {
    /// On a; the point on b is point_world + depth * normal.
    WorldPos point_world = WorldPos::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
    double depth = 0.0;        ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature_a;    ///< the corner, edge or face of a that touches
    ShapeFeature feature_b;    ///< the same of b
    std::uint32_t part_a = 0;  ///< index of a compound's part, else 0
    std::uint32_t part_b = 0;  ///< the same of b
};

/// Whether two shapes intersect; touching counts. Stops at the first proof.
TestAnswer test_contact(const Shape& a, const Pose& world_from_a, const Shape& b,
                        const Pose& world_from_b);

/// Status and count of find_contacts().
struct PairContactAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< truncated: the deepest were kept
    std::size_t count = 0;                      ///< written to contacts_out, deepest first
    /// If there are no contacts: a lower bound of the distance between the shapes, metres.
    double least_distance = 0.0;
};

/// Finds the contact manifolds of two shapes: at most four contacts per normal.
///
/// Two convex shapes have one normal, the direction of the minimum translation: moving shape a along it by the largest
/// depth separates them, and no shorter translation does. Compounds have up to 24 normals. For overlapping compounds,
/// contacts are found after a short separating translation of shape a, where the shapes just touch; each depth is the
/// component of that translation along the normal. Adjacent parts therefore produce no contacts along their seams. If
/// all contacts were written, the shortest translation with a component of at least `depth` along every normal
/// separates the shapes.
///
/// @param margin gaps up to this are contacts too, metres, >= 0
PairContactAnswer find_contacts(const Shape& a, const Pose& world_from_a, const Shape& b,
                                const Pose& world_from_b, double margin,
                                std::span<PairContact> contacts_out);

/// Signed distance of two shapes.
struct PairDistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double distance =
        0.0;  ///< signed, metres: the gap, or minus the length of the minimum translation
    WorldPos point_a_world = WorldPos::Zero();  ///< witness point: nearest (or deepest) on a
    WorldPos point_b_world = WorldPos::Zero();  ///< on b; distance = normal . (point_a - point_b)
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
    std::uint32_t part_a = 0;  ///< the part of point_a_world, for compounds
    std::uint32_t part_b = 0;  ///< the same of b
};

/// Signed distance of two shapes. A shape without thickness counts as the limit of ever thinner shapes.
///
/// If the shapes overlap, translating shape a by -distance * normal separates them. For convex shapes this is the
/// minimum translation. For compounds that overlap in more than one pair of parts it is the shortest found by a search
/// from 196 directions. No translation is shorter than the depth of the deepest pair, so one of that length is the
/// minimum. Parts that only touch leave a seam between them, through which a shape without thickness can separate.
///
/// Cost: for overlapping compounds, up to a few hundred times the cost of their overlapping pairs of parts
PairDistanceAnswer signed_distance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                   const Pose& world_from_b);

/// A cheap measure with the sign of the signed distance, metres.
///
/// Two spheres or capsules: (d^2 - R^2) / (2 R), or d if R is 0, with the distance d between their cores and the sum R
/// of their radii. Two boxes or hulls: the largest gap along the facet normals of their Minkowski difference (face
/// normals, cross products of edges that form a facet); at most the signed distance, and equal to it for overlapping
/// shapes. A sphere or capsule and a box or hull: the signed distance.
///
/// Compounds: the minimum over the pairs of parts, where each pair counts as at least the gap between the bounding
/// boxes of its parts.
PseudodistanceAnswer pseudodistance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                    const Pose& world_from_b);

/// The first contact of a cast.
struct PairCastAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether the shapes touch during the motions
    double fraction = 1.0;                      ///< of both motions; no overlap before it
    bool started_in_contact = false;            ///< touching or overlapping at t = 0
    std::size_t count = 0;                      ///< of contacts at `fraction`, deepest first
    std::array<PairContact, 4> contacts;        ///< for compounds, the deepest
};

/// Finds the first contact of two translating and rotating shapes (time of impact). At a hit the distance is between 0
/// and the tolerance; a pass within the tolerance may be reported as a hit. Parts of a compound rotate about the body's
/// origin; `skip_separating` applies to each pair of parts separately.
///
/// Cost: a few signed distances; more for near misses of spinning shapes
PairCastAnswer cast(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
                    const CastSettings& settings = {});

/// First hit of a ray.
struct ShapeRayAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether the shape is hit
    double fraction = 1.0;                      ///< of the segment; 0 if `from` is inside
    WorldPos point_world = WorldPos::Zero();    ///< the point hit
    /// Unit, out of the shape at the hit; opposite to the ray if `from` is inside.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< of a compound: the part hit first
};

/// First point of the segment `from` to `to` that is inside or on a shape.
ShapeRayAnswer cast_ray(const Shape& shape, const Pose& world_from_shape, const WorldPos& from,
                        const WorldPos& to);

}  // namespace terrane
