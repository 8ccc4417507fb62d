// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/query_status.h>
#include <terrane/collision/shape_feature.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <span>

namespace terrane {

/// One point where a shape touches the ground, or is closer to it than the margin.
struct Contact {
    WorldPos point_world = WorldPos::Zero();  ///< on the shape, its deepest there
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground, in its normal cone
    double depth = 0.0;            ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature;          ///< of the shape, or of its part: what `point_world` lies on
    std::uint32_t part = 0;        ///< of a compound
};

/// What find_contacts() found beside the contacts.
struct ContactAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    std::size_t count = 0;  ///< written to contacts_out, deepest first
    double lift = 0.0;     ///< largest of surface minus z over the shape where they overlap; moving
                           ///< up by it always frees the shape; <= 0 apart
    double error_m = 0.0;  ///< largest bound of the cells that were looked at
};

/// Finds where a shape touches the ground.
///
/// The ground is the solid {z <= contact surface}: one-sided, a shape entirely below is pushed up. On
/// flat and concave edges contacts have a face's normal, on convex ones a normal between the two
/// faces'. The shape is freed by moving along the normals by the depths (verified: lift <= 1e-9).
///
/// @param world_from_shape pose; the rotation must be orthonormal to 1e-6
/// @param margin           also report gaps up to this, metres, >= 0
/// @param contacts_out     caller's buffer; at most 4 points a patch of one normal are written
///
/// Threads:   any number at once
/// Allocates: nothing
ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out);

/// Signed distance of a shape from the ground.
struct DistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool has_ground = false;  ///< false where there is no ground within max_distance
    double distance =
        0.0;  ///< metres; apart: the gap. Overlapping: minus the length of a translation that frees
    double distance_lower_bound = 0.0;        ///< metres, certified: see signed_distance()
    WorldPos point_world = WorldPos::Zero();  ///< nearest (or deepest) point on the shape
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground; the translation's direction
    double error_m = 0.0;          ///< largest bound of the cells that were looked at
};

/// Signed distance of a shape from the ground.
///
/// Apart: the Euclidean gap. Overlapping: minus the length of the shortest translation, in any direction, after which
/// the interiors of the shape and of the solid {z <= contact surface} are disjoint; `-distance * normal` is one such
/// translation. Where the ground ends (border, nodata) there is nothing beside it: moving out over the border frees.
///
/// `distance_lower_bound` limits the same length from below: no translation shorter than it frees the shape, and
/// 0 <= distance_lower_bound <= |distance|. Apart it is the gap.
///
/// Boundary:  touching is 0; lifts up to 1e-10 m count as free, so that an overlap below that is a gap of 0. Shapes
///            without volume (a flat hull, a sphere of radius 0) have the same definition.
/// Accuracy:  1e-9 m apart. Overlapping, the answer always frees: the lift after it is at most 1e-9 m. It is the
///            shortest within 1e-6 of its length and 1e-9 m where distance_lower_bound is as near as that to it.
///            It is, for every shape that is no deeper than half its smallest extent, and for a sphere or capsule
///            whose core is above the ground at any depth. Deeper too in nearly all cases, but there a search over
///            rough ground may reach its limit first: then the bound says how much may be missing. It is loose for
///            shapes much smaller than a cell that are deeper than they are large.
///            LawsOfDepth.*, ShortestTranslation.* in ground_laws_test check it against brute force.
/// Status:    not_resident also where the translation ends at ground that is not loaded; the answer is then the one
///            without that ground.
///
/// @param max_distance gaps beyond it are not searched, metres, >= 0
///
/// Threads:   any number at once
/// Allocates: nothing; up to 100 KB of stack
/// Cost:      of overlaps microseconds where one triangle or a few decide, up to some 10 ms deep in rough ground
DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance);

/// Whether a shape and the ground meet, and the lift: largest of surface minus z over the shape's
/// points that lie over ground; minus infinity where there is no ground below or above the shape.
struct LiftAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double lift = 0.0;  ///< metres; see above
    double error_m = 0.0;  ///< largest bound of the cells that were evaluated
};
/// Computes the lift. Threads: any number at once. Allocates: nothing.
LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Whether a shape and the ground meet; touching counts. Stops as soon as anything decides.
TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Minus the lift: a cheap measure with the sign of the signed distance. Infinity where there is no ground
/// below or above the shape.
PseudodistanceAnswer pseudodistance(const Shape& shape, const Pose& world_from_shape,
                                    const Ground& ground);

}  // namespace terrane
