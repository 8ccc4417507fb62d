// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "source/source_checks.h"

#include <terrane/terrain/check_source.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <utility>

namespace terrane {
namespace {

using internal::CheckRandom;
using internal::GridAnswers;
using internal::SourceChecks;

constexpr int kGridPoints = 9;
constexpr std::size_t kThreads = 4;       // threads that call the source at once
constexpr std::size_t kThreadGrids = 64;  // grids that each thread reads

Result<void> check(const SourceCheckSettings& settings) {
    for (const Result<void>& good : {check_range("places", settings.places, 1, 1'000'000),
                                     check_range("points", settings.points, 1, 1'000'000)}) {
        if (!good) return good;
    }
    if (settings.first_level < 0 || settings.last_level < settings.first_level) {
        return fail(ErrorCode::invalid_argument,
                    "first_level and last_level must rise from 0, got " +
                        std::to_string(settings.first_level) + " and " +
                        std::to_string(settings.last_level));
    }
    if (!(settings.nesting_slack >= 1.0 && std::isfinite(settings.nesting_slack))) {
        return fail(ErrorCode::invalid_argument, "nesting_slack must be at least 1, got " +
                                                     std::to_string(settings.nesting_slack));
    }
    return {};
}

WorldRect overlap(const WorldRect& a, const WorldRect& b) {
    return {std::max(a.west, b.west), std::max(a.south, b.south), std::min(a.east, b.east),
            std::min(a.north, b.north)};
}

bool is_area(const WorldRect& rect) {
    return rect.west < rect.east && rect.south < rect.north && std::isfinite(rect.west) &&
           std::isfinite(rect.south) && std::isfinite(rect.east) && std::isfinite(rect.north);
}

// Chooses the grids of one spacing that are checked.
class Places {
public:
    Places(const Lattice& lattice, const WorldRect& region, std::uint64_t seed)
        : random_(seed),
          low_{index(region.west, lattice.origin_x, lattice.spacing),
               index(region.south, lattice.origin_y, lattice.spacing)},
          high_{index(region.east, lattice.origin_x, lattice.spacing),
                index(region.north, lattice.origin_y, lattice.spacing)},
          lattice_(lattice) {}

    // Cycles through four grids at the corners of the region, four on its edges and four inside it.
    SampleGrid next(std::int64_t step) {
        const int place = count_++ % 12;
        const bool at_west = place == 0 || place == 2, at_east = place == 1 || place == 3;
        const bool at_south = place == 0 || place == 1, at_north = place == 2 || place == 3;
        const auto [x, columns] = along(step, low_.x, high_.x, lattice_.west(), lattice_.east(),
                                        at_west || place == 4, at_east || place == 5);
        const auto [y, rows] = along(step, low_.y, high_.y, lattice_.south(), lattice_.north(),
                                     at_south || place == 6, at_north || place == 7);
        return {{x, y}, step, columns, rows};
    }

private:
    static std::int64_t index(double place, double origin, double spacing) {
        return static_cast<std::int64_t>(std::floor((place - origin) / spacing));
    }

    // First index and number of points of a grid along one axis. Grids at an edge, unless coarser than the root level,
    // are shifted outward by two steps: beyond the world they then include all samples that chunks read.
    std::pair<std::int64_t, int> along(std::int64_t step, std::int64_t low, std::int64_t high,
                                       std::int64_t world_low, std::int64_t world_high, bool at_low,
                                       bool at_high) {
        const std::int64_t side = 2 * step;
        const auto floor_to = [&](std::int64_t i) { return i - ((i % side) + side) % side; };
        const auto points = static_cast<int>(
            std::min<std::int64_t>(kGridPoints, (world_high - world_low) / step + 1));
        const std::int64_t reach = (points - 1) * step;
        const std::int64_t beyond = step <= lattice_.step(0) ? side : 0;
        const std::int64_t first = std::max(floor_to(low), world_low);
        const std::int64_t last = std::max(first, std::min(floor_to(high), world_high - reach));
        if (at_low) return {first - beyond, points};
        if (at_high) return {last + beyond, points};
        return {floor_to(random_.integer(first, last)), points};
    }

