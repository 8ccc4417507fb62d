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
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground, within the ground's normal cone
    double depth = 0.0;            ///< overlap along `normal`, metres; negative: a gap
    ShapeFeature feature;    ///< feature of the shape, or of the part, that `point_world` lies on
    std::uint32_t part = 0;  ///< index of a compound's part; else 0
};

/// Answer of find_contacts().
struct ContactAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    std::size_t count = 0;                      ///< written to contacts_out, deepest first
    /// Vertical overlap, metres, as compute_lift(); <= 0 if the shape is apart from the ground. Beside volumes only an
    /// estimate, with the same sign.
    double lift = 0.0;
    double error_m = 0.0;  ///< largest error_m of the cells tested
};

/// Finds where a shape touches the ground.
///
/// The ground is the solid {z <= contact surface}: one-sided, so that a shape entirely below is pushed up. A contact at
/// a flat or concave edge has a face's normal; at a convex edge, a normal between the normals of the two faces. The
/// shortest translation that moves the shape by at least `depth` along the normal of every contact separates it
/// (verified: lift <= 1e-9 m). No contact is deeper than the lift; if the lift is at most a tenth of the shape's
/// smallest extent, or the shape is flat, none is deeper than the minimum translation.
///
/// Beside volumes (Chunk::solid) the ground is the joined solid, with ceilings and walls. An overlapping shape is
/// shrunk until it is separated, and contacts are found for the shrunk shape. If no shrinking separates it, it has one
/// contact, along the translation of signed_distance().
///
/// @param world_from_shape pose; the rotation must be orthonormal to 1e-6
/// @param margin           gaps up to this are contacts too, metres, finite, >= 0
/// @param contacts_out     caller's buffer; at most 4 contacts per patch of one normal
///
/// Fails:     status `invalid` if an argument is out of range
/// Threads:   any number at once
/// Allocates: nothing
ContactAnswer find_contacts(const Shape& shape, const Pose& world_from_shape, const Ground& ground,
                            double margin, std::span<Contact> contacts_out);

/// Answer of signed_distance().
struct DistanceAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool has_ground = false;                    ///< whether there is ground within max_distance
    /// Metres: the gap if apart; if overlapping, minus the length of a translation that separates the shape.
    double distance = 0.0;
    double distance_lower_bound = 0.0;        ///< metres, certified: see signed_distance()
    WorldPos point_world = WorldPos::Zero();  ///< the shape's closest (or deepest) point
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, out of the ground; the translation's direction
    double error_m = 0.0;          ///< largest error_m of the cells tested
};

/// Signed distance of a shape from the ground.
///
/// If the shape is apart from the ground, the distance is the Euclidean gap. If they overlap, it is minus the length of
/// the minimum translation: the shortest, in any direction, after which the interiors of the shape and of the solid
/// {z <= contact surface} are disjoint. That translation is `-distance * normal`. The ground's sides (at the border, at
/// nodata) do not block: a shape that moves out beyond them is separated.
///
/// No translation shorter than `distance_lower_bound` separates an overlapping shape; the bound is 0 to |distance|.
/// If the shape is apart, the bound is the gap.
///
/// Beside volumes, the translation separates an overlapping shape from the joined solid (verified). It leads through
/// the nearest points of the surface, into a cave or up. It is short, but not always the shortest, so the bound is 0.
/// Gaps beyond 10,000 spacings are not found.
///
/// Boundary:  the distance of touching shapes is 0. Lifts up to 1e-10 m count as separated: a smaller overlap is a gap
///            of 0. The definition also holds for shapes without volume (a flat hull, a sphere of radius 0).
/// Accuracy:  1e-9 m for a gap. The translation always separates an overlapping shape: the lift after it is at most
///            1e-9 m. If the shape is no deeper than half its smallest extent, or is a sphere or capsule with its core
///            above the ground, the translation is longer than the minimum by at most 1e-6 of it plus 1e-9 m. This
///            nearly always holds for deeper shapes too, but over rough ground the search may reach its limit first.
///            The excess is then at most |distance| - distance_lower_bound, which is loose for shapes much smaller than
///            a cell that are deeper than they are large. Tests: LawsOfDepth.*, ShortestTranslation.* in
///            ground_laws_test (brute force)
/// Fails:     status `invalid` if an argument is out of range; `not_resident` also if the translation ends at ground
///            that is not loaded: the answer then ignores that ground
///
/// @param max_distance larger gaps are not searched for, metres, >= 0; infinity is allowed
///
/// Threads:   any number at once
/// Allocates: nothing; up to 100 KB of stack
/// Cost:      for an overlap, microseconds if a few triangles decide; up to some 10 ms deep in rough ground; 0.2 s for
///            a shape of 100 m over rough cells of 1 m
DistanceAnswer signed_distance(const Shape& shape, const Pose& world_from_shape,
                               const Ground& ground, double max_distance);

/// Answer of compute_lift().
struct LiftAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    double lift = 0.0;     ///< metres; minus infinity if no ground is below or above the shape
    double error_m = 0.0;  ///< largest error_m of the cells tested
};

/// The lift of a shape is its vertical overlap with the ground: the maximum of surface height minus z over the points
/// of the shape that lie above or below ground. Positive if they overlap; moving up by the lift always separates them.
///
/// Beside volumes, where moving up may lead into a ceiling, the lift has the same sign but another size. For an
/// overlapping shape it is the offset by which the shape must shrink to be separated, within 1 %; or, if no shrinking
/// separates it, the length of the translation of signed_distance(). If the shape is apart, it is minus the gap.
LiftAnswer compute_lift(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Whether a shape and the ground overlap or touch: whether the lift is at least -1e-9 m. Stops at the first contact.
TestAnswer test_contact(const Shape& shape, const Pose& world_from_shape, const Ground& ground);

/// Minus the lift: cheaper than the signed distance, with the same sign. Infinity if no ground is below or above the
/// shape. The normal always points up: moving along it does not separate a shape from a ceiling.
PseudodistanceAnswer pseudodistance(const Shape& shape, const Pose& world_from_shape,
                                    const Ground& ground);

/// Answer of cast().
struct CastAnswer {
    QueryStatus status = QueryStatus::invalid;  ///< whether the answer is complete
    bool hit = false;                           ///< whether the shape hits the ground
    double fraction = 1.0;                      ///< of the motion, in [0, 1]: no overlap before it
    bool started_in_contact = false;  ///< touch or overlap at t = 0; fraction is 0 unless skipped
    Contact contact;                  ///< the deepest at `fraction`; set where `hit`
    double error_m = 0.0;             ///< largest error_m of the cells tested
};

/// Finds the first contact of a moving, turning shape with the ground (time of impact); beside volumes with the joined
/// solid, ceilings and walls included.
///
/// Fails:     status `invalid` if an argument is out of range; `not_resident` if the shape may hit ground that is not
///            loaded first: the motion is known to be clear up to `fraction`
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      O(cells near the trajectory), however many the AABB of the whole sweep contains
CastAnswer cast(const Shape& shape, const Motion& motion, const Ground& ground,
                const CastSettings& settings = {});

}  // namespace terrane
