// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/query.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <span>

namespace terrane {

/// A point where a shape touches the ground, or is closer to it than the margin.
struct Contact {
    WorldPos point_world = WorldPos::Zero();  ///< on the shape, the deepest along `normal`
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground, in its normal cone
    double depth = 0.0;            ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature;    ///< feature of the shape, or of the part, that `point_world` lies on
    std::uint32_t part = 0;  ///< index of the part of a compound; else 0
};

/// Answer of find_contacts().
struct ContactAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    std::size_t count = 0;                      ///< written to contacts_out, deepest first
    /// Vertical overlap, metres: largest of surface minus z over the shape; moving up by it always separates;
    /// <= 0 apart. Beside volumes: see compute_lift().
    double lift = 0.0;
    double error_m = 0.0;  ///< largest error_m of the cells tested
};

/// Finds where a shape touches the ground.
///
/// The ground is the solid {z <= contact surface}: one-sided, so that a shape entirely below is pushed up. On flat and
/// concave edges contacts have a face's normal, on convex ones a normal between those of the two faces. The shortest
/// translation that resolves all contacts, each along its normal by its depth, separates the shape (verified:
/// lift <= 1e-9).
///
/// Beside volumes (Chunk::solid) the ground is the joined solid, with ceilings and walls. Contacts are paired where the
/// shape, shrunk, is separated; one that is deeper than that, or lies in the solid, has one contact, along the
/// translation of signed_distance().
///
/// @param world_from_shape pose; the rotation must be orthonormal to 1e-6
/// @param margin           also report gaps up to this, metres, finite, >= 0
/// @param contacts_out     caller's buffer; at most 4 contacts per patch of one normal
///
/// Fails:     status `invalid` where an argument is out of range
/// Threads:   any number at once
/// Allocates: nothing
ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out);

/// Answer of signed_distance().
struct DistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool has_ground = false;  ///< false where there is no ground within max_distance
    /// Metres. Apart: the gap. Overlapping: minus the length of a translation that separates.
    double distance = 0.0;
    double distance_lower_bound = 0.0;        ///< metres, certified: see signed_distance()
    WorldPos point_world = WorldPos::Zero();  ///< the shape's closest (or deepest) point
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground; the translation's direction
    double error_m = 0.0;          ///< largest error_m of the cells tested
};

/// Signed distance of a shape from the ground.
///
/// Apart: the Euclidean gap. Overlapping: minus the length of the minimum translation, the shortest in any direction
/// after which the interiors of the shape and of the solid {z <= contact surface} are disjoint; `-distance * normal` is
/// that translation. Where the ground ends (border, nodata) its side does not block: moving out beyond it separates.
///
/// `distance_lower_bound` is a lower bound of that length: no shorter translation separates, and
/// 0 <= distance_lower_bound <= |distance|. Apart it is the gap.
///
/// Beside volumes the translation separates from the joined solid, verified, and is short, but not always the shortest:
/// the bound is 0 then. Out of the solid it leads through the nearest points of the surface, into a cave or up. Gaps
/// beyond 10,000 spacings are not found.
///
/// Boundary:  touching is 0; lifts up to 1e-10 m count as separated, so that an overlap below that is a gap of 0.
///            Shapes without volume (a flat hull, a sphere of radius 0) have the same definition.
/// Accuracy:  1e-9 m apart. Overlapping, the answer always separates: the lift after it is at most 1e-9 m. It is the
///            minimum within 1e-6 of its length and 1e-9 m where distance_lower_bound is that near to it: for every
///            shape that is no deeper than half its smallest extent, and at any depth for a sphere or capsule whose
///            core is above the ground. Deeper it nearly always is, but over rough ground the search may reach its
///            limit first: the bound then limits the excess. The bound is loose for shapes much smaller than a cell
///            that are deeper than they are large.
///            LawsOfDepth.*, ShortestTranslation.* in ground_laws_test check it against brute force.
/// Fails:     status `invalid` where an argument is out of range; `not_resident` also where the translation ends at
///            ground that is not loaded: the answer is then the one without that ground.
///
/// @param max_distance larger gaps are not searched for, metres, >= 0; infinity is allowed
///
/// Threads:   any number at once
/// Allocates: nothing; up to 100 KB of stack
/// Cost:      overlapping, microseconds where one triangle or a few decide, up to some 10 ms deep in rough ground,
///            0.2 s for a shape of 100 m over rough cells of 1 m
DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance);

/// Answer of compute_lift().
struct LiftAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double lift = 0.0;     ///< metres; minus infinity where no ground is below or above the shape
    double error_m = 0.0;  ///< largest error_m of the cells tested
};

/// The lift of a shape: its vertical overlap with the ground, the largest of surface minus z over the shape's points
/// that lie over or below ground. Positive where they overlap; moving up by it always separates.
///
/// Beside volumes, where up may lead into a ceiling, it is how far the shape must shrink until it is separated, within
/// 1 %, or minus the gap: it has the same sign.
LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Whether a shape and the ground overlap or touch: whether the lift is at least -1e-9 m. Stops at the first contact.
TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Minus the lift: a cheap measure with the sign of the signed distance. Infinity where there is no ground below or
/// above the shape; the normal is up.
PseudodistanceAnswer pseudodistance(const Shape& shape, const Pose& world_from_shape,
                                    const Ground& ground);

/// Answer of cast().
struct CastAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether the ground is met
    double fraction = 1.0;                      ///< of the motion, in [0, 1]: no overlap before it
    bool started_in_contact = false;  ///< touch or overlap at t = 0; fraction is 0 unless skipped
    Contact contact;                  ///< the deepest at `fraction`; set where `hit`
    double error_m = 0.0;             ///< largest error_m of the cells tested
};

/// Time of impact: the first contact of a moving, turning shape with the ground; beside volumes with the joined solid,
/// ceilings and walls included.
///
/// Fails:     status `invalid` where an argument is out of range; `not_resident` where ground that is not loaded may be
///            met first: `fraction` is how far the motion is known to be clear
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      O(cells near the trajectory), not of the AABB of the whole sweep
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings = {});

}  // namespace terrane
