// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>
#include <memory>
#include <optional>

namespace terrane {

/// Where a segment first meets a mesh.
struct MeshHit {
    double fraction = 0.0;  ///< of the segment from its start, 0 to 1
    std::uint32_t triangle =
        0;  ///< index of TriangleMesh::triangles; the least one of those met at once
    Eigen::Vector3d normal =
        Eigen::Vector3d::UnitZ();  ///< unit, of the triangle, against the segment
};

/// A triangle mesh for ray queries. Immutable; copies share their data.
///
/// Threads: any number at once
class MeshRays {
public:
    /// Triangles without area are never met.
    ///
    /// Fails:     invalid_argument as check(TriangleMesh)
    /// Allocates: about 200 bytes a triangle
    /// Cost:      O(n log n)
    static Result<MeshRays> create(const TriangleMesh& mesh);

    /// The first triangle that a segment meets, from either side. A segment that meets an edge or a vertex meets its
    /// triangles: none gets through between two of them.
    ///
    /// @param from, to in the mesh's frame; nothing is met where they are not finite
    ///
    /// Cost:   O(log n) for most segments; O(n) at worst
    /// Source: S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013, without their
    ///         exact test where an edge function is 0: it counts as met
    std::optional<MeshHit> ray(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

private:
    struct Data;
    explicit MeshRays(std::shared_ptr<const Data> data);
    std::shared_ptr<const Data> data_;
};

}  // namespace terrane
