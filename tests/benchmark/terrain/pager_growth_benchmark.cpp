// SPDX-License-Identifier: MIT
//
// What Pager::update() costs, and what ground takes in memory, as the number of bodies grows: 1 to 10,000 bodies spread
// over a world, without a camera. They roll over the ground, first while their ground arrives from simulated storage,
// then with all of it resident. Chunks are copies of one chunk for each level, so that memory is as it would be; the
// time in which they are made is not counted.
#include "benchmark/bench.h"

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace terrane::bench {
namespace {

constexpr double kFrame_s = 1.0 / 60.0;
constexpr int kSteadyFrames = 600;
constexpr int kMostFrames = 60'000;
constexpr double kSpeed = 3.0;

// Bodies at random places that roll in random directions.
class Bodies {
public:
    Bodies(const HeightSource& source, std::size_t count) : source_(source), needs_(count) {
        std::mt19937_64 random(count);
        const auto draw = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
        const WorldRect& extent = source.extent();
        for (BodyNeed& need : needs_) {
            const double x = extent.west + draw() * (extent.east - extent.west);
            const double y = extent.south + draw() * (extent.north - extent.south);
            const double angle = 6.283185307179586 * draw();
            need.velocity = {kSpeed * std::cos(angle), kSpeed * std::sin(angle), 0.0};
            need.centre_world = {x, y, 0.0};
        }
        move(0.0);
    }

    void move(double seconds) {
        for (BodyNeed& need : needs_) {
            WorldPos& at = need.centre_world;
            at += seconds * need.velocity;
            at.z() = source_.height(at.x(), at.y()) + need.radius;
        }
    }

    const std::vector<BodyNeed>& needs() const { return needs_; }

private:
    const HeightSource& source_;
    std::vector<BodyNeed> needs_;
};

// Chunks of a source with the content of one chunk of their level.
class Copies {
public:
    explicit Copies(const HeightSource& source) : source_(source) {}

    Result<std::shared_ptr<const Chunk>> make(const ChunkKey& key) {
        const Stopwatch watch(Clock::thread);
        std::shared_ptr<const Chunk>& model = models_[key.level];
        if (!model) {
            TERRANE_TRY(model, make_chunk(source_, {0, 0, key.level}));
        }
        auto copy = std::make_shared<Chunk>(*model);
        copy->key = key;
        copy->corner = source_.lattice().corner(key);
        ms_ += watch.ms();
        return std::shared_ptr<const Chunk>(std::move(copy));
    }

    double ms() const { return ms_; }

private:
    const HeightSource& source_;
    std::map<int, std::shared_ptr<const Chunk>> models_;
    double ms_ = 0.0;
};

struct Figures {
    std::vector<double> arriving_ms, steady_ms;
    double arrival_s = 0.0;
    PagerStats stats;
};

Figures play(const std::shared_ptr<const HeightSource>& source, std::size_t count,
             double bandwidth) {
    Copies copies(*source);
    const VirtualStorage storage{.latency = 0.005, .bandwidth = bandwidth, .slots = 16};
    auto loader = value_or_exit(
        VirtualLoader::create(storage, [&](const ChunkKey& key) { return copies.make(key); }));
    Pager pager = value_or_exit(
        Pager::create(source, {.memory_bytes = std::size_t{64} << 30}, std::move(loader)));
    Figures figures;
    Bodies bodies(*source, count);
    int frame = 0;
    const auto update = [&] {
        bodies.move(kFrame_s);
        const double made_ms = copies.ms();
        const Stopwatch watch(Clock::thread);
        pager.update({}, bodies.needs(), kFrame_s * ++frame);
        return watch.ms() - (copies.ms() - made_ms);
    };
    do {
        figures.arriving_ms.push_back(update());
        figures.stats = pager.stats();
    } while (frame < kMostFrames &&
             (frame < 4 || figures.stats.late_chunks > 0 || figures.stats.in_flight_bytes > 0));
    figures.arrival_s = kFrame_s * frame;
    for (int i = 0; i < kSteadyFrames; ++i) figures.steady_ms.push_back(update());
    return figures;
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

int run(Arguments arguments) {
    const bool is_quick = arguments.has("--quick");
    const auto most = arguments.number<std::size_t>("--most", 1, 1e6, is_quick ? 100 : 10'000);
    const auto bandwidth = 1e6 * arguments.number("--bandwidth-mb", 1, 1e6, 1000.0);
    arguments.finish();
    const auto source = value_or_exit(FractalHeights::create({.seed = 7}));
    std::printf("%s\n\n%8s %8s | %27s | %27s | %8s %9s %9s\n", describe_machine().c_str(), "", "",
                "ms while ground arrives", "ms afterwards", "arrived", "chunks", "MB");
    std::printf("%8s %8s | %8s %8s %9s | %8s %8s %9s | %8s %9s %9s\n", "bodies", "loads", "mean",
                "p99", "most", "mean", "p99", "most", "s", "per body", "per body");
    for (std::size_t count = 1; count <= most; count *= 10) {
        const Figures figures = play(source, count, bandwidth);
        const auto bodies = static_cast<double>(count);
        std::printf("%8zu %8llu | %8.3f %8.3f %9.3f | %8.3f %8.3f %9.3f | %8.2f %9.2f %9.3f\n",
                    count, static_cast<unsigned long long>(figures.stats.loaded),
                    mean(figures.arriving_ms), quantile(figures.arriving_ms, 0.99),
                    quantile(figures.arriving_ms, 1.0), mean(figures.steady_ms),
                    quantile(figures.steady_ms, 0.99), quantile(figures.steady_ms, 1.0),
                    figures.arrival_s, static_cast<double>(figures.stats.resident_chunks) / bodies,
                    1e-6 * static_cast<double>(figures.stats.resident_bytes) / bodies);
    }
    return 0;
}

}  // namespace
}  // namespace terrane::bench

int main(int count, char** words) {
    return terrane::bench::run(
        {count, words, "pager_growth_benchmark [--quick] [--most N] [--bandwidth-mb N]"});
}
