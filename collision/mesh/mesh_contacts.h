// SPDX-License-Identifier: MIT
#pragma once

#include "ground/contact/contact_patches.h"
#include "mesh/mesh_part.h"

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

}  // namespace terrane::internal
