// SPDX-License-Identifier: MIT
//
// Objects of a scene without drawing: culling of boxes, and a frame's levels under a budget.
#include "scene/random_scene.h"
#include "scene/scene_cases.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>

#include <benchmark/benchmark.h>

#include <cmath>
#include <map>

namespace terrane {
namespace {

using test::Random;

constexpr double kHalfSide = 5000.0;

std::vector<Aabb> boxes_of(const std::vector<PlacedObject>& objects) {
    std::vector<Aabb> boxes;
    for (const PlacedObject& object : objects)
        boxes.push_back({object.position - Eigen::Vector3d(2, 2, 0),
                         object.position + Eigen::Vector3d(2, 2, 8)});
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
        test::add_instances(scene, tree, test::spread_objects(random, 200'000, kHalfSide))
            .has_value());
    benchmark::DoNotOptimize(
        test::add_instances(scene, rock, test::spread_objects(random, 20'000, kHalfSide))
            .has_value());
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

// A forest behind hills: the cost of a horizon map, and what it saves, from eyes at several heights above the ground.

constexpr double kForestHalfSide = 4000.0;                // of the forest
constexpr int kTrees = 200'000;                           // 3125 a square kilometre
constexpr GroundError kGroundError{.refinable_px = 2.0};  // of the drawn ground
constexpr double kSmallestTree_px = 1.0;                  // no smaller one is drawn

struct Forest {
    std::shared_ptr<const HeightSource> source;
    std::shared_ptr<const ResidentSet> resident;
    Scene scene;
};

Forest make_forest() {
    auto source = FractalHeights::create({.seed = 12,
                                          .octave_count = 11,
                                          .amplitude = 250.0,
                                          .wavelength_log2 = 11,
                                          .root_size_log2 = 13})
                      .value();
    // finer chunks nearer to the middle, as a pager has them
    const Lattice& lattice = source->lattice();
    auto resident = test::resident_chunks(*source, lattice.finest_level, [&](const ChunkKey& key) {
        const double side = lattice.level_spacing(key.level) * kChunkCells;
        const auto distance = [&](double corner) {
            return std::max({corner, -(corner + side), 0.0});
        };
        return std::hypot(distance(key.x * side), distance(key.y * side)) < 2.0 * side;
    });
    Scene scene = Scene::create({}).value();
    const ModelId tree = scene.add_model(test::tree_model()).value();
    Random random(3);
    std::vector<PlacedObject> trees = test::spread_objects(random, kTrees, kForestHalfSide);
    for (PlacedObject& object : trees) {
        WorldPos& p = object.position;
        p.z() = source->height(p.x(), p.y());
    }
    benchmark::DoNotOptimize(test::add_instances(scene, tree, trees).has_value());
    return {std::move(source), std::move(resident), std::move(scene)};
}

Forest& forest() {
    static Forest forest = make_forest();
    return forest;
}

// A camera near the middle that turns on its place, looking slightly down.
View horizon_view(std::size_t frame, double above_ground) {
    const double turn = 0.7853981633974483 * static_cast<double>(frame % 8);
    WorldPos eye(13.0, 7.0, 0.0);
    eye.z() = forest().source->height(eye.x(), eye.y()) + above_ground;
    return test::view_along(eye, {std::cos(turn), std::sin(turn)}, -0.1, 0.0);
}

void horizon_map(benchmark::State& state) {
    const Forest& hills = forest();  // made before the clock starts
    HorizonMap horizon;
    std::size_t frame = 0;
    for (auto _ : state) {
        const View view = horizon_view(frame++, static_cast<double>(state.range(0)));
        horizon.build(hills.resident, view, kGroundError);
    }
}
BENCHMARK(horizon_map)
    ->ArgName("above_ground_m")
    ->Arg(2)
    ->Arg(20)
    ->Arg(100)
    ->Arg(400)
    ->Unit(benchmark::kMicrosecond);

// Culling and levels, the map included where there is one.
void horizon_frame(benchmark::State& state) {
    Scene& scene = forest().scene;
    HorizonMap horizon;
    std::size_t frame = 0, drawn = 0, triangles = 0, occluded = 0;
    const bool has_map = state.range(1) != 0;
    for (auto _ : state) {
        const View view = horizon_view(frame++, static_cast<double>(state.range(0)));
        if (has_map) horizon.build(forest().resident, view, kGroundError);
        benchmark::DoNotOptimize(
            scene.begin_frame(view, kSmallestTree_px, {}, has_map ? &horizon : nullptr).data());
        scene.end_frame(kSmallestTree_px);
        drawn += scene.counts().drawn;
        triangles += scene.counts().triangles;
        occluded += scene.counts().occluded;
    }
    const auto mean = [&](std::size_t sum) {
        return static_cast<double>(sum) / static_cast<double>(frame);
    };
    state.counters["drawn"] = mean(drawn);
    state.counters["triangles"] = mean(triangles);
    state.counters["occluded"] = mean(occluded);
}
BENCHMARK(horizon_frame)
    ->ArgNames({"above_ground_m", "map"})
    ->ArgsProduct({{2, 20, 100, 400}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace terrane

BENCHMARK_MAIN();
