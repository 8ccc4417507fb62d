// SPDX-License-Identifier: MIT
#pragma once

#include "ground/heightfield/contact_patches.h"
#include "ground/mesh_part.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/query.h>

namespace terrane::internal {

/// A body that is shrunk by an offset, and the joined surface.
struct MeshNearness {
    bool is_missing = false;  ///< ground that is not resident may be near
    /// Lower bound of the distance of the shrunk body from the nearest triangle, at most the reach; exact below
    /// `exact_below`. <= 0: it intersects one, or lies in the solid.
    double distance = 0.0;
};

/// Finds how far a shrunk body is from all triangles, seen from either side. What no triangle crosses is either in
/// the air or in the solid: there the distance is negative.
///
/// @param reach       farther triangles are not searched for, metres
/// @param exact_below distances below this are exact
MeshNearness find_nearness(const SurfaceTriangles& surface, const LocalBody& body, double offset,
                           double reach, double exact_below);

/// The same, and the contacts of the whole body, paired where the shrunk one is separated: those whose direction lies
/// in the surface's normal cone, so that edges between triangles of a flat floor or a concave corner have none.
///
/// @param margin  gaps of the whole body up to this are contacts, metres
/// @param patches gets them, in the local frame; none where the shrunk body is not separated
MeshNearness find_mesh_contacts(const SurfaceTriangles& surface, const LocalBody& body,
                                double offset, double margin, double exact_below,
                                ContactPatches& patches);

/// Whether no triangle that touches a point of the surface rises above the plane through it, so that a direction lies
/// in the normal cone there.
bool is_in_surface_cone(const SurfaceTriangles& surface, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& n);

/// How far a body must shrink until it is separated.
struct MeshOverlap {
    bool is_missing = false;
    bool is_deep = false;   ///< not separated at any offset
    double offset = 0.0;    ///< least that separates, metres
    double distance = 0.0;  ///< lower bound of the distance at that offset
};

/// Finds an offset at which a body is separated: exact for spheres and capsules whose core is, 0 where it is
/// separated as it is, else by bisection.
/// @param touch    distances below this count as touching, metres, > 0
/// @param accuracy the answer is at most the least by this share above it, or by 1
MeshOverlap find_overlap_offset(const SurfaceTriangles& surface, const LocalBody& body,
                                double touch, double accuracy);

/// A shape at a pose beside the joined surface, in a frame near it.
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
    /// Smallest n . p of the body's points.
    double lowest(const Eigen::Vector3d& n) const {
        return dot(n, origin_) - support_distance(shape_, -rotated_back(rotation_, n));
    }
    LocalBody moved(const Eigen::Vector3d& d) const { return {shape_, rotation_, origin_ + d}; }
    /// The box around the body, widened.
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

/// A translation after which a body touches no triangle and lies in the air: verified. Not always the shortest.
struct MeshTranslation {
    bool is_missing = false;  ///< ground that is not resident is in the way
    bool is_found = false;
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
};

/// Finds a short one: out along the contacts of a shallow overlap; else through the nearest points of the surface, then
/// along the contacts there; else up over everything.
///
/// @param overlap of the body
/// Cost: up to some milliseconds
MeshTranslation find_separating_translation(const MeshQuery& query, const MeshOverlap& overlap);

/// Where a moving body that is shrunk by an offset meets the joined surface.
struct MeshSweepAnswer {
    bool is_missing = false;  ///< ground that is not resident may be met first: `fraction` is clear
    bool hit = false;
    double fraction =
        1.0;  ///< of the motion: at no time before does the shrunk body touch a triangle
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< at the hit, from the triangle to the body
    Eigen::Vector3d on_shape_world = Eigen::Vector3d::Zero();  ///< on the shrunk body
    std::uint32_t part = 0;
};

/// Casts a shrunk body along a motion against all triangles, from either side. The body must be separated at the
/// start; where it is not, the fraction is 0. Triangles that it is near to and does not approach do not stop it.
///
/// @param stop_gap a hit is at a distance of at most this, metres, > 0
MeshSweepAnswer sweep_mesh(const Shape& shape, const Motion& motion, const Ground& ground,
                           double offset, double stop_gap);

/// How deep a body lies in the joined surface beside volumes.
struct MeshDepth {
    bool is_missing = false;
    double depth =
        0.0;  ///< the least offset at which the shrunk body is separated, metres; 0 apart
};

/// Contacts of a body beside volumes, and how far it is away when it is shrunk.
struct MeshContactAnswer {
    ContactAnswer contacts;
    double distance = 0.0;  ///< MeshNearness::distance at the offset
    /// How fast each contact's gap grows with the offset, 0 to 1.
    std::array<double, 64> openings;
};

/// find_mesh_contacts() in world axes: complete, or truncated to the deepest.
MeshContactAnswer find_contacts_at_offset(const Shape& shape, const Pose& world_from_shape,
                                          const Ground& ground, double offset, double margin,
                                          double exact_below, std::span<Contact> contacts_out);

/// find_nearness() of a shape at a pose.
MeshNearness find_nearness_at(const Shape& shape, const Pose& world_from_shape,
                              const Ground& ground, double offset, double reach,
                              double exact_below);

MeshDepth measure_mesh_depth(const Shape& shape, const Pose& world_from_shape,
                             const Ground& ground);

/// Whether the bounding sphere of a body that moves by a displacement may meet triangles of volumes: is_near_volume()
/// of the box around its sweep.
bool may_meet_volume(const Ground& ground, const WorldPos& centre, double radius,
                     const Eigen::Vector3d& displacement = Eigen::Vector3d::Zero());

}  // namespace terrane::internal
