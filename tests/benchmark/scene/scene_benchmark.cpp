// SPDX-License-Identifier: MIT
// Objects of a scene without drawing: culling of boxes, and a frame's levels under a budget.
#include "scene/culling/random_views.h"
#include "scene/objects/random_scene.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/scene.h>

#include <benchmark/benchmark.h>

namespace terrane {
namespace {

using test::Random;

constexpr double kHalfSide = 5000.0;

std::vector<Aabb> boxes_of(const std::vector<PlacedObject>& objects) {
    std::vector<Aabb> boxes;
    for (const PlacedObject& object : objects)
        boxes.push_back({object.position_world - Eigen::Vector3d(2, 2, 0),
                         object.position_world + Eigen::Vector3d(2, 2, 8)});
    return boxes;
}

// A camera that turns on its place by a hundredth of a turn a frame.
View turning_view(int frame, double vertical_fov) {
    View view;
    view.eye_world = {0.0, 0.0, 60.0};
    const double angle = 0.0628 * frame;
    view.forward = Eigen::Vector3d(std::cos(angle), std::sin(angle), -0.1).normalized();
    view.up =
        view.forward.cross(Eigen::Vector3d(std::sin(angle), -std::cos(angle), 0.0)).normalized();
    if (view.up.z() < 0.0) view.up = -view.up;
    view.vertical_fov = vertical_fov;
    return view;
}

// 100,000 objects. A vertical field of view of 0.35 shows a tenth of those around the eye.
void cull_objects(benchmark::State& state) {
    Random random(1);
    const std::vector<Aabb> boxes = boxes_of(test::spread_objects(random, 100'000, kHalfSide));
    const CullTree tree(boxes);
    CullMemory memory;
    std::vector<std::uint32_t> visible;
    std::size_t visible_sum = 0, frames = 0;
    const auto test = state.range(0) == 0 ? CullTest::planes : CullTest::exact;
    for (auto _ : state) {
        const ViewVolume volume(turning_view(static_cast<int>(frames++), 0.35));
        tree.cull(volume, test, memory, visible);
        visible_sum += visible.size();
    }
    state.counters["visible_share"] =
        static_cast<double>(visible_sum) / static_cast<double>(frames * boxes.size());
}
BENCHMARK(cull_objects)->ArgName("exact")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

// The same without a hierarchy, for the ratio.
void cull_objects_one_by_one(benchmark::State& state) {
    Random random(1);
    const std::vector<Aabb> boxes = boxes_of(test::spread_objects(random, 100'000, kHalfSide));
    std::size_t frames = 0, visible = 0;
    for (auto _ : state) {
        const ViewVolume volume(turning_view(static_cast<int>(frames++), 0.35));
        for (const Aabb& box : boxes) {
            PlaneState all;
            if (volume.test_planes(box, all) == Containment::outside) continue;
            visible += state.range(0) == 0 || volume.meets(box) ? 1u : 0u;
        }
    }
    benchmark::DoNotOptimize(visible);
}
BENCHMARK(cull_objects_one_by_one)->ArgName("exact")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

// 200,000 trees and 20,000 rocks, as a frame of 1280 x 720 with a vertical field of view of 60 degrees has them.
void choose_levels(benchmark::State& state) {
    Random random(2);
    Scene scene = Scene::create({}).value();
    const ModelId tree = scene.add_model(test::tree_model()).value();
    const ModelId rock = scene.add_model(test::rock_model()).value();
    benchmark::DoNotOptimize(
        scene.add_group(tree, test::spread_objects(random, 200'000, kHalfSide)).has_value());
    benchmark::DoNotOptimize(
        scene.add_group(rock, test::spread_objects(random, 20'000, kHalfSide)).has_value());
    std::size_t frames = 0, in_view = 0, triangles = 0;
    for (auto _ : state) {
        const std::span<const TriangleDemand> demands =
            scene.begin_frame(turning_view(static_cast<int>(frames++), 1.0471975511965976), 1.0);
        // as a triangulator would: what fits into half a million triangles
        std::size_t granted = 0;
        double threshold_px = 1.0;
        for (const TriangleDemand& demand : demands) {
            if (demand.threshold_px <= threshold_px) break;
            granted += demand.triangles;
            if (granted > 500'000) threshold_px = demand.threshold_px;
        }
        scene.end_frame(threshold_px);
        in_view += scene.counts().in_view;
        triangles += scene.counts().triangles;
    }
    state.counters["in_view"] = static_cast<double>(in_view) / static_cast<double>(frames);
    state.counters["triangles"] = static_cast<double>(triangles) / static_cast<double>(frames);
}
BENCHMARK(choose_levels)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace terrane

BENCHMARK_MAIN();
