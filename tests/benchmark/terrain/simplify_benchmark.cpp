// SPDX-License-Identifier: MIT
//
// Triangles, time and tightness of simplify(). Prints one line for each level of each mesh; --quick takes small meshes.
// Distances are measured by brute force with --quick or --measure; exit code 1 where one is above the certified one.
#include "benchmark/bench.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

namespace terrane {
namespace {

using namespace test;

struct Scene {
    const char* name = "";
    ShapeMesh mesh = {};
    std::vector<std::uint8_t> locked = {};
    double radius = 0.0;  // of a sphere; 0: no law is known
};

// Of the processor: others may use the machine.
double milliseconds_of(const SimplifyInput& input, std::span<const SimplifyLevel> levels,
                       std::vector<SimplifiedMesh>& result_out) {
    return tools::median_ms(5, tools::Clock::thread,
                            [&] { result_out = simplify(input, levels).value(); });
}

// Vertices on the outline of a grid.
std::vector<std::uint8_t> locked_outline(int columns, int rows) {
    std::vector<std::uint8_t> locked;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            locked.push_back(static_cast<std::uint8_t>(row == 0 || column == 0 || row == rows ||
                                                       column == columns));
        }
    }
    return locked;
}

bool measure(const Scene& scene, int per_edge) {
    const double edge = mean_edge(scene.mesh);
    const SimplifyInput input = {scene.mesh.vertices, scene.mesh.triangles, scene.locked};
    const std::size_t count = scene.mesh.triangles.size();
    std::printf("%s: %zu triangles, mean edge %.4f m\n", scene.name, count, edge);
    std::printf("  %10s %10s %10s %10s %10s %10s %12s\n", "limit/edge", "triangles", "bound/edge",
                "measured", "law", "ms", "contract/s");
    bool holds = true;
    for (const double share : {0.01, 0.1, 0.25, 0.5, 1.0, 2.0}) {
        const SimplifyLevel level = {.error_m = share * edge};
        std::vector<SimplifiedMesh> result;
        const double ms = milliseconds_of(input, {&level, 1}, result);
        const SimplifiedMesh& mesh = result[0];
        const double measured = per_edge == 0
                                    ? 0.0
                                    : measured_distance(scene.mesh.vertices, scene.mesh.triangles,
                                                        mesh.triangles, per_edge);
        // Measured with a rounding of its own.
        holds &= measured <= mesh.error_m + 1e-12 * edge;
        // A contraction takes two triangles.
        const double contractions = 0.5 * static_cast<double>(count - mesh.triangles.size());
        // Equilateral triangles with corners on a sphere of radius R: error = edge^2 / (6 R).
        const double law = scene.radius > 0.0 ? 16.0 * std::numbers::pi * scene.radius /
                                                    (6.0 * std::numbers::sqrt3 * level.error_m)
                                              : 0.0;
        std::printf("  %10.2f %10zu %10.4f %10.4f %10.0f %10.2f %12.0f\n", share,
                    mesh.triangles.size(), mesh.error_m / edge, measured / edge,
                    std::min(law, static_cast<double>(count)), ms, contractions / (ms * 1e-3));
    }
    std::vector<SimplifyLevel> levels;
    for (const double share : {0.1, 0.25, 0.5, 1.0, 2.0})
        levels.push_back({.error_m = share * edge});
    std::vector<SimplifiedMesh> result;
    std::printf("  five levels in one run: %.2f ms\n", milliseconds_of(input, levels, result));
    return holds;
}

}  // namespace
}  // namespace terrane

int main(int argc, char** argv) {
    using namespace terrane;
    bench::Arguments arguments(argc, argv, "simplify_benchmark [--quick] [--measure]");
    const bool is_quick = arguments.has("--quick"), measures = arguments.has("--measure");
    arguments.finish();
    const int per_edge = is_quick || measures ? 2 : 0;
    const int size = is_quick ? 30 : 150;
    Random random(11);
    std::vector<Scene> scenes;
    scenes.push_back(
        {.name = "sphere of 10 m", .mesh = make_sphere(10.0, is_quick ? 3 : 5), .radius = 10.0});
    scenes.push_back(
        {.name = "plane, outline locked",
         .mesh = make_grid(size, size, [](int x, int y) { return Eigen::Vector3d(x, y, 0.0); }),
         .locked = locked_outline(size, size)});
    scenes.push_back(
        {.name = "hills with noise of a tenth of an edge, outline locked",
         .mesh = make_grid(size, size,
                           [&](int x, int y) {
                               const double z = 6.0 * std::sin(0.11 * x) * std::cos(0.07 * y);
                               return Eigen::Vector3d(x, y, z + random.between(-0.1, 0.1));
                           }),
         .locked = locked_outline(size, size)});
    scenes.push_back({.name = "torus of 10 m and 3 m",
                      .mesh = make_torus(10.0, 3.0, is_quick ? 40 : 200, is_quick ? 12 : 60)});
    bool holds = true;
    for (const Scene& scene : scenes) holds &= measure(scene, per_edge);
    if (!holds) std::printf("FAILED: a measured distance is above its bound\n");
    return holds ? 0 : 1;
}
