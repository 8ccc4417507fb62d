// SPDX-License-Identifier: MIT
//
// A frame's triangles from the device beside those from the CPU: a flight over a fractal, morphing, everything
// resident. Times of the device include waiting for it.
#include <terrane/render/gpu_triangulator.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <benchmark/benchmark.h>
#include <epoxy/gl.h>

namespace terrane {
namespace {

// Frames of a flight at 60 m/s and 60 Hz.
struct Flight {
    std::shared_ptr<const HeightSource> source = FractalHeights::create({.seed = 7}).value();
    Pager pager =
        Pager::create(source, {.memory_bytes = std::size_t{2} << 30, .worker_count = 0}).value();
    TriangulatorSettings settings;
    Triangulator cpu;
    CameraNeed camera;
    int frame = 0;

    explicit Flight(std::size_t budget)
        : settings{.triangle_budget = budget, .max_error_px = 0.05},
          cpu(Triangulator::create(*source, settings).value()) {
        for (int i = 0; i < 90; ++i) next();
    }
    void next() {
        const WorldPos eye(0.0, 1.0 * frame++, 900.0);
        camera.view = look_at(eye, eye + Eigen::Vector3d(0, 4000, -700), 1.0, 1280, 720).value();
        pager.update({&camera, 1}, {}, frame / 60.0);
        pager.finish();
        camera.threshold_px = cpu.update(pager.resident(), camera.view).threshold_px;
    }
};

void cpu_update(benchmark::State& state) {
    Flight flight(static_cast<std::size_t>(state.range(0)));
    std::size_t triangles = 0;
    for (auto _ : state) {
        state.PauseTiming();
        flight.next();
        state.ResumeTiming();
        triangles = flight.cpu.update(flight.pager.resident(), flight.camera.view).triangle_count;
    }
    state.counters["triangles"] = static_cast<double>(triangles);
}

void gpu_update(benchmark::State& state) {
    const GlContext context = GlContext::create().value();
    Flight flight(static_cast<std::size_t>(state.range(0)));
    GpuTriangulator gpu = GpuTriangulator::create(context, *flight.source, flight.settings).value();
    std::size_t uploaded = 0;
    (void)gpu.update(flight.pager.resident(), flight.camera.view);
    for (auto _ : state) {
        state.PauseTiming();
        flight.next();
        state.ResumeTiming();
        if (!gpu.update(flight.pager.resident(), flight.camera.view)) state.SkipWithError("update");
        glFinish();
        uploaded = gpu.uploaded_bytes();
    }
    state.counters["areas"] = static_cast<double>(gpu.area_count());
    state.counters["uploaded_bytes"] = static_cast<double>(uploaded);
    state.counters["device_bytes"] = static_cast<double>(gpu.device_bytes());
    state.counters["triangles"] = static_cast<double>(gpu.read().value().triangle_count);
}

BENCHMARK(cpu_update)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(gpu_update)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace terrane
