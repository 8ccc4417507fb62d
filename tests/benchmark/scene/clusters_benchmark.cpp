// SPDX-License-Identifier: MIT
// What clusters with normal cones save: closed rocks around an eye, drawn in parts and whole. Prints the share of
// triangles that is submitted, and the processor time of a frame, all threads together: medians, in turns.
//
//   clusters_benchmark [--quick]
#include "benchmark/scene/device.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/scene/mesh_clusters.h>

#include <algorithm>
#include <numeric>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kWidth = 640, kHeight = 360;

// Each vertex is its own target: a morph changes nothing, and its triangles are drawn whole.
MeshId add_rock(TerrainRenderer& renderer, const TriangleMesh& rock) {
    std::vector<std::uint32_t> targets(rock.positions.size());
    std::iota(targets.begin(), targets.end(), 0u);
    const MeshLevel level = {rock.triangles, targets};
    return renderer.add_mesh(rock, {&level, 1}).value();
}

// Within the view, at `nearest` to three times that.
std::vector<ObjectInstance> place_rocks(int count, double nearest) {
    test::Random random(7);
    std::vector<ObjectInstance> instances(static_cast<std::size_t>(count));
    for (ObjectInstance& instance : instances) {
        const double distance = nearest * random.between(1.0, 3.0);
        const double x = random.between(-0.7, 0.7), z = random.between(-0.4, 0.4);
        instance.offset_eye = {static_cast<float>(distance * x), static_cast<float>(distance),
                               static_cast<float>(distance * z)};
        const Eigen::Quaterniond q(random.rotation());
        instance.rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                             static_cast<float>(q.z()), static_cast<float>(q.w())};
    }
    return instances;
}

void measure(TerrainRenderer& renderer, int depth, int count, double nearest, int rounds) {
    const TriangleMesh rock = test::make_rock(depth, 5);
    const MeshId id = add_rock(renderer, rock);
    const View view = look_at({0, 0, 0}, {0, 1, 0}, 0.9, kWidth, kHeight).value();
    std::vector<ObjectInstance> instances = place_rocks(count, nearest);
    const MeshDraw all = {id, 0, 0, static_cast<std::uint32_t>(count)};
    std::vector<double> parts_ms, whole_ms;
    double submitted = 0.0;
    for (int round = 0; round < 2 * rounds; ++round) {
        const bool is_parts = round % 2 == 0;
        for (ObjectInstance& instance : instances) instance.coverage = is_parts ? 1.0f : 1.5f;
        const double start = processor_ms();
        draw_objects(renderer, view, {.instances = instances, .meshes = {&all, 1}});
        (is_parts ? parts_ms : whole_ms).push_back(processor_ms() - start);
        const DrawCounts& counts = renderer.counts();
        if (is_parts)
            submitted = 1.0 - static_cast<double>(counts.triangles_culled) /
                                  static_cast<double>(counts.triangles);
    }
    std::printf("%9zu %6d %8.0f %11.1f %9.2f %9.2f %7.1f\n", rock.triangles.size(), count, nearest,
                100.0 * submitted, median(whole_ms), median(parts_ms),
                100.0 * (median(parts_ms) / median(whole_ms) - 1.0));
    renderer.remove_mesh(id);
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "clusters_benchmark [--quick]");
    const bool is_quick = arguments.has("--quick");
    arguments.finish();
    terrane::GlContext context = open_device();
    terrane::TerrainRenderer renderer = make_renderer(context, kWidth, kHeight);
    std::printf("%9s %6s %8s %11s %9s %9s %7s\n", "triangles", "rocks", "from, m", "submitted %",
                "whole ms", "parts ms", "change %");
    for (const int depth : is_quick ? std::vector{3} : std::vector{2, 3, 4, 5}) {
        for (const double nearest : is_quick ? std::vector{5.0} : std::vector{3.0, 10.0, 30.0}) {
            const int count = is_quick ? 20 : std::min(1000, 400'000 / (20 << (2 * depth)));
            measure(renderer, depth, count, nearest, is_quick ? 1 : 15);
        }
    }
    return 0;
}