    CheckRandom random_;
    LatticePoint low_, high_;
    Lattice lattice_;
    int count_ = 0;
};

// Checks intervals over squares and rectangles of various sizes, and rises over two distances.
void check_ranges(SourceChecks& checks, const Lattice& lattice, const WorldRect& region,
                  std::int64_t step, int places, CheckRandom& random) {
    const double spacing = lattice.spacing * static_cast<double>(step);
    const int level = internal::level_of(lattice, step);
    for (int place = 0; place < places; ++place) {
        // alternately squares of a chunk's size and rectangles of any shape
        const double width = place % 2 == 0 ? kChunkCells * spacing : random.between(0.0, spacing);
        const double depth = place % 2 == 0 ? width : random.between(0.0, 10.0 * spacing);
        const double x = random.between(region.west, region.east);
        const double y = random.between(region.south, region.north);
        checks.check_interval(overlap({x, y, x + width, y + depth}, region), level);
    }
    checks.check_rise(spacing, level);
    checks.check_rise(random.between(0.5, 8.0) * spacing, level);
}

// Reads all grids again, in reverse order; then up to kThreadGrids on each of several threads, in different orders.
void check_repeats(const HeightSource& source, const SourceCheckSettings& settings,
                   const WorldRect& region, const std::vector<GridAnswers>& answered,
                   SourceChecks& checks) {
    for (std::size_t i = answered.size(); i-- > 0;) {
        checks.check_again(answered[i], SourceLaw::repeatable);
    }
    // violations of repeatability are not reported a second time for threads
    if (checks.report().of(SourceLaw::repeatable).broken > 0) return;
    std::vector<SourceChecks> parts(kThreads, SourceChecks(source, settings, region));
    {
        std::vector<std::jthread> threads;
        for (std::size_t thread = 0; thread < kThreads; ++thread) {
            threads.emplace_back([&, thread] {
                const std::size_t count = std::min(answered.size(), kThreadGrids);
                for (std::size_t i = 0; i < count; ++i) {
                    // 37 is coprime to 64, so that each of 64 grids occurs once
                    const std::size_t next = (37 * i + 11 * thread) % count;
                    const std::size_t spread = next * answered.size() / count;
                    parts[thread].check_again(answered[spread], SourceLaw::threads);
                }
            });
        }
    }
    for (const SourceChecks& part : parts) checks.add(part.report());
}

}  // namespace

Result<SourceReport> check_source(const HeightSource& source, const SourceCheckSettings& settings) {
    TERRANE_TRY(check(settings));
    const Lattice& lattice = source.lattice();
    SourceChecks nothing(source, settings, {});
    const Result<void> good_lattice = lattice.validate();
    const bool is_good = good_lattice.has_value() && is_area(source.extent());
    nothing.count(SourceLaw::valid_lattice, is_good, [&] {
        SourceViolation violation;
        violation.what =
            good_lattice ? "the extent is empty or not finite" : good_lattice.error().message;
        return violation;
    });
    if (!is_good) return nothing.report();

    const WorldRect world{lattice.x(lattice.west()), lattice.y(lattice.south()),
                          lattice.x(lattice.east()), lattice.y(lattice.north())};
    const WorldRect ground = overlap(world, source.extent());
    const WorldRect region = settings.region ? overlap(ground, *settings.region) : ground;
    if (!is_area(region)) {
        return fail(ErrorCode::invalid_argument,
                    "the region to check has no area inside the source's world and extent");
    }
    SourceChecks checks(source, settings, region);
    checks.add(nothing.report());
    Places places(lattice, region, settings.seed);
    CheckRandom random(settings.seed ^ 0x5bd1e995u);
    std::vector<GridAnswers> answered;
    const int first = std::min(settings.first_level, lattice.finest_level);
    const int last = std::min(settings.last_level, lattice.finest_level);
    const std::int64_t coarsest = first == 0 ? lattice.chunk_side(0) / 2 : lattice.step(first);
    for (std::int64_t step = lattice.step(last); step <= coarsest; step *= 2) {
        for (int place = 0; place < settings.places; ++place) {
            GridAnswers answers;
            if (!checks.ask(places.next(step), answers)) continue;
            checks.check_values(answers);
            checks.check_bounds(answers);
            checks.check_nesting_within(answers);
            checks.check_window(answers);
            checks.check_mesh_bounds(answers);
            checks.check_levels(answers);
            checks.check_nesting_below(answers);
            answered.push_back(std::move(answers));
        }
        check_ranges(checks, lattice, region, step, std::min(settings.places, 32), random);
    }
    check_repeats(source, settings, region, answered, checks);
    return checks.report();
}

namespace {

constexpr std::array<std::string_view, kSourceLawCount> kNames{
    "valid_lattice", "answers",     "finite",     "fits_quanta", "height",     "vertex_bound",
    "cell_bound",    "nesting",     "no_vertex",  "interval",    "rise_bound", "window",
    "levels",        "mesh_bounds", "repeatable", "threads"};
static_assert(static_cast<std::size_t>(SourceLaw::threads) + 1 == kSourceLawCount);

}  // namespace

std::string_view name_of(SourceLaw law) { return kNames[static_cast<std::size_t>(law)]; }

bool SourceReport::is_clean() const { return violations() == 0; }

std::uint64_t SourceReport::checks() const {
    std::uint64_t sum = 0;
    for (const SourceLawReport& law : laws) sum += law.checks;
    return sum;
}

std::uint64_t SourceReport::violations() const {
    std::uint64_t sum = 0;
    for (const SourceLawReport& law : laws) sum += law.broken;
    return sum;
}

std::string to_text(const SourceReport& report) {
    char line[192];
    std::snprintf(line, sizeof line, "%llu checks with seed %llu, %llu violations; ",
                  static_cast<unsigned long long>(report.checks()),
                  static_cast<unsigned long long>(report.seed),
                  static_cast<unsigned long long>(report.violations()));
    std::string text = line;
    std::snprintf(line, sizeof line, "deviations reach %.3g of their bounds\n", report.tightest);
    text += line;
    for (std::size_t i = 0; i < kSourceLawCount; ++i) {
        const SourceLawReport& law = report.laws[i];
        if (law.broken == 0) continue;
        std::snprintf(line, sizeof line, "%s: broken in %llu of %llu checks\n",
                      std::string(kNames[i]).c_str(), static_cast<unsigned long long>(law.broken),
                      static_cast<unsigned long long>(law.checks));
        text += line;
        for (const SourceViolation& v : law.worst) {
            std::snprintf(line, sizeof line,
                          "  at (%.6g, %.6g) m, level %d: claimed %.6g, measured %.6g: ", v.x, v.y,
                          v.level, v.claimed, v.measured);
            text += line + v.what + "\n";
        }
    }
    return text;
}

}  // namespace terrane
