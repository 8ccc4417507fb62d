// SPDX-License-Identifier: MIT
#pragma once

#include "ground/eroded_part.h"
#include "ground/heightfield/contact_patches.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/query.h>

namespace terrane::internal {

/// Distance of a shrunk body from the joined surface.
struct MeshNearness {
    bool is_missing = false;  ///< ground that is not resident may be near
    /// Lower bound of the distance of the shrunk body from the nearest triangle, at most the reach; exact below
    /// `exact_below`. <= 0 if the body intersects a triangle or lies in the solid.
    double distance = 0.0;
};

/// Finds the distance of a body, shrunk by `offset`, from the nearest triangle; both sides of triangles count. A body
/// that intersects no triangle is either in the air or in the solid; in the solid the distance is negative.
///
/// @param reach       farther triangles are not searched for, metres
/// @param exact_below distances below this are exact
MeshNearness find_nearness(const SurfaceTriangles& surface, const LocalBody& body, double offset,
                           double reach, double exact_below);

/// Does the same as find_nearness(), and finds the contacts of the whole body. Features are paired for the shrunk body,
/// which must be separated. Only directions in the surface's normal cone give contacts, so that edges between triangles
/// of a flat floor or in a concave corner have none. The reach is `margin` plus the offset.
///
/// @param margin  gaps of the whole body up to this are contacts, metres
/// @param patches receives the contacts, in the local frame; none if the shrunk body is not separated
MeshNearness find_mesh_contacts(const SurfaceTriangles& surface, const LocalBody& body,
                                double offset, double margin, double exact_below,
                                ContactPatches& patches);

/// Whether a direction lies in the normal cone at a point of the surface: no triangle that touches the point rises
/// above the plane through it.
bool is_in_surface_cone(const SurfaceTriangles& surface, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& n);

/// The offset by which a body must shrink to be separated.
struct MeshOverlap {
    bool is_missing = false;
    bool is_deep = false;   ///< not separated at any offset
    double offset = 0.0;    ///< smallest offset that separates, metres
    double distance = 0.0;  ///< lower bound of the distance at that offset
};

/// Finds an offset at which a body is separated: 0 if it is separated already. The offset is exact for spheres and
/// capsules whose core is separated, otherwise found by bisection.
/// @param touch    distances below this count as touching, metres, > 0
/// @param accuracy relative tolerance: the answer exceeds the smallest offset by at most this fraction of it, or by
///                 `touch`
MeshOverlap find_overlap_offset(const SurfaceTriangles& surface, const LocalBody& body,
                                double touch, double accuracy);

/// A shape at a pose beside the joined surface, in a frame near the shape.
class MeshQuery {
public:
    MeshQuery(const Shape& shape, const Pose& world_from_shape, const Ground& ground)
        : shape_(shape),
          rotation_(world_from_shape.rotation),
          local_(ground, world_from_shape.translation),
          surface_(local_),
          origin_(local_.to_local(world_from_shape.translation)),
          body_(shape, rotation_, origin_) {}
    MeshQuery(const MeshQuery&) = delete;
    MeshQuery& operator=(const MeshQuery&) = delete;

    const LocalGround& local() const { return local_; }
    const SurfaceTriangles& surface() const { return surface_; }
    const LocalBody& body() const { return body_; }
    /// Minimum of n . p over the points p of the body.
    double lowest(const Eigen::Vector3d& n) const {
        return dot(n, origin_) - support_distance(shape_, -rotated_back(rotation_, n));
    }
    LocalBody moved(const Eigen::Vector3d& d) const { return {shape_, rotation_, origin_ + d}; }
    /// The AABB of the body, widened by `margin`.
    Aabb box(double margin) const {
        const Eigen::Vector3d half = body_.whole().bounds + Eigen::Vector3d::Constant(margin);
        return {body_.whole().centre - half, body_.whole().centre + half};
    }

private:
    const Shape& shape_;
    Eigen::Matrix3d rotation_;
    LocalGround local_;
    SurfaceTriangles surface_;
    Eigen::Vector3d origin_;
    LocalBody body_;
};

/// A verified separating translation: after it a body touches no triangle and lies in the air. Not always the shortest.
struct MeshTranslation {
    bool is_missing = false;  ///< ground that is not resident is in the way
    bool is_found = false;
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
};

/// Finds a short separating translation: along the contact normals of a shallow overlap; if there is none, out through
/// the nearest points of the surface, then along the contact normals there; if there is none, up above everything.
///
/// @param overlap find_overlap_offset() of the body
/// Cost: up to some milliseconds
MeshTranslation find_separating_translation(const MeshQuery& query, const MeshOverlap& overlap);

/// First contact of a moving, shrunk body with the joined surface.
struct MeshSweepAnswer {
    bool is_missing =
        false;  ///< ground that is not resident may be met first; the motion is clear up to `fraction`
    bool hit = false;
    /// Fraction of the motion before which the shrunk body touches no triangle.
    double fraction = 1.0;
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< at the hit, from the triangle to the body
    Eigen::Vector3d on_shape_world = Eigen::Vector3d::Zero();  ///< on the shrunk body
    std::uint32_t part = 0;
};

/// Casts a shrunk body along a motion against both sides of all triangles. If the body is not separated at the start,
/// the fraction is 0. The body passes triangles that it is near but does not approach.
///
/// @param stop_gap a hit is at a distance of at most this, metres, > 0
MeshSweepAnswer sweep_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                           double offset, double stop_gap);

/// Depth of a body in the joined surface beside volumes.
struct MeshDepth {
    bool is_missing = false;
    /// Smallest offset at which the shrunk body is separated, metres; 0 if the body is separated.
    double depth = 0.0;
};

/// Contacts of a body beside volumes, and the distance of the shrunk body.
struct MeshContactAnswer {
    ContactAnswer contacts;
    double distance = 0.0;  ///< MeshNearness::distance at the offset
    /// Derivative of each contact's gap with respect to the offset, 0 to 1.
    std::array<double, 64> openings;
};

/// find_mesh_contacts() of a shape at a pose, in world coordinates: all contacts or, if truncated, the deepest.
MeshContactAnswer find_contacts_at_offset(const Shape& shape, const Pose& world_from_shape,
                                          const Ground& ground, double offset, double margin,
                                          double exact_below, std::span<Contact> contacts_out);

/// find_nearness() of a shape at a pose.
MeshNearness find_nearness_at(const Shape& shape, const Pose& world_from_shape,
                              const Ground& ground, double offset, double reach,
                              double exact_below);

MeshDepth measure_mesh_depth(const Shape& shape, const Pose& world_from_shape,
                             const Ground& ground);

/// Whether a bounding sphere that moves by `displacement` may meet triangles of volumes: is_near_volume() of the box
/// around its sweep.
bool may_meet_volume(const Ground& ground, const WorldPos& centre, double radius,
                     const Eigen::Vector3d& displacement = Eigen::Vector3d::Zero());

}  // namespace terrane::internal
