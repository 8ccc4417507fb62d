// SPDX-License-Identifier: MIT
//
// Time of a step of many bodies, beside Bullet's world on the same heights where it is found: a thousand mixed bodies
// dropped on the contact terrain, and the same poured into a pit of 30 m. Sleeping off, 1/60 s a step, one thread by
// default; mean and median over ten seconds.
//
//   bodies_benchmark [--quick] [--alone] [--count N] [--workers N] [--only SCENE] [--seconds T]
//
// --quick: few bodies for a second, as ctest runs it. --alone: without Bullet. --only: `dropped` or `heap`.
//
// Exits with 1 if a body of ours ever penetrated the ground by more than its tolerance.
#include "benchmark/collision/contact_workload.h"
#include "benchmark/machine.h"

#include <terrane/collision/world.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>

#ifdef TERRANE_BENCH_BULLET
#include "benchmark/collision/body_peers.h"
#endif

namespace terrane::bench {
namespace {

constexpr double kStep = 1.0 / 60.0;
// As in `terrane drop`.
const std::array<Shape, 3> kShapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{1.0, 2.0, 0.5}}};

struct Options {
    std::size_t count = 1000;
    double seconds = 10.0;
    int workers = 1;
    bool alone = false;
    std::string_view only;
};

struct Times {
    std::vector<double> ms;
    double mean() const {
        double sum = 0.0;
        for (const double one : ms) sum += one;
        return sum / static_cast<double>(ms.size());
    }
};

World make_world(const BodyDrop& drop, int workers, bool measure_depth) {
    Result<World> world = World::create(
        {.allow_sleep = false, .measure_depth = measure_depth, .worker_count = workers});
    for (std::size_t i = 0; i < drop.states.size(); ++i) {
        if (!world || !world->add(drop.settings[i], drop.states[i])) std::abort();
    }
    return std::move(*world);
}

/// Whether no body fell through. The steps that are timed measure no depths, as those of the peer do not; the same
/// steps are taken once more to count bodies that fell, and must have the same bits.
bool measure(const char* scene, const ContactMap& map, const BodyDrop& drop,
             const Options& options) {
    const auto step_count = static_cast<int>(options.seconds / kStep);
    World world = make_world(drop, options.workers, false);
    Times ours;
    std::uint64_t fell = 0, pairs = 0;
    // A thread's clock does not include its workers.
    const Clock clock = options.workers > 1 ? Clock::wall : Clock::thread;
    for (int step = 0; step < step_count; ++step) {
        const Stopwatch stopwatch(clock);
        const StepReport report = world.step(map.ground, kStep);
        ours.ms.push_back(stopwatch.ms());
        pairs += report.touching_pairs;
    }
    World judged = make_world(drop, options.workers, true);
    for (int step = 0; step < step_count; ++step) fell += judged.step(map.ground, kStep).too_deep;
    const bool is_same = judged.state_hash() == world.state_hash();
    if (!is_same) std::printf("%s: measuring depths has changed the bodies' states\n", scene);
    std::printf(
        "%-9s %6zu  Terrane  mean %8.3f  median %8.3f ms a step, %llu fell, %.0f pairs touch\n",
        scene, drop.states.size(), ours.mean(), median(ours.ms),
        static_cast<unsigned long long>(fell), static_cast<double>(pairs) / step_count);
#ifdef TERRANE_BENCH_BULLET
    if (!options.alone) {
        BodiesPeer peer(map.table);
        for (std::size_t i = 0; i < drop.states.size(); ++i) {
            peer.add(drop.settings[i], drop.states[i]);
        }
        Times theirs;
        for (int step = 0; step < step_count; ++step) {
            const Stopwatch stopwatch(clock);
            peer.step(kStep);
            theirs.ms.push_back(stopwatch.ms());
        }
        std::size_t below = 0;
        for (std::size_t i = 0; i < drop.states.size(); ++i) {
            const WorldPos place = peer.pose(i).translation;
            const HeightAnswer ground = map.ground.height(place.x(), place.y());
            if (ground.status != QueryStatus::ok || place.z() < ground.height) ++below;
        }
        std::printf(
            "%-9s %6zu  %-8s mean %8.3f  median %8.3f ms a step, %zu ended below; %.2f x, %.2f x\n",
            scene, drop.states.size(), BodiesPeer::name().c_str(), theirs.mean(), median(theirs.ms),
            below, theirs.mean() / ours.mean(), median(theirs.ms) / median(ours.ms));
    }
#endif
    return fell == 0 && is_same;
}

/// A cone of 45 degrees down to a floor, 30 m deep.
test::HeightTable make_pit(int side) {
    test::HeightTable table;
    table.columns = table.rows = side;
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const double r = std::hypot(column - 0.5 * (side - 1), row - 0.5 * (side - 1));
            table.heights.push_back(static_cast<float>(std::clamp(r - 40.0, -30.0, 0.0)));
        }
    }
    return table;
}

std::optional<Options> parse(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        const char* const value = i + 1 < argc ? argv[i + 1] : nullptr;
        if (argument == "--quick") {
            options.count = 60;
            options.seconds = 1.0;
        } else if (argument == "--alone") {
            options.alone = true;
        } else if (value == nullptr) {
            return std::nullopt;
        } else if (argument == "--count") {
            options.count = std::strtoul(value, nullptr, 10);
            ++i;
        } else if (argument == "--workers") {
            options.workers = std::atoi(value);
            ++i;
        } else if (argument == "--seconds") {
            options.seconds = std::atof(value);
            ++i;
        } else if (argument == "--only") {
            options.only = value;
            ++i;
        } else {
            return std::nullopt;
        }
    }
    const bool is_fine =
        options.count > 0 && options.seconds >= kStep && options.workers >= 1 &&
        options.workers <= 64 &&
        (options.only.empty() || options.only == "dropped" || options.only == "heap");
    return is_fine ? std::optional(options) : std::nullopt;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane::bench;
    const std::optional<Options> options = parse(argc, argv);
    if (!options) {
        std::fprintf(stderr,
                     "bodies_benchmark [--quick] [--alone] [--count N] [--workers N] "
                     "[--only dropped|heap] [--seconds T]\n");
        return 2;
    }
    std::printf("%s\n", describe_machine().c_str());
    bool is_fine = true;
    if (options->only != "heap") {
        const ContactMap map = make_contact_map(1025, 1.0);
        const double half_width = 3.0 * std::sqrt(static_cast<double>(options->count));
        const BodyDrop drop =
            lay_out_drop(map, kShapes, options->count, std::min(half_width, 480.0), 6.0);
        is_fine = measure("dropped", map, drop, *options) && is_fine;
    }
    if (options->only != "dropped") {
        const ContactMap map = make_map(make_pit(257));
        const BodyDrop drop = lay_out_drop(map, kShapes, options->count, 14.0, 4.7);
        is_fine = measure("heap", map, drop, *options) && is_fine;
    }
    return is_fine ? 0 : 1;
}
