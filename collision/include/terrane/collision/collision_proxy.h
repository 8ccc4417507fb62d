// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>

namespace terrane {

/// Limits of a collision proxy: distance from the mesh, number of hulls, vertices of a hull.
struct CollisionProxySettings {
    /// Largest CollisionProxy::distance_m, metres, 0 to 1e6. 0: one exact hull where the mesh is convex, else the
    /// triangles of the surface. Larger values give fewer and larger hulls, in the end one.
    double proxy_error = 0.01;
    /// Most hulls, 1 to 4096. Of a surface without inside it is not a limit.
    std::size_t max_parts = 64;
    /// Most vertices of a hull, 4 to 4096.
    std::size_t max_hull_vertices = 64;
    /// Fails in place of a proxy that is not within proxy_error; early, where that is known before pieces are merged.
    bool must_be_within_error = false;
};

/// Kind of geometry in a collision proxy.
enum class CollisionProxyKind : std::uint8_t {
    hulls,  ///< solid hulls of a closed mesh
    surface,  ///< triangles, because the mesh is closed but not convex and proxy_error is 0: no inside
    open,     ///< triangles, because the mesh is not closed: no inside
};

/// A compound in the place of a triangle mesh.
struct CollisionProxy {
    Compound shape;                                       ///< in the frame of the mesh
    CollisionProxyKind kind = CollisionProxyKind::hulls;  ///< solid, or a surface without inside
    /// Certified bound, metres: every point of the mesh's surface is within this of the proxy, and every point of the
    /// surface of each part is within this of the mesh's solid (of its surface, where the proxy is a surface). The
    /// larger of the next two. Cavities and narrow tunnels may be filled: their walls are within 0 of the proxy.
    double distance_m = 0.0;
    double mesh_to_proxy_m =
        0.0;  ///< bound of the first distance: how far the mesh may stand out of the proxy
    double proxy_to_mesh_m =
        0.0;  ///< bound of the second one: how far the proxy may stand out of the mesh
    /// Whether distance_m is at most proxy_error (and 2e-9 of the extent). False where max_parts or max_hull_vertices
    /// does not allow it.
    bool is_within_error = true;
    double mesh_volume =
        0.0;  ///< of a closed mesh, m^3, where its components do not overlap; else 0
    double parts_volume = 0.0;  ///< sum over the hulls, m^3: overlaps count twice
};

/// Makes a collision shape of a mesh: an approximate convex decomposition where the mesh is closed, triangles where it
/// is not. Positions that are equal count as one; triangles with equal corners are ignored. The mesh is closed if each
/// edge has as many triangles in one direction as in the other. Inside is where the winding number is not 0, so that
/// meshes that are turned inside out, overlap themselves or have several components are solid too. See
/// docs/proxies.md.
///
/// Mass: a World takes a proxy for a Compound, that is the sum of its hulls at uniform density, where overlaps count
/// twice. parts_volume over mesh_volume says how much the mass is spread by that; with fewer, larger hulls it is also
/// more filled. For a mass by density multiply mesh_volume.
///
/// Fails:     invalid_argument as check() of a mesh; for a mesh without a triangle that has three different corners;
///            for coordinates beyond 1e5 m; for a surface of more than Compound::kMaxParts triangles; for a setting
///            out of its range; bad_data with must_be_within_error, naming an error that can be reached or a lower
///            bound of those
/// Threads:   any number of calls at once
/// Cost:      0.1 to 0.6 s for 1000 triangles within 5 % of the extent; 9 s for a rough mesh of 360 within 1 %
/// Accuracy:  the same bits with every compiler; `ProxyOfMesh.DistanceHoldsAgainstDenseSampling` measures
///            the bound
Result<CollisionProxy> make_collision_proxy(const TriangleMesh& mesh,
                                            const CollisionProxySettings& settings = {});

}  // namespace terrane
