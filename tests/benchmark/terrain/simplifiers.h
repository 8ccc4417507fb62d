// SPDX-License-Identifier: MIT
#pragma once

#include "benchmark/machine.h"
#include "support/meshes.h"

#include <cstddef>
#include <string>
#include <vector>

namespace terrane::bench {

/// The result of a method: triangles of the input's vertices, or of its own.
struct Simplified {
    test::ShapeMesh mesh = {};
    double certified =
        -1.0;         ///< bound of the Hausdorff distance, metres; negative: the method has none
    double ms = 0.0;  ///< processor time of the method alone, median of the runs
};

/// A method that reduces a mesh to about a number of triangles.
struct Simplifier {
    std::string name;
    Simplified (*run)(const test::ShapeMesh& mesh, std::size_t triangles, int runs) = nullptr;
};

/// Processor time of a function in milliseconds: the median of some runs. Others may use the machine.
template <class Function>
double median_ms(int runs, const Function& function) {
    return tools::median_ms(runs, Clock::thread, function);
}

/// The methods of this program, and the peers that are installed.
std::vector<Simplifier> all_simplifiers();

/// Vertices are removed and their holes triangulated (Schroeder et al. 1992).
Simplified run_vertex_decimation(const test::ShapeMesh& mesh, std::size_t triangles, int runs);

/// The vertices of each cell of a grid become one (Rossignac and Borrel 1993; Lindstrom 2000).
Simplified run_vertex_clustering(const test::ShapeMesh& mesh, std::size_t triangles, int runs);

#if TERRANE_BENCH_MESHOPTIMIZER
/// meshopt_simplify() of meshoptimizer, which keeps topology.
Simplified run_meshoptimizer(const test::ShapeMesh& mesh, std::size_t triangles, int runs);

/// meshopt_simplifySloppy() of meshoptimizer: clustering.
Simplified run_meshoptimizer_sloppy(const test::ShapeMesh& mesh, std::size_t triangles, int runs);
#endif

}  // namespace terrane::bench
