// SPDX-License-Identifier: MIT
//
// What plain vertices and indices of a frame cost, beside the frame itself: 100,000 triangles over a fractal, morphing.
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/mesh_buffers.h>
#include <terrane/terrain/pager.h>

#include <benchmark/benchmark.h>

#include <vector>

namespace terrane {
namespace {

// Frames of a flight at 60 m/s and 60 Hz, with everything resident that they need.
struct Flight {
    std::shared_ptr<const HeightSource> source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 100'000, .max_error_px = 0.1}).value();
    CameraNeed camera;
    int frame = 0;

    TerrainMesh next(double speed) {
        const WorldPos eye(0.0, speed * frame++ / 60.0, 900.0);
        camera.view = look_at(eye, eye + Eigen::Vector3d(0, 4000, -700), 1.0, 1280, 720).value();
        pager.update({&camera, 1}, {}, frame / 60.0);
        const TerrainMesh mesh = triangulator.update(pager.resident(), camera.view);
        camera.threshold_px = mesh.threshold_px;
        return mesh;
    }
    explicit Flight(double speed) {
        for (int i = 0; i < 60; ++i) next(speed);
    }
};

void triangulator_update(benchmark::State& state) {
    Flight flight(60.0);
    for (auto _ : state) {
        state.PauseTiming();
        const View view = flight.camera.view;
        const auto resident = flight.pager.resident();
        flight.next(60.0);
        state.ResumeTiming();
        benchmark::DoNotOptimize(flight.triangulator.update(resident, view));
    }
}

void mesh_buffers_update(benchmark::State& state) {
    const auto speed = static_cast<double>(state.range(0));
    Flight flight(speed);
    MeshBuffers buffers = MeshBuffers::create().value();
    std::size_t triangles = 0, bytes = 0, changed_bytes = 0;
    for (auto _ : state) {
        state.PauseTiming();
        const TerrainMesh mesh = flight.next(speed);
        triangles += mesh.triangle_count;
        state.ResumeTiming();
        buffers.update(mesh, flight.camera.view.eye_world);
        state.PauseTiming();
        for (const MeshPart& part : buffers.parts()) {
            const std::size_t of_part = part.vertices.size_bytes() + part.indices.size_bytes();
            bytes += of_part;
            changed_bytes += part.change == PartChange::same ? 0 : of_part;
        }
        state.ResumeTiming();
    }
    const auto frames = static_cast<double>(state.iterations());
    state.counters["triangles"] = static_cast<double>(triangles) / frames;
    state.counters["bytes"] = static_cast<double>(bytes) / frames;
    state.counters["changed_share"] =
        static_cast<double>(changed_bytes) / static_cast<double>(bytes);
}

void expand_whole(benchmark::State& state) {
    Flight flight(60.0);
    const TerrainMesh mesh = flight.next(60.0);
    for (auto _ : state) benchmark::DoNotOptimize(expand_mesh(mesh));
    state.counters["triangles"] = static_cast<double>(mesh.triangle_count);
}

BENCHMARK(triangulator_update)->Unit(benchmark::kMillisecond);
BENCHMARK(mesh_buffers_update)->Arg(0)->Arg(60)->Unit(benchmark::kMillisecond);
BENCHMARK(expand_whole)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace terrane
