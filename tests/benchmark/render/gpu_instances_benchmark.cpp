// SPDX-License-Identifier: MIT
//
// Culling instances and choosing their levels on the device beside the CPU: trees and rocks around an eye that turns.
// Times of the device include waiting for it; the column CPU is this thread's alone.
#include "objects/gpu_instances.h"
#include "scene/random_scene.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <utility>

namespace terrane {
namespace {

View turning_view(int frame) {
    const double angle = 0.37 * frame;
    return look_at({0.0, 0.0, 30.0}, {100.0 * std::cos(angle), 100.0 * std::sin(angle), 20.0},
                   1.0471975511965976, 1280, 720)
        .value();
}

// Frames with a threshold of 1 px, in which smaller objects are not drawn.
void choose_levels(benchmark::State& state, bool is_on_device) {
    GlContext context = GlContext::create().value();
    TerrainRenderer renderer = TerrainRenderer::create(context, 64, 64, {}).value();
    test::Random random(2);
    Scene scene = Scene::create({}).value();
    const auto count = static_cast<int>(state.range(0));
    for (const auto& [model, objects] :
         {std::pair{test::tree_model(), count}, std::pair{test::rock_model(), count / 10}}) {
        const ModelId id = scene.add_model(model).value();
        if (!test::add_instances(scene, id, test::spread_objects(random, objects, 4000.0)))
            state.SkipWithError("add");
    }
    const auto* device = dynamic_cast<internal::GpuInstances*>(renderer.instance_device().value());
    if (is_on_device) scene.set_device(renderer.instance_device().value());
    int frame = 0;
    const auto make = [&] {
        const View view = turning_view(frame++);
        (void)scene.begin_frame(view, 1.0);
        return scene.end_frame(1.0);
    };
    for (int i = 0; i < 17; ++i) (void)make();  // all around: all objects are on the device
    std::size_t in_view = 0, instances = 0, sent = 0, read = 0, frames = 0;
    for (auto _ : state) {
        const SceneDraws draws = make();
        in_view += scene.counts().in_view;
        instances += is_on_device ? draws.device->count : draws.instances.size();
        sent += is_on_device ? device->sent_bytes() : draws.instances.size_bytes();
        read += is_on_device ? device->read_bytes() : 0;
        ++frames;
    }
    const auto mean = [&](std::size_t sum) {
        return static_cast<double>(sum) / static_cast<double>(frames);
    };
    state.counters["in_view"] = mean(in_view);
    state.counters["instances"] = mean(instances);
    state.counters["sent_bytes"] = mean(sent);
    state.counters["read_bytes"] = mean(read);
    if (is_on_device) state.counters["device_bytes"] = static_cast<double>(device->bytes());
}

BENCHMARK_CAPTURE(choose_levels, cpu, false)
    ->Arg(200'000)
    ->Arg(1'000'000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(choose_levels, device, true)
    ->Arg(200'000)
    ->Arg(1'000'000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace terrane
