// SPDX-License-Identifier: MIT
//
// What Triangulator::update() costs a frame on one thread: flights over a fractal, everything resident, morphing. The
// reference is a bare loop that writes as many triangles of a regular grid, timed after each frame.
#include "benchmark/bench.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

namespace terrane::bench {
namespace {

constexpr double kFrame_s = 1.0 / 60.0;
constexpr double kSpeed = 60.0;
constexpr int kFirst = 90;  // frames before the first that is timed

struct Flight {
    const char* name;
    double turn;  // tangent of the direction's change a frame
};
constexpr std::array<Flight, 2> kFlights{Flight{"forward", 0.0}, Flight{"turning", 0.015}};

View view_at(const Flight& flight, int frame) {
    const WorldPos eye(0.0, kSpeed * kFrame_s * frame, 900.0);
    // turns to one side and back
    const int of_turn = frame % 120;
    const double beside = flight.turn * (of_turn < 60 ? of_turn : 120 - of_turn);
    return look_at(eye, eye + Eigen::Vector3d(4000.0 * beside, 4000.0, -700.0), 1.0, 1280, 720)
        .value();
}

// Writes the triangles of squares of 2 x 2 cells, eight each, of a grid of 129 x 129 samples.
template <typename Index>
void emit_grid(std::size_t triangle_count, Index* out) {
    constexpr Index kRow = 129;
    constexpr Index kSquares = 64;
    for (std::size_t square = 0; 8 * square < triangle_count; ++square) {
        const auto column = static_cast<Index>(square % kSquares);
        const auto row = static_cast<Index>(square / kSquares % kSquares);
        const auto south = static_cast<Index>(2 * row * kRow + 2 * column);
        const auto middle = static_cast<Index>(south + kRow),
                   north = static_cast<Index>(middle + kRow);
        const auto centre = static_cast<Index>(middle + 1);
        const Index around[] = {south,
                                static_cast<Index>(south + 1),
                                static_cast<Index>(south + 2),
                                static_cast<Index>(middle + 2),
                                static_cast<Index>(north + 2),
                                static_cast<Index>(north + 1),
                                north,
                                middle};
        for (std::size_t k = 0; k < 8; ++k) {
            *out++ = around[k];
            *out++ = around[(k + 1) % 8];
            *out++ = centre;
        }
    }
}

template <typename Index>
double emit_ms(std::size_t triangle_count, std::vector<Index>& indices) {
    indices.resize(3 * (triangle_count + 8));
    const Stopwatch watch(Clock::thread);
    emit_grid(triangle_count, indices.data());
    asm volatile("" : : "r"(indices.data()) : "memory");
    return watch.ms();
}

void play(const Flight& flight, std::size_t budget, int frames) {
    const std::shared_ptr<const HeightSource> source = FractalHeights::create({.seed = 7}).value();
    Pager pager = value_or_exit(
        Pager::create(source, {.memory_bytes = std::size_t{3} << 30, .worker_count = 0}));
    Triangulator triangulator = value_or_exit(
        Triangulator::create(*source, {.triangle_budget = budget, .max_error_px = 0.05}));
    CameraNeed camera;
    std::vector<double> ms, emit_short_ms, emit_long_ms;
    std::vector<std::uint16_t> short_indices;
    std::vector<std::uint32_t> long_indices;
    for (int frame = 0; frame < kFirst + frames; ++frame) {
        camera.view = view_at(flight, frame);
        pager.update({&camera, 1}, {}, kFrame_s * frame);
        pager.finish();
        const std::shared_ptr<const ResidentSet> resident = pager.resident();
        const Stopwatch watch(Clock::thread);
        const TerrainMesh mesh = triangulator.update(resident, camera.view);
        const double frame_ms = watch.ms();
        camera.threshold_px = mesh.threshold_px;
        const double short_ms = emit_ms(mesh.triangle_count, short_indices);
        const double long_ms = emit_ms(mesh.triangle_count, long_indices);
        if (frame < kFirst) continue;
        ms.push_back(frame_ms);
        emit_short_ms.push_back(short_ms);
        emit_long_ms.push_back(long_ms);
    }
    const double middle = median(ms), late = quantile(ms, 0.99);
    const double short_ms = median(emit_short_ms), long_ms = median(emit_long_ms);
    std::printf("%-8s %9zu %8.2f %8.2f %6.2f %10.3f %6.1f %10.3f %6.1f\n", flight.name, budget,
                middle, late, late / middle, short_ms, middle / short_ms, long_ms,
                middle / long_ms);
}

int run(int count, char** words) {
    Arguments arguments(
        count, words, "triangulator_benchmark [--frames N] [--only forward|turning] [budgets...]");
    const int frames = arguments.number("--frames", 1, 1e6, 300);
    Choice choice(arguments.text("--only", ""), Choice::Match::whole);
    std::vector<double> budgets = arguments.numbers("a budget", 1e3, 1e8);
    if (budgets.empty()) budgets = {1e5, 1e6};
    std::printf("%s\n", describe_machine().c_str());
    std::printf("%-8s %9s %8s %8s %6s %10s %6s %10s %6s\n", "flight", "triangles", "ms", "p99 ms",
                "ratio", "emit16 ms", "times", "emit32 ms", "times");
    for (const Flight& flight : kFlights) {
        if (!choice.has(flight.name)) continue;
        for (const double budget : budgets) play(flight, static_cast<std::size_t>(budget), frames);
    }
    choice.finish(arguments);
    return 0;
}

}  // namespace
}  // namespace terrane::bench

int main(int count, char** words) { return terrane::bench::run(count, words); }
