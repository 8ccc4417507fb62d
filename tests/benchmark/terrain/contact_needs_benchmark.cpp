// SPDX-License-Identifier: MIT
//
// Time of ContactNeeds::find() for 200 bodies that move at 60 calls a second over a fractal whose chunks
// have a side of 128 m. Names: where the bodies are, and their largest speed in m/s; radii are those of
// World::needs(). Time is the mean of a call; median_us and p99_us are of single calls.
#include "paging/demand/contact_needs.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

namespace {

using namespace terrane;

constexpr std::size_t kBodies = 200;
constexpr double kHorizon = 4.0;
constexpr double kStep = 1.0 / 60.0;
constexpr int kWarmUp = 120;

/// Bodies that move back and forth in a square, on the ground.
class Herd {
public:
    Herd(const HeightSource& source, double half_side, double most_speed)
        : source_(source), half_side_(half_side), bodies_(kBodies) {
        test::Random random(5);
        for (BodyNeed& body : bodies_) {
            const double speed = random.between(0.0, most_speed);
            const double east = random.between(-1.0, 1.0);
            const double north = std::sqrt(1.0 - east * east) * (random.below(2) == 0 ? 1.0 : -1.0);
            body.centre_world = {random.between(-half_side, half_side),
                                 random.between(-half_side, half_side), 0.0};
            body.velocity = {speed * east, speed * north, 0.0};
            body.radius = 1.0 + 0.1 * speed;
            stand(body);
        }
    }

    std::span<const BodyNeed> bodies() const { return bodies_; }

    void step() {
        for (BodyNeed& body : bodies_) {
            if (body.velocity.isZero()) continue;
            for (int axis = 0; axis < 2; ++axis) {
                if (std::abs(body.centre_world[axis]) > half_side_ &&
                    body.centre_world[axis] * body.velocity[axis] > 0.0) {
                    body.velocity[axis] = -body.velocity[axis];
                }
            }
            body.centre_world += kStep * body.velocity;
            stand(body);
        }
    }

private:
    void stand(BodyNeed& body) {
        body.centre_world.z() = 1.0 + source_.height(body.centre_world.x(), body.centre_world.y());
    }

    const HeightSource& source_;
    double half_side_;
    std::vector<BodyNeed> bodies_;
};

void measure(benchmark::State& state, double half_side, double most_speed) {
    const auto source = FractalHeights::create({.seed = 7}).value();
    internal::ContactNeeds needs(*source, source->lattice().finest_level);
    Herd herd(*source, half_side, most_speed);
    double time_s = 0.0;
    const auto find = [&] {
        needs.find(herd.bodies(), {}, time_s, kHorizon);
        time_s += kStep;
    };
    for (int i = 0; i < kWarmUp; ++i, herd.step()) find();
    std::vector<double> seconds;
    double entries = 0.0;
    for (auto _ : state) {
        herd.step();
        const auto begin = std::chrono::steady_clock::now();
        find();
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
        state.SetIterationTime(taken.count());
        seconds.push_back(taken.count());
        entries += static_cast<double>(needs.entries().size());
    }
    std::sort(seconds.begin(), seconds.end());
    const auto count = static_cast<double>(seconds.size());
    state.counters["median_us"] = 1e6 * seconds[seconds.size() / 2];
    state.counters["p99_us"] = 1e6 * seconds[seconds.size() * 99 / 100];
    state.counters["entries"] = entries / count;
}

}  // namespace

BENCHMARK_CAPTURE(measure, clustered_0, 500.0, 0.0)->UseManualTime();
BENCHMARK_CAPTURE(measure, clustered_30, 500.0, 30.0)->UseManualTime();
BENCHMARK_CAPTURE(measure, clustered_300, 500.0, 300.0)->UseManualTime();
BENCHMARK_CAPTURE(measure, scattered_0, 50'000.0, 0.0)->UseManualTime();
BENCHMARK_CAPTURE(measure, scattered_30, 50'000.0, 30.0)->UseManualTime();
BENCHMARK_CAPTURE(measure, scattered_300, 50'000.0, 300.0)->UseManualTime();
