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
    /// Largest CollisionProxy::distance_m, metres, 0 to 1e6. 0 gives one exact hull if the mesh is convex, otherwise
    /// the triangles of the surface. Larger values give fewer and larger hulls, ultimately one.
    double proxy_error = 0.01;
    /// Largest number of hulls, 1 to 4096. Does not apply to a surface without an interior.
    std::size_t max_parts = 64;
    /// Largest number of vertices per hull, 4 to 4096.
    std::size_t max_hull_vertices = 64;
    /// Whether make_collision_proxy() fails if the proxy would exceed proxy_error. It fails before parts are merged if
    /// the excess is known by then.
    bool must_be_within_error = false;
};

/// Kind of geometry in a collision proxy.
enum class CollisionProxyKind : std::uint8_t {
    hulls,    ///< solid hulls of a closed mesh
    surface,  ///< triangles: the mesh is closed but not convex, and proxy_error is 0; no interior
    open,     ///< triangles: the mesh is not closed; no interior
};

/// A compound that stands in for a triangle mesh.
struct CollisionProxy {
    Compound shape;                                       ///< in the frame of the mesh
    CollisionProxyKind kind = CollisionProxyKind::hulls;  ///< solid or surface
    /// Certified bound, metres: every point of the mesh's surface is within this distance of the proxy, and every point
    /// of the surface of each part is within this distance of the mesh's solid (of its surface, if the proxy is a
    /// surface). The larger of the next two members. Cavities and narrow tunnels may be filled: their walls then have
    /// distance 0 from the proxy.
    double distance_m = 0.0;
    /// Bound of the first distance: how far the mesh may protrude from the proxy, metres.
    double mesh_to_proxy_m = 0.0;
    /// Bound of the second distance: how far the proxy may protrude from the mesh, metres.
    double proxy_to_mesh_m = 0.0;
    /// Whether distance_m is at most proxy_error plus 2e-9 of the extent. False if max_parts or max_hull_vertices
    /// prevents it.
    bool is_within_error = true;
    /// Volume of a closed mesh whose components do not overlap, m^3; else 0.
    double mesh_volume = 0.0;
    double parts_volume = 0.0;  ///< sum of the hulls' volumes, m^3: overlaps count twice
};

/// Makes a collision shape from a mesh: an approximate convex decomposition if the mesh is closed, otherwise its
/// triangles. Equal positions are merged; triangles with equal corners are ignored. The mesh is closed if as many
/// triangles use each edge in one direction as in the other. The interior is where the winding number is not 0, so that
/// meshes that are inside out, intersect themselves or have several components are solid too. See docs/proxies.md.
///
/// Mass: a World treats a proxy as any Compound, as the sum of its hulls at uniform density, where overlaps count
/// twice. parts_volume / mesh_volume shows how far this distorts the distribution of mass; fewer, larger hulls also
/// fill concavities. To derive a mass from a density, multiply it by mesh_volume.
///
/// Fails:     invalid_argument as TriangleMesh::validate(); for a mesh without a triangle that has three different
///            corners; for coordinates beyond 1e5 m; for a surface of more than Compound::kMaxParts triangles; for a
///            setting out of its range; bad_data with must_be_within_error, naming an achievable error or a lower bound
///            of all errors
/// Threads:   any number of calls at once
/// Cost:      0.1 to 0.6 s for 1000 triangles within 5 % of the extent; 9 s for 360 triangles of a rough mesh within
///            1 %
/// Accuracy:  the same bits with every compiler; `ProxyOfMesh.DistanceHoldsAgainstDenseSampling` tests the bound
Result<CollisionProxy> make_collision_proxy(const TriangleMesh& mesh,
                                            const CollisionProxySettings& settings = {});

}  // namespace terrane
