// SPDX-License-Identifier: MIT
// A forest behind hills: the cost of a horizon map, and what it saves, from eyes at several heights above the ground.
#include "scene/horizon/hill_world.h"
#include "scene/objects/random_scene.h"

#include <terrane/scene/horizon_map.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>

#include <benchmark/benchmark.h>

#include <cmath>
#include <map>

namespace terrane {
namespace {

using test::Random;

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
        WorldPos& p = object.position_world;
        p.z() = source->height(p.x(), p.y());
    }
    benchmark::DoNotOptimize(scene.add_group(tree, trees).has_value());
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
