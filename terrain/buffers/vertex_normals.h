// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/math.h>
#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <vector>

namespace terrane::internal {

/// Normals of a chunk's samples from central differences, across borders to chunks of the same level where these are
/// resident, one-sided else.
class SampleNormals {
public:
    /// @param resident, chunk outlive the normals
    SampleNormals(const ResidentSet& resident, const Chunk& chunk);
    /// Unit, up. @param sample  sample_index()
    Eigen::Vector3f at(std::size_t sample) const;

private:
    const Chunk& chunk_;
    const Chunk* west_;
    const Chunk* east_;
    const Chunk* south_;
    const Chunk* north_;
    double slope_of_quantum_;  // slope of one quantum over one spacing
};

/// Normals of the vertices of a chunk's volumes: the mean of the normals of their triangles in this frame, by area; up
/// where there is none.
std::vector<Eigen::Vector3f> solid_normals(const MeshSolid& solid);

/// Calls with the indices of each triangle of a chunk's volumes in this frame.
template <class Visit>
void visit_triangles(const MeshSolid& solid, Visit visit) {
    for (const auto& triangle : solid.triangles) visit(triangle);
    for (const MeshSolid::Triangles& cap : solid.caps) {
        for (const auto& triangle : cap) visit(triangle);
    }
}

}  // namespace terrane::internal
