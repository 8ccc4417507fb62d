// SPDX-License-Identifier: MIT
//
// Time of a frame's mesh, compared with a plain loop that stores as many indices and with top-down refinement at the
// same budget and view. Then the same flights again, untimed, to check every frame. Figures are only printed; a
// frame that violates a guarantee ends the program with 1.
#include "benchmark/machine.h"
#include "benchmark/replay.h"
#include "references/reference_meshes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string_view>

namespace terrane::bench {
namespace {

struct Options {
    bool quick = false;
    bool check = true;
    Clock clock = Clock::wall;
    std::vector<std::size_t> budgets;
    int threads = 1;
    int check_every = 0;  // 0: every frame, but with --quick one in eight of budgets above 1e5
    std::uint64_t seed = 1;
};

constexpr const char* kUsage =
    "usage: triangulator_benchmark [--quick] [--triangles N] [--threads N] [--check-every N]\n"
    "                              [--no-check] [--cpu-time] [--seed N]\n"
    "  --quick          small map, short flights, budgets 1e4 and 1e5\n"
    "  --triangles N    this budget alone; may be repeated\n"
    "  --threads N      of the triangulator\n"
    "  --check-every N  look at one replayed frame of N\n"
    "  --no-check       times only\n"
    "  --cpu-time       processor time of the calling thread, for a busy machine\n"
    "  --seed N         of the points that are measured\n";

std::optional<std::uint64_t> number(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

std::optional<Options> parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string_view name = arguments[i];
        if (name == "--quick") {
            options.quick = true;
            continue;
        }
        if (name == "--cpu-time") {
            options.clock = Clock::thread;
            continue;
        }
        if (name == "--no-check") {
            options.check = false;
            continue;
        }
        const auto value = i + 1 < count ? number(arguments[i + 1]) : std::nullopt;
        if (!value) return std::nullopt;
        ++i;
        if (name == "--triangles" && *value >= 8) {
            options.budgets.push_back(*value);
        } else if (name == "--threads" && *value >= 1 && *value <= 256) {
            options.threads = static_cast<int>(*value);
        } else if (name == "--check-every" && *value >= 1 && *value <= 1000) {
            options.check_every = static_cast<int>(*value);
        } else if (name == "--seed") {
            options.seed = *value;
        } else {
            return std::nullopt;
        }
    }
    if (options.budgets.empty()) {
        options.budgets = {10'000, 100'000};
        if (!options.quick) options.budgets.insert(options.budgets.end(), {1'000'000, 4'000'000});
    }
    return options;
}

/// Nearest rank.
double percentile(std::vector<double> values, double share) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    const double rank = std::ceil(share * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
}

// Two triangles a cell, row after row, chunk after chunk.
[[gnu::noinline]] void store_triangles(std::uint16_t* out, std::size_t triangles) {
    std::size_t pairs = triangles / 2;
    for (int row = 0; pairs > 0; row = (row + 1) % kChunkCells) {
        const std::size_t count = std::min<std::size_t>(pairs, kChunkCells);
        auto south = static_cast<std::uint16_t>(row * kChunkSamples);
        auto north = static_cast<std::uint16_t>(south + kChunkSamples);
        for (std::size_t i = 0; i < count; ++i, ++south, ++north, out += 6) {
            out[0] = south;
            out[1] = static_cast<std::uint16_t>(south + 1);
            out[2] = static_cast<std::uint16_t>(north + 1);
            out[3] = south;
            out[4] = static_cast<std::uint16_t>(north + 1);
            out[5] = north;
        }
        pairs -= count;
    }
}

double loop_ms(std::size_t triangles, Clock clock) {
    constexpr int kRuns = 40;
    std::vector<std::uint16_t> indices(3 * triangles + 6);
    double best = 1e30;
    for (int run = 0; run < kRuns; ++run) {
        const Stopwatch watch(clock);
        store_triangles(indices.data(), triangles);
        best = std::min(best, watch.ms());
    }
    return best;
}

double soar_ms(const test::TableHeights& table, const std::vector<FlightFrame>& frames,
               std::size_t budget, Clock clock) {
    test::SoarReference soar(table);
    const std::size_t most = budget > 500'000 ? 5 : 15;
    const std::size_t stride = std::max<std::size_t>(1, frames.size() / most);
    soar.refine_to_budget(frames.front().view, budget);  // finds its bracket
    std::vector<double> times;
    for (std::size_t i = 0; i < frames.size(); i += stride) {
        const Stopwatch watch(clock);
        soar.refine_to_budget(frames[i].view, budget);
        times.push_back(watch.ms());
    }
    return percentile(times, 0.5);
}

void print_head() {
    std::printf("\n%-26s %9s %9s %8s %8s %8s %8s %8s | %9s %9s %9s | %8s\n", "ground", "budget",
                "used", "median", "p99", "turning", "loop", "SOAR", "ours/loop", "p99/med",
                "SOAR/ours", "error px");
    std::printf("%-26s %9s %9s %8s %8s %8s %8s %8s | %9s %9s %9s | %8s\n", "", "", "", "ms", "ms",
                "p99 ms", "ms", "ms", "", "", "", "median");
}

int run(const BenchmarkGround& ground, const FlightPlan& plan, const Options& options,
        std::size_t budget) {
    constexpr std::size_t kAmple = std::size_t{8} << 30;
    const TriangulatorSettings settings = settings_for(budget, options.threads);
    const std::vector<FlightFrame> frames = fly(ground, plan, settings, kAmple, options.clock);
    std::vector<double> straight, turning, used, errors;
    for (int i = 0; i < plan.frames(); ++i) {
        const FlightFrame& frame = frames[static_cast<std::size_t>(i)];
        (plan.is_turning(i) ? turning : straight).push_back(frame.ms);
        used.push_back(static_cast<double>(frame.triangles));
        errors.push_back(frame.error_px);
    }
    const double median = percentile(straight, 0.5), p99 = percentile(straight, 0.99);
    const auto least_used = static_cast<std::size_t>(percentile(used, 0.0));
    const double loop = loop_ms(budget, options.clock);
    const double soar = ground.table ? soar_ms(*ground.table, frames, budget, options.clock) : 0.0;
    std::printf("%-26s %9zu %9zu %8.3f %8.3f %8.3f %8.4f ", ground.name.c_str(), budget, least_used,
                median, p99, percentile(turning, 0.99), loop);
    if (ground.table) {
        std::printf("%8.2f | %9.2f %9.2f %9.2f", soar, median / loop, p99 / median, soar / median);
    } else {
        std::printf("%8s | %9.2f %9.2f %9s", "-", median / loop, p99 / median, "-");
    }
    std::printf(" | %8.3f\n", percentile(errors, 0.5));
    std::fflush(stdout);
    if (!options.check) return 0;

    ReplaySettings how{.seed = options.seed};
    if (options.check_every > 0) {
        how.check_every = options.check_every;
    } else if (options.quick && budget > 100'000) {
        how.check_every = 8;
    }
    const ReplayReport report = replay(ground, settings, frames, how);
    std::printf(
        "    replay: %d of %d frames checked, %zu points, seed %llu: over budget %d, flawed %d, "
        "not reproduced %d, uncertified %d (measured/certified at most %.3f),\n"
        "    pops over 0.5 px %zu (largest %.3f px in %d frames at 1.5 px; elsewhere %.3f "
        "px)%s%s\n",
        report.checked, report.frames, report.points, static_cast<unsigned long long>(options.seed),
        report.over_budget, report.flawed, report.not_reproduced, report.uncertified,
        report.worst_ratio, report.pops, report.worst_pop_px, report.bounded_frames,
        report.worst_move_px, report.first_fault.empty() ? "" : "\n    VIOLATION, first in ",
        report.first_fault.c_str());
    std::fflush(stdout);
    return report.violations();
}

int run_all(const Options& options) {
    constexpr int kQuickSide = 513, kSide = 4097;
    const FlightPlan plan = options.quick ? FlightPlan{30, 15} : FlightPlan{};
    std::printf("%s\n", describe_machine().c_str());
    std::printf(
        "Triangulator::update() alone, %s, %d thread%s, everything resident; %d frames straight at "
        "100 m/s and 60 frames/s, %d turning at 90 degrees/s; 1920 x 1080, 60 degrees\n",
        options.clock == Clock::wall ? "wall time" : "time of the calling thread", options.threads,
        options.threads == 1 ? "" : "s", plan.straight_frames, plan.turning_frames);
    std::printf(
        "loop: plain stores of as many 16-bit indices, least of 40 runs; SOAR: from scratch, "
        "32-bit indices, same budget and view, median\n");
    print_head();
    int violations = 0;
    for (const BenchmarkGround& ground :
         {make_map_ground(options.quick ? kQuickSide : kSide), make_fractal_ground()}) {
        for (const std::size_t budget : options.budgets) {
            violations += run(ground, plan, options, budget);
        }
    }
    std::printf("\n%d violations\n", violations);
    return violations == 0 ? 0 : 1;
}

}  // namespace
}  // namespace terrane::bench

int main(int count, char** arguments) {
    const auto options = terrane::bench::parse(count, arguments);
    if (!options) {
        std::fputs(terrane::bench::kUsage, stderr);
        return 2;
    }
    return terrane::bench::run_all(*options);
}
