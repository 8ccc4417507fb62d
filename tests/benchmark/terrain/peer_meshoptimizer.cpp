// SPDX-License-Identifier: MIT
//
// A. Kapoulkine, meshoptimizer: positions are float there, so that its own time is without the conversion.
#include "benchmark/terrain/simplifiers.h"

#include <meshoptimizer.h>

#include <cfloat>

namespace terrane::bench {
namespace {

using test::ShapeMesh;

template <class Simplify>
Simplified run_peer(const ShapeMesh& mesh, int runs, const Simplify& simplify) {
    std::vector<float> positions;
    std::vector<unsigned> indices;
    for (const Eigen::Vector3d& v : mesh.vertices) {
        for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(v[axis]));
    }
    for (const auto& t : mesh.triangles) indices.insert(indices.end(), t.begin(), t.end());
    std::vector<unsigned> made(indices.size());
    std::size_t count = 0;
    Simplified result;
    result.ms = median_ms(runs, [&] { count = simplify(made, indices, positions); });
    result.mesh.vertices = mesh.vertices;
    for (std::size_t i = 0; i < count; i += 3)
        result.mesh.triangles.push_back({made[i], made[i + 1], made[i + 2]});
    return result;
}

}  // namespace

Simplified run_meshoptimizer(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    return run_peer(mesh, runs, [&](auto& made, const auto& indices, const auto& positions) {
        return meshopt_simplify(made.data(), indices.data(), indices.size(), positions.data(),
                                mesh.vertices.size(), 3 * sizeof(float), 3 * triangles, FLT_MAX, 0,
                                nullptr);
    });
}

Simplified run_meshoptimizer_sloppy(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    return run_peer(mesh, runs, [&](auto& made, const auto& indices, const auto& positions) {
        return meshopt_simplifySloppy(made.data(), indices.data(), indices.size(), positions.data(),
                                      mesh.vertices.size(), 3 * sizeof(float), 3 * triangles,
                                      FLT_MAX, nullptr);
    });
}

}  // namespace terrane::bench
