// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane {

/// Eye for MeshClusters::find_front_facing(), in the mesh's frame, and bounds on the displacement of drawn vertices.
///
/// Under an affine transform with positive determinant, a triangle faces the eye if and only if it faces the eye's
/// inverse image in the mesh's frame: `eye_mesh` is that image for any rotation and scale, including non-uniform ones.
/// For a negative determinant set `is_mirrored`. Divide `vertex_error` by the smallest scale factor of the transform;
/// for non-uniform scale multiply `angle_error` by the ratio of the largest to the smallest factor.
struct FacingView {
    Eigen::Vector3d eye_mesh = Eigen::Vector3d::Zero();  ///< eye, in the mesh's frame, metres
    double vertex_error = 0.0;  ///< metres in the mesh's frame, >= 0, e.g. from rounding to float
    /// Radians by which the direction from the eye to a vertex may be off, >= 0, e.g. from rounding to a pixel grid.
    double angle_error = 0.0;
    bool is_mirrored = false;  ///< triangles are drawn clockwise from outside
};

/// Consecutive triangles of MeshClusters::order().
struct TriangleRun {
    std::uint32_t first = 0;  ///< index in MeshClusters::order()
    std::uint32_t count = 0;  ///< triangles
};

/// Neighbouring triangles with similar normals, with bounds of their positions and normals.
struct MeshCluster {
    TriangleRun triangles;  ///< of MeshClusters::order()
    BoundingSphere bounds;  ///< contains the triangles, in the mesh's frame
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit axis of the normal cone
    /// Cosine and sine of the largest angle between the axis and a normal, rounded outward. Cosine 0: the cluster has
    /// no cone and is never culled, because a triangle is too thin for a reliable normal or the normals spread too
    /// widely.
    double cosine = 0.0;
    double sine = 1.0;  ///< see `cosine`
    /// The point centre - behind * axis is behind the planes of all triangles, metres.
    double behind = 0.0;
    /// The point centre + ahead * axis is in front of the planes of all triangles, metres.
    double ahead = 0.0;
    double perimeter_over_area =
        0.0;                     ///< largest ratio of a triangle's perimeter to twice its area, 1/m
    double one_over_area = 0.0;  ///< 1 / (twice the smallest area of a triangle), 1/m^2
};

/// A mesh's triangles in clusters, for back-face culling by normal cones. Immutable.
///
/// Meshes may be open and may intersect themselves: only triangles that back-face culling would discard are culled. A
/// mesh whose material draws both sides must not be culled.
///
/// Threads: any number at once
class MeshClusters {
public:
    /// Degenerate triangles, with two corners at one position, are never drawn, but belong to clusters like any other.
    ///
    /// @param triangles    indices of positions, counter-clockwise from outside
    /// @param cluster_size largest number of triangles of a cluster, at least 1; most clusters have at least half as
    ///                     many
    ///
    /// Fails:     invalid_argument for a position that is not finite or beyond kLargestMeshCoordinate, an index beyond
    ///            the positions, a cluster_size of 0, or more than 2^31 triangles
    /// Allocates: 4 bytes a triangle and 160 a cluster
    /// Cost:      O(n log^2 n): about 1 ms for 1000 triangles
    /// Accuracy:  bit-identical with every compiler
    static Result<MeshClusters> create(std::span<const Eigen::Vector3d> positions,
                                       std::span<const TriangleMesh::Triangle> triangles,
                                       std::uint32_t cluster_size = 64);

    /// [triangles] triangle indices, cluster by cluster; ascending within a cluster.
    std::span<const std::uint32_t> order() const { return order_; }
    /// Clusters in the order of their triangles; they partition order().
    std::span<const MeshCluster> clusters() const { return clusters_; }

    /// Finds the clusters that may contain a front-facing triangle, as ascending, non-adjacent runs of order().
    /// Conservative: no front-facing triangle is omitted, for any vertex positions within the errors; some back-facing
    /// ones may be kept. All clusters are kept if a number of `view` is not finite or an error is negative.
    ///
    /// Allocates: if runs_out has too little capacity
    /// Cost:      about 10 ns a cluster
    void find_front_facing(const FacingView& view, std::vector<TriangleRun>& runs_out) const;

private:
    std::vector<std::uint32_t> order_;
    std::vector<MeshCluster> clusters_;
};

/// Whether a cluster may contain a triangle that faces the eye, see MeshClusters::find_front_facing().
bool can_face(const MeshCluster& cluster, const FacingView& view);

}  // namespace terrane
