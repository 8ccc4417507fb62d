// SPDX-License-Identifier: MIT
#include "flight.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

namespace terrane::bench {
namespace {

constexpr double kSpeed = 100.0;
constexpr double kFramesPerSecond = 60.0;
constexpr double kAltitude = 100.0;
constexpr double kPitch = -10.0 * std::numbers::pi / 180.0;
constexpr double kHeading = 0.6;  // radians from east
constexpr double kTurnRate = 0.5 * std::numbers::pi;

template <class T>
T value_or_exit(Result<T> result) {
    if (result) return std::move(*result);
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(1);
}

// Weighted mean of the ground 200 m around, along the flight.
double smooth_ground(const HeightSource& source, double x, double y) {
    double sum = 0.0, weights = 0.0;
    for (int i = -20; i <= 20; ++i) {
        const double weight = 21.0 - std::abs(i);
        sum += weight *
               source.height(x + 10.0 * i * std::cos(kHeading), y + 10.0 * i * std::sin(kHeading));
        weights += weight;
    }
    return sum / weights;
}

}  // namespace

BenchmarkGround make_map_ground(int side) {
    BenchmarkGround ground;
    ground.name = "fBm map " + std::to_string(side) + "^2, 1 m";
    ground.table = std::make_shared<const test::TableHeights>(test::make_fbm_table(side));
    ground.source = ground.table;
    ground.start_x = 0.25 * side;
    ground.start_y = 0.3 * side;
    ground.far_m = side;
    return ground;
}

BenchmarkGround make_fractal_ground() {
    BenchmarkGround ground;
    ground.name = "fractal, 2097 km, 12.5 cm";
    ground.source =
        value_or_exit(FractalHeights::create({.finest_spacing_log2 = -3, .root_size_log2 = 20}));
    ground.start_x = 3000.0;
    ground.start_y = 2000.0;
    ground.far_m = 30'000.0;
    return ground;
}

View flight_view(const BenchmarkGround& ground, const FlightPlan& plan, int frame) {
    const double distance = kSpeed / kFramesPerSecond * frame;
    const double x = ground.start_x + distance * std::cos(kHeading);
    const double y = ground.start_y + distance * std::sin(kHeading);
    const double turned =
        kTurnRate / kFramesPerSecond * std::max(0, frame - plan.straight_frames + 1);
    const WorldPos eye(x, y, smooth_ground(*ground.source, x, y) + kAltitude);
    const Eigen::Vector3d ahead(std::cos(kHeading + turned) * std::cos(kPitch),
                                std::sin(kHeading + turned) * std::cos(kPitch), std::sin(kPitch));
    return value_or_exit(look_at(eye, eye + 1000.0 * ahead, std::numbers::pi / 3.0, 1920, 1080));
}

TriangulatorSettings settings_for(std::size_t triangles, int threads) {
    // a target that no budget reaches, so that the budget decides
    TriangulatorSettings settings;
    settings.triangle_budget = triangles;
    settings.max_error_px = 1e-3;
    settings.worker_count = threads;
    return settings;
}

TerrainMesh settle(Pager& pager, Triangulator& triangulator, const View& view, double time_s) {
    double wanted = 256.0;
    for (;;) {
        const CameraNeed camera{.view = view, .threshold_px = wanted};
        pager.update({&camera, 1}, {}, time_s);
        pager.finish();
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        if (mesh.threshold_px >= wanted || wanted < 1e-6) return mesh;
        wanted = std::max(mesh.threshold_px, 0.5 * wanted);
    }
}

std::vector<FlightFrame> fly(const BenchmarkGround& ground, const FlightPlan& plan,
                             const TriangulatorSettings& settings, std::size_t memory_bytes,
                             Clock clock) {
    Pager pager = value_or_exit(
        Pager::create(ground.source, {.memory_bytes = memory_bytes, .worker_count = 0}));
    Triangulator triangulator = value_or_exit(Triangulator::create(*ground.source, settings));
    // the frame before the first, so that the first one follows something
    View view = flight_view(ground, plan, -1);
    double threshold_px = settle(pager, triangulator, view, 0.0).threshold_px;
    std::vector<FlightFrame> frames;
    for (int frame = 0; frame < plan.frames(); ++frame) {
        FlightFrame made;
        made.view = flight_view(ground, plan, frame);
        const Eigen::Vector3d velocity = kFramesPerSecond * (made.view.eye_world - view.eye_world);
        view = made.view;
        const CameraNeed camera{.view = view, .velocity = velocity, .threshold_px = threshold_px};
        pager.update({&camera, 1}, {}, (frame + 1) / kFramesPerSecond);
        made.resident = pager.resident();
        const Stopwatch watch(clock);
        const TerrainMesh mesh = triangulator.update(made.resident, view);
        made.ms = watch.ms();
        made.triangles = mesh.triangle_count;
        made.error_px = mesh.error_px;
        threshold_px = mesh.threshold_px;
        frames.push_back(std::move(made));
    }
    return frames;
}

}  // namespace terrane::bench
