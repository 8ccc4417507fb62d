// SPDX-License-Identifier: MIT
//
// What Pager::update() costs a frame: a camera over a fractal, 200 bodies on the ground around it, 2000
// resident chunks and storage that needs no time of its own. The flight is played twice; the second
// time all chunks are made already, so that what is timed is the pager alone.
#include "benchmark/bench.h"

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <vector>

namespace terrane::bench {
namespace {

constexpr int kFrames = 600;
constexpr double kFrame_s = 1.0 / 60.0;
constexpr int kBodies = 200;
constexpr std::size_t kChunks = 2000;

using Cache = std::map<ChunkKey, std::shared_ptr<const Chunk>>;

// Straight on, then 45 degrees a second to the left and back.
struct Flight {
    double speed = 0.0;
    bool turns = false;
};

struct Figures {
    std::vector<double> us;
    std::size_t most_chunks = 0;
};

View view_at(const HeightSource& source, const Flight& flight, int frame) {
    const double distance = flight.speed * kFrame_s * frame;
    View view;
    view.eye_world = {distance, 0.0, 0.0};
    view.eye_world.z() = source.interval({-500.0, -500.0, 500.0, 500.0}).high + 200.0;
    Eigen::Vector3d look(1.0, 0.0, -0.2);
    if (flight.turns)
        look.y() = 1.5 * (frame % 240 < 120 ? frame % 120 : 120 - frame % 120) / 120.0;
    view.forward = look.normalized();
    const Eigen::Vector3d right = Eigen::Vector3d(look.y(), -look.x(), 0.0).normalized();
    view.up = {right.y() * view.forward.z() - right.z() * view.forward.y(),
               right.z() * view.forward.x() - right.x() * view.forward.z(),
               right.x() * view.forward.y() - right.y() * view.forward.x()};
    return view;
}

Figures play(const std::shared_ptr<const HeightSource>& source, const Flight& flight,
             double threshold_px, Cache& cache) {
    const auto make = [&](const ChunkKey& key) -> Result<std::shared_ptr<const Chunk>> {
        std::shared_ptr<const Chunk>& held = cache[key];
        if (!held) {
            auto made = make_chunk(*source, key);
            if (!made) return made;
            held = *made;
        }
        return held;
    };
    auto loader = VirtualLoader::create({.latency = 0.005, .bandwidth = 1e8, .slots = 16}, make);
    Pager pager =
        Pager::create(source, {.memory_bytes = kChunks * Chunk::max_bytes()}, std::move(*loader))
            .value();
    Figures figures;
    std::vector<BodyNeed> bodies(kBodies);
    std::shared_ptr<const ResidentSet> held;  // as a triangulator does
    for (int frame = 0; frame < kFrames; ++frame) {
        const View view = view_at(*source, flight, frame);
        const Eigen::Vector3d velocity(flight.speed, 0.0, 0.0);
        for (int i = 0; i < kBodies; ++i) {
            BodyNeed& body = bodies[static_cast<std::size_t>(i)];
            const double x = view.eye_world.x() + 40.0 * (i % 20 - 10);
            const double y = 60.0 * (i / 20 - 5);
            body = {.centre_world = {x, y, source->height(x, y) + 1.0}, .velocity = velocity};
        }
        const std::vector<CameraNeed> cameras{
            {.view = view, .velocity = velocity, .threshold_px = threshold_px}};
        if (frame == 0) {
            pager.update(cameras, bodies, 0.0);
            pager.finish();
        }
        const Stopwatch watch(Clock::thread);
        pager.update(cameras, bodies, kFrame_s * (frame + 1));
        figures.us.push_back(1000.0 * watch.ms());
        held = pager.resident();
        figures.most_chunks = std::max(figures.most_chunks, held->chunks().size());
    }
    return figures;
}

int run() {
    const auto source = FractalHeights::create({.seed = 7}).value();
    std::printf("%10s %6s %10s %8s %10s %10s %10s\n", "threshold", "m/s", "turning", "chunks",
                "median us", "p99 us", "most us");
    for (const double threshold_px : {2.0, 0.4}) {
        for (const Flight& flight : {Flight{0.0, false}, Flight{100.0, false}, Flight{100.0, true},
                                     Flight{300.0, false}}) {
            Cache cache;
            play(source, flight, threshold_px, cache);
            const Figures figures = play(source, flight, threshold_px, cache);
            std::printf("%10.2f %6.0f %10s %8zu %10.0f %10.0f %10.0f\n", threshold_px, flight.speed,
                        flight.turns ? "yes" : "no", figures.most_chunks, median(figures.us),
                        quantile(figures.us, 0.99), quantile(figures.us, 1.0));
        }
    }
    return 0;
}

}  // namespace
}  // namespace terrane::bench

int main() { return terrane::bench::run(); }
