// SPDX-License-Identifier: MIT
// Methods of simplification at the same count of triangles: distances and normals on samples of both surfaces, bad
// triangles and time. Exit code 1 where a sample is farther than a certified distance.
#include "comparison_meshes.h"
#include "simplifiers.h"
#include "surface_measure.h"

#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>

namespace terrane::bench {
namespace {

using test::ShapeMesh;

struct Options {
    bool is_quick = false;
    std::string only = {};  // a part of the names of methods
    int runs = 3;
};

Simplified run_simplify(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    Simplified result;
    const SimplifyLevel level{.triangles = triangles};
    std::vector<SimplifiedMesh> levels;
    result.ms = median_ms(runs, [&] {
        levels = simplify({mesh.vertices, mesh.triangles}, {&level, 1}).value();
    });
    result.mesh = {mesh.vertices, std::move(levels[0].triangles)};
    result.certified = levels[0].error_m;
    return result;
}

// With the record of all levels down to the count.
Simplified run_progressive(const ShapeMesh& mesh, std::size_t triangles, int runs) {
    TriangleMesh input;
    input.positions = mesh.vertices;
    input.triangles = mesh.triangles;
    std::optional<ProgressiveMesh> made;
    Simplified result;
    result.ms = median_ms(runs, [&] {
        made.emplace(ProgressiveMesh::create(input, {.least_triangle_count = triangles}).value());
    });
    made->set_triangle_count(triangles);
    result.mesh.vertices = made->finest().positions;
    result.mesh.triangles.assign(made->triangles().begin(), made->triangles().end());
    result.certified = made->error_m();
    return result;
}

bool compare(const char* name, const ShapeMesh& mesh, const Options& options) {
    const std::size_t count = mesh.triangles.size();
    std::printf("%s: %zu triangles\n", name, count);
    std::printf("  %5s %-22s %9s %10s %10s %10s %9s %9s %7s %6s %6s %9s\n", "share", "method",
                "triangles", "certified", "hausdorff", "mean", "normal", "max", "flipped", "folded",
                "flat", "ms");
    bool holds = true;
    for (const double share : {0.5, 0.1, 0.01}) {
        const auto target = static_cast<std::size_t>(share * static_cast<double>(count));
        for (const Simplifier& method : all_simplifiers()) {
            if (method.name.find(options.only) == std::string::npos) continue;
            const Simplified made = method.run(mesh, target, options.runs);
            const SurfaceMeasure m =
                measure_surfaces(mesh, compacted(made.mesh), options.is_quick ? 2'000 : 400'000);
            const bool is_within =
                made.certified < 0.0 || m.hausdorff <= made.certified * (1.0 + 1e-9) + 1e-9;
            holds &= is_within;
            std::printf(
                "  %4.0f%% %-22s %9zu %10.4g %10.4g %10.4g %9.3f %9.2f %7zu %6zu %6zu %9.2f%s\n",
                100.0 * share, method.name.c_str(), made.mesh.triangles.size(), made.certified,
                m.hausdorff, m.mean_distance, m.mean_normal_deg, m.max_normal_deg, m.flipped,
                m.folded, m.degenerate, made.ms, is_within ? "" : "  FAILED");
            std::fflush(stdout);
        }
    }
    return holds;
}

// Time of changes of level: it should depend on the change alone.
void measure_playing(const ShapeMesh& mesh, int runs) {
    TriangleMesh input;
    input.positions = mesh.vertices;
    input.triangles = mesh.triangles;
    ProgressiveMesh made = ProgressiveMesh::create(input).value();
    const auto count = static_cast<double>(mesh.triangles.size());
    std::printf("changes of level, there and back:\n");
    std::printf("  %10s %10s %10s %14s\n", "from", "to", "ms", "ns a triangle");
    for (const double from : {1.0, 0.1, 0.01}) {
        for (const double share : {0.1, 0.01, 0.001}) {
            const auto fine = static_cast<std::size_t>(from * count);
            const auto coarse = static_cast<std::size_t>(from * count - share * from * count);
            made.set_triangle_count(fine);
            constexpr int kRepeats = 20;
            const double ms = median_ms(runs, [&] {
                for (int i = 0; i < kRepeats; ++i) {
                    made.set_triangle_count(coarse);
                    made.set_triangle_count(fine);
                }
            });
            const double one = ms / (2.0 * kRepeats);
            std::printf("  %10zu %10zu %10.5f %14.1f\n", fine, coarse, one,
                        1e6 * one / std::max(1.0, share * from * count));
        }
    }
}

std::string data_folder() {
    const char* folder = std::getenv("TERRANE_DATA");
    return folder != nullptr ? folder : TERRANE_SOURCE_DIR "/../shared/data";
}

}  // namespace

std::vector<Simplifier> all_simplifiers() {
    std::vector<Simplifier> all = {{"simplify()", run_simplify},
                                   {"ProgressiveMesh", run_progressive},
                                   {"vertex decimation", run_vertex_decimation},
                                   {"vertex clustering", run_vertex_clustering}};
#if TERRANE_BENCH_MESHOPTIMIZER
    all.push_back({"meshoptimizer", run_meshoptimizer});
    all.push_back({"meshoptimizer sloppy", run_meshoptimizer_sloppy});
#endif
    return all;
}

}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane;
    using namespace terrane::bench;
    Options options;
    std::string model;
    bool has_terrain = true;
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        const bool has_value = i + 1 < argc;
        if (word == "--quick") {
            options.is_quick = true;
            options.runs = 1;
        } else if (word == "--only" && has_value) {
            options.only = argv[++i];
        } else if (word == "--mesh" && has_value) {
            model = argv[++i];
            has_terrain = false;
        } else {
            std::fprintf(stderr, "usage: %s [--quick] [--only METHOD] [--mesh FILE.obj]\n",
                         argv[0]);
            return 2;
        }
    }
    std::printf("%s\n", describe_machine().c_str());
    bool holds = true;
    if (model.empty()) model = data_folder() + "/models/fcl_env.obj";
    if (const auto mesh = read_obj_mesh(model)) {
        holds &= compare(model.substr(model.rfind('/') + 1).c_str(), *mesh, options);
    } else {
        std::printf("left out: %s cannot be read\n", model.c_str());
    }
    if (has_terrain) {
        const test::ShapeMesh fractal = make_fractal_mesh(options.is_quick ? 40 : 500);
        holds &= compare("fractal of seed 20, cells of 4 m", fractal, options);
        measure_playing(fractal, options.runs);
    }
    if (!holds) std::printf("FAILED: a sample is farther than the certified distance\n");
    return holds ? 0 : 1;
}
