// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/motion.h>
#include <terrane/collision/query_status.h>
#include <terrane/collision/shape_feature.h>
#include <terrane/collision/shapes.h>

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
// A compound is the union of its parts. Its parts are found through a tree of their bounds: a question
// costs what the parts near the other shape cost, not what all of them do.
//
// Threads:   any number at once
// Allocates: nothing
namespace terrane {

/// One point where two shapes touch or are closer than the margin.
struct PairContact {
    WorldPos point_world = WorldPos::Zero();  ///< on a; `depth` along `normal` from it lies b's
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
    double depth = 0.0;  ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature_a;
    ShapeFeature feature_b;
    std::uint32_t part_a = 0;  ///< of a compound
    std::uint32_t part_b = 0;
};

/// Whether two shapes meet; touching counts. Stops as soon as anything decides.
TestAnswer test_contact(const Shape& a, const Pose& world_from_a, const Shape& b,
                        const Pose& world_from_b);

struct PairContactAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< truncated: the deepest were kept
    std::size_t count = 0;                          ///< written to contacts_out, deepest first
};

/// Finds where two shapes touch: at most four contacts of one normal, which stand for all of them.
///
/// Two convex shapes have one normal: moving a along it by the deepest one's depth parts them, and no
/// shorter move does. Compounds have up to 24. They are looked at where they would just touch if a had been
/// moved out by a short way; the depths are what of the way lies along each normal. So parts side by
/// side do not push along their seams, and, where all were written, moving a by the shortest way that is at
/// least `depth` long along every normal parts the shapes.
///
/// @param margin also report gaps up to this, metres, >= 0
PairContactAnswer find_contacts(const Shape& a, const Pose& world_from_a, const Shape& b,
                                const Pose& world_from_b, double margin,
                                std::span<PairContact> contacts_out);

struct PairDistanceAnswer {
    QueryStatus status = QueryStatus::invalid;
    double distance = 0.0;  ///< signed: the gap; or minus the shortest translation that parts
    WorldPos point_a_world = WorldPos::Zero();  ///< nearest (or deepest) on a
    WorldPos point_b_world = WorldPos::Zero();  ///< on b; distance = normal . (point_a - point_b)
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, out of b, towards a
    std::uint32_t part_a = 0;                           ///< of a compound: the part of the point
    std::uint32_t part_b = 0;
};

/// Signed distance of two shapes. Shapes without thickness overlap like the limit of thin ones.
///
/// Moving a along the normal by minus a negative distance always parts the shapes. For convex shapes
/// no shorter move in any direction does. Compounds that overlap in more than one pair of parts have no
/// such bound but the deepest pair's own depth: the move is the shortest of a search from 52
/// directions, exact where it meets that bound. Parts that only touch leave a seam, into which what has
/// no thickness can part.
///
/// Cost: of overlapping compounds up to some hundred times that of the pairs of parts that overlap
PairDistanceAnswer signed_distance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                   const Pose& world_from_b);

/// A cheap measure with the sign of the signed distance, in metres.
///
/// Two spheres or capsules with the distance d of their cores and the sum R of their radii:
/// (d^2 - R^2) / (2 R), or d where R is 0. Two boxes or hulls: the largest gap over the facets of their
/// Minkowski difference (normals of faces, crosses of edges that can meet): at most the distance,
/// minus the depth overlapping. A sphere or capsule and a box or hull: the signed distance.
///
/// Compounds: the least over the pairs of parts, where a pair counts with no less than the gap between the
/// boxes around the parts.
PseudodistanceAnswer pseudodistance(const Shape& a, const Pose& world_from_a, const Shape& b,
                                    const Pose& world_from_b);

struct PairCastAnswer {
    QueryStatus status = QueryStatus::invalid;
    bool hit = false;
    double fraction = 1.0;                ///< of both motions; up to it the shapes do not overlap
    bool started_in_contact = false;      ///< touch or overlap at t = 0: fraction is 0
    std::size_t count = 0;                ///< of contacts at `fraction`, deepest first
    std::array<PairContact, 4> contacts;  ///< of compounds the deepest
};

/// First time of contact of two moving, turning shapes. At a hit the distance is between 0 and the
/// tolerance; a pass within the tolerance may be reported as a hit. Parts of a compound turn about the
/// body's origin, and each pair of them passes over its own contacts where `skip_separating` is set.
///
/// Cost: a few distances; more where they pass each other close by while spinning
PairCastAnswer cast(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
                    const CastSettings& settings = {});

struct ShapeRayAnswer {
    QueryStatus status = QueryStatus::invalid;
    bool hit = false;
    double fraction = 1.0;  ///< of the way from `from` to `to`; 0 from within
    WorldPos point_world = WorldPos::Zero();
    /// Out of the shape at the point; from within, against the ray.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    std::uint32_t part = 0;  ///< of a compound: the one that is met first
};

/// First point of a shape on the way between two points; touching counts.
ShapeRayAnswer cast_ray(const Shape& shape, const Pose& world_from_shape, const WorldPos& from,
                        const WorldPos& to);

}  // namespace terrane
