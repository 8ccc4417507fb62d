// SPDX-License-Identifier: MIT
#pragma once

#include "progressive/contraction_recorder.h"
#include "progressive/welded_mesh.h"

#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// A mesh and the record of its contractions in streaming order, which the levels of it share.
struct Recording {
    /// @param welded of the mesh
    /// @param record of contractions of `welded`
    Recording(const TriangleMesh& mesh, const WeldedMesh& welded, ContractionRecord record);

    /// The step of the finest level with no more triangles than this, or the last one.
    std::size_t step_of_count(std::size_t count) const;

    TriangleMesh finest;
    std::vector<std::uint32_t> input_vertices, input_triangles;
    // Of each step: the end of its changes, and the counts after it. [steps + 1], the first is the finest level.
    std::vector<ContractionRecord::Change> changes;
    std::vector<std::size_t> ends;
    std::vector<std::uint32_t> triangle_counts, vertex_counts;
    std::vector<double> errors_m;
    std::vector<std::uint32_t> unused_from, parents;  ///< [vertices]
};

}  // namespace terrane::internal
