// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/contraction_recorder.h"

#include <terrane/terrain/simplify_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// A mesh to simplify.
struct SimplifyTask {
    const TriangleMesh& mesh;
    const WeldedMesh& welded;  ///< from the mesh
    const ProgressiveSettings& settings;
    std::span<const std::uint8_t> locked;  ///< [places]
};

/// The result of a method, before its distance is bounded.
struct MethodResult {
    TriangleMesh mesh;
    SimplifyStop stop = SimplifyStop::triangle_count;
};

/// The methods. Each ends at a number of triangles, or where an estimate of its error, metres, would exceed a limit.
MethodResult contract_edges(const SimplifyTask& task, std::size_t triangles, double limit);
MethodResult decimate(const SimplifyTask& task, std::size_t triangles, double limit);
MethodResult cluster(const SimplifyTask& task, std::size_t triangles, double limit);

}  // namespace terrane::internal
