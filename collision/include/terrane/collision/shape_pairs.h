// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/compound.h>
#include <terrane/collision/ground_cast.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

// Questions about two shapes, a and b. Poses are read as world_from_shape; rotations must be orthonormal to
// 1e-6 and are made so exactly. All that counts is relative: far from the origin, distances and depths
// have the same bits wherever a difference of two translations has.
//
// Accuracy, but where a function says otherwise: 1e-12 of the sizes of both shapes and the distance
// between their origins. Within 1e-12 of the sizes they touch.
//
// Threads:   any number at once
// Allocates: nothing
namespace terrane {

/// Names a vertex (i, i), an edge (i, j) with i < j, or a face (i, kFace) of a shape; the same one from
/// call to call. Vertex i of a box lies at +x where bit 0 of i is set, else at -x; bit 1 is y, bit 2 is z;
/// its faces are -x, +x, -y, +y, -z, +z. Vertices of a hull are those of vertices(). The ends of a
/// capsule's core are vertices 0 (at -z) and 1; a sphere is vertex 0.
struct ShapeFeature {
    static constexpr std::uint32_t kFace = ~std::uint32_t{0};

    std::uint32_t first = 0;
    std::uint32_t second = 0;
    bool operator==(const ShapeFeature&) const = default;
};

/// One point where two shapes touch or are closer than the margin.
struct PairContact {
    WorldPos point_world = WorldPos::Zero();  ///< on a; `depth` along `normal` from it lies b's
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
    double depth = 0.0;  ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature_a;
    ShapeFeature feature_b;
};

struct PairTestAnswer {
    ContactStatus status = ContactStatus::invalid;
    bool is_touching = false;
};

/// Whether two shapes meet; touching counts. Stops as soon as anything decides.
PairTestAnswer test_contact(const ConvexShape& a, const Pose& world_from_a, const ConvexShape& b,
                            const Pose& world_from_b);

struct PairContactAnswer {
    ContactStatus status = ContactStatus::invalid;
    std::size_t count = 0;  ///< written to contacts_out, deepest first
};

/// Finds where two shapes touch: at most four contacts of one normal, which stand for all of them.
/// Moving a along the normal by the deepest one's depth parts the shapes, and no shorter move does.
///
/// @param margin also report gaps up to this, metres, >= 0
PairContactAnswer find_contacts(const ConvexShape& a, const Pose& world_from_a,
                                const ConvexShape& b, const Pose& world_from_b, double margin,
                                std::span<PairContact> contacts_out);

struct PairDistanceAnswer {
    ContactStatus status = ContactStatus::invalid;
    double distance = 0.0;  ///< signed: the gap; or minus the shortest translation that parts
    WorldPos point_a_world = WorldPos::Zero();  ///< nearest (or deepest) on a
    WorldPos point_b_world = WorldPos::Zero();  ///< on b; distance = normal . (point_a - point_b)
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
};

/// Signed distance of two shapes. Shapes without thickness overlap like the limit of thin ones.
PairDistanceAnswer signed_distance(const ConvexShape& a, const Pose& world_from_a,
                                   const ConvexShape& b, const Pose& world_from_b);

struct PseudodistanceAnswer {
    ContactStatus status = ContactStatus::invalid;
    double pseudodistance = 0.0;                        ///< metres
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< out of b: moving a along it adds to it
};

/// A cheap measure with the sign of the signed distance, in metres.
///
/// Two spheres or capsules with the distance d of their cores and the sum R of their radii:
/// (d^2 - R^2) / (2 R), or d where R is 0. Two boxes or hulls: the largest gap over the facets of their
/// Minkowski difference (normals of faces, crosses of edges that can meet): at most the distance,
/// minus the depth overlapping. A sphere or capsule and a box or hull: the signed distance.
PseudodistanceAnswer pseudodistance(const ConvexShape& a, const Pose& world_from_a,
                                    const ConvexShape& b, const Pose& world_from_b);

struct PairCastAnswer {
    ContactStatus status = ContactStatus::invalid;
    bool hit = false;
    double fraction = 1.0;            ///< of both motions; up to it the shapes do not overlap
    bool started_in_contact = false;  ///< touch or overlap at t = 0: fraction is 0
    std::size_t count = 0;            ///< of contacts at `fraction`, deepest first
    std::array<PairContact, 4> contacts;
};

/// First time of contact of two moving, turning shapes. At a hit the distance is between 0 and the
/// tolerance; a pass within the tolerance may be reported as a hit.
///
/// Cost: a few distances; more where they pass each other close by while spinning
PairCastAnswer cast(const ConvexShape& a, const Motion& motion_a, const ConvexShape& b,
                    const Motion& motion_b, const CastSettings& settings = {});

struct ShapeRayAnswer {
    ContactStatus status = ContactStatus::invalid;
    bool hit = false;
    double fraction = 1.0;  ///< of the way from `from` to `to`; 0 from within
    WorldPos point_world = WorldPos::Zero();
    /// Out of the shape at the point; from within, against the ray.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

/// First point of a shape on the way between two points; touching counts.
ShapeRayAnswer cast_ray(const ConvexShape& shape, const Pose& world_from_shape,
                        const WorldPos& from, const WorldPos& to);

}  // namespace terrane
