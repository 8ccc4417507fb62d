// SPDX-License-Identifier: MIT
#include "support/grounds.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>

namespace terrane::check_source_test {

using namespace test;

/// The promise that a BrokenHeights breaks.
enum class Breach {
    none,
    vertex_bounds,      ///< all are `factor` times the right ones
    cell_bounds,        ///< the same for cells
    bounds_in_a_patch,  ///< both, but only between 1000 and 3000 m east and north
    midpoint_bounds,    ///< of midpoints only: above those of the centres if the factor exceeds 2
    one_spacing,        ///< only bounds of vertices of step 8
    corner_bounds,      ///< points that are not vertices have a bound
    interval,           ///< the upper end is wrong
    interval_upside_down,
    rise,
    rise_falls,     ///< the bound decreases with distance
    neighbour,      ///< sample() returns the height of the next column
    wide_windows,   ///< the last bit differs in grids of more than 12 columns
    coarse_levels,  ///< the last bit differs in samples of step 16 and more
    mesh_bounds,    ///< mesh_bounds() and vertex_bounds() round differently
    second_time,    ///< the last bit differs when a grid is repeated
    other_threads,  ///< only the thread that made the source gets correct answers
    nan_sample,     ///< one sample beyond 30 km
    nan_bound,
    single_precision,  ///< heights beyond 50 km are rounded to float
    too_high,          ///< heights above the range of 32-bit quanta
    read_error,        ///< grids beyond 30 km fail
    exception,         ///< grids beyond 30 km throw
    height_throws,     ///< height() throws a number beyond 30 km
    mesh_throws,       ///< mesh_bounds() throws a number
    bad_quantum,
    no_extent,
};

constexpr double kCurvature = 1e-4;  // 1 / m
constexpr double kHalfWorld = 65536.0;

Lattice make_lattice(Breach breach) {
    Lattice lattice{.finest_level = 9};
    lattice.first_root_x = lattice.first_root_y = -1;
    lattice.root_count_x = lattice.root_count_y = 2;
    lattice.quantum = breach == Breach::bad_quantum ? 0.3 : 0x1p-10;  // holds 430 km in the corners
    return lattice;
}

WorldRect make_extent(Breach breach) {
    if (breach == Breach::no_extent) return {0.0, 0.0, 0.0, 0.0};
    return {-kHalfWorld, -kHalfWorld, kHalfWorld, kHalfWorld};
}

std::uint64_t this_thread() { return std::hash<std::thread::id>()(std::this_thread::get_id()); }

// One float upwards, which covers the rounding of the formula.
float round_up(double bound) {
    return std::nextafter(static_cast<float>(bound), std::numeric_limits<float>::infinity());
}

/// A bowl, z = curvature / 2 (x^2 + y^2), whose bounds, intervals and rises are exact: an error of one per cent breaks
/// a promise.
///
/// The world is 131 km wide around the origin, with 1 m between samples.
class BrokenHeights final : public HeightSource {
public:
    /// @param factor by which the broken value is wrong, where it is a number
    explicit BrokenHeights(Breach breach, double factor = 1.0)
        : HeightSource(make_lattice(breach), make_extent(breach)),
          breach_(breach),
          factor_(factor),
          maker_(this_thread()) {}

    double height(double x, double y) const override {
        const double z = bowl_at(x, y);
        if (x > 30'000.0 && breaks(Breach::height_throws)) throw 7;
        if (breaks(Breach::single_precision) && std::max(std::abs(x), std::abs(y)) > 50'000.0) {
            return static_cast<double>(static_cast<float>(z));
        }
        return breaks(Breach::too_high) ? z + 1e6 : z;
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        const bool is_far = lattice().x(grid.corner.x) > 30'000.0;
        if (is_far && breaks(Breach::read_error)) return fail(ErrorCode::io, "the disk is gone");
        if (is_far && breaks(Breach::exception)) throw std::runtime_error("no such tile");
        const bool has_other_bits = (breaks(Breach::wide_windows) && grid.columns > 12) ||
                                    (breaks(Breach::coarse_levels) && grid.step >= 16) ||
                                    (breaks(Breach::second_time) && was_asked(grid)) ||
                                    (breaks(Breach::other_threads) && maker_ != this_thread());
        const std::int64_t shift = breaks(Breach::neighbour) ? grid.step : 0;
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                const double x = lattice().x(grid.corner.x + column * grid.step + shift);
                const double y = lattice().y(grid.corner.y + row * grid.step);
                heights_out[i] = breaks(Breach::height_throws) ? bowl_at(x, y) : height(x, y);
                if (has_other_bits) heights_out[i] = std::nextafter(heights_out[i], 1e9);
            }
        }
        if (is_far && breaks(Breach::nan_sample)) heights_out[i / 2] = std::nan("");
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const auto s = static_cast<double>(grid.step);
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                const bool is_centre = (column & row & 1) != 0;
                // the surface deviates most at the middle of the split edge: curvature / 8 edge^2
                double bound = (is_centre ? 1.0 : 0.5) * kCurvature * s * s + 2e-9;
                if (breaks(Breach::vertex_bounds)) bound *= factor_;
                if (breaks(Breach::midpoint_bounds) && !is_centre) bound *= factor_;
                if (breaks(Breach::one_spacing) && grid.step == 8) bound *= factor_;
                if (breaks(Breach::nan_bound) && i == 5) bound = std::nan("");
                bound *= factor_at(grid, column, row);
                const bool is_vertex = ((column | row) & 1) != 0;
                bounds_out[i] = is_vertex || breaks(Breach::corner_bounds) ? round_up(bound) : 0.0f;
            }
        }
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        const auto s = static_cast<double>(grid.step);
        std::size_t i = 0;
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column, ++i) {
                double bound = 0.25 * kCurvature * s * s + 1e-9;
                if (breaks(Breach::cell_bounds)) bound *= factor_;
                bounds_out[i] = round_up(bound * factor_at(grid, column, row));
            }
        }
        return {};
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        if (breaks(Breach::mesh_throws)) throw 7;
        const Result<void> made =
            HeightSource::mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
        if (made && breaks(Breach::mesh_bounds)) {
            vertex_bounds_out[1] = std::nextafter(vertex_bounds_out[1], 1e9f);
        }
        return made;
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const auto square = [](double value) { return value * value; };
        const double near_x = std::clamp(0.0, rect.west, rect.east);
        const double near_y = std::clamp(0.0, rect.south, rect.north);
        const double far_x = std::max(std::abs(rect.west), std::abs(rect.east));
        const double far_y = std::max(std::abs(rect.south), std::abs(rect.north));
        const double low = 0.5 * kCurvature * (square(near_x) + square(near_y));
        const double high = 0.5 * kCurvature * (square(far_x) + square(far_y));
        const double raised = breaks(Breach::too_high) ? 1e6 : 0.0;
        if (breaks(Breach::interval_upside_down)) return {high, low};
        // rounding to float changes a height by at most 1 / 2^24 of it
        const double slack = breaks(Breach::single_precision) ? 0.1 : 0.0;
        return {low + raised - slack,
                raised + slack + (breaks(Breach::interval) ? low + factor_ * (high - low) : high)};
    }

    double rise_bound(double distance) const override {
        const double steepest = kCurvature * kHalfWorld * std::sqrt(2.0);
        if (breaks(Breach::rise_falls)) return steepest * 1e6 / distance;
        const double rounding = breaks(Breach::single_precision) ? 0.1 : 1e-9;
        return (breaks(Breach::rise) ? factor_ : 1.0) * steepest * distance + rounding;
    }

private:
    bool breaks(Breach breach) const { return breach_ == breach; }
    static double bowl_at(double x, double y) { return 0.5 * kCurvature * (x * x + y * y); }

    bool was_asked(const SampleGrid& grid) const {
        const std::lock_guard lock(mutex_);
        return !asked_.insert({grid.corner.x, grid.corner.y, grid.step, grid.columns}).second;
    }

    double factor_at(const SampleGrid& grid, int column, int row) const {
        if (breach_ != Breach::bounds_in_a_patch) return 1.0;
        const double x = lattice().x(grid.corner.x + column * grid.step);
        const double y = lattice().y(grid.corner.y + row * grid.step);
        return WorldRect{1000.0, 1000.0, 3000.0, 3000.0}.contains(x, y) ? factor_ : 1.0;
    }

    Breach breach_;
    double factor_;
    std::uint64_t maker_;  // hash of the creating thread's id
    mutable std::mutex mutex_;
    mutable std::set<std::tuple<std::int64_t, std::int64_t, std::int64_t, int>> asked_;
};

SourceReport check(const HeightSource& source, const SourceCheckSettings& settings = {}) {
    const Result<SourceReport> report = check_source(source, settings);
    EXPECT_TRUE(report.has_value()) << report.error().message;
    return report.value_or(SourceReport{});
}

struct Case {
    Breach breach;
    double factor;
    SourceLaw law;
};

void PrintTo(const Case& tested, std::ostream* out) {
    *out << name_of(tested.law) << " by " << tested.factor;
}

class CheckSource : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Breaches, CheckSource,
                         testing::Values(Case{Breach::vertex_bounds, 0.99, SourceLaw::vertex_bound},
                                         Case{Breach::vertex_bounds, 0.1, SourceLaw::vertex_bound},
                                         Case{Breach::cell_bounds, 0.99, SourceLaw::cell_bound},
                                         Case{Breach::cell_bounds, 0.1, SourceLaw::cell_bound},
                                         Case{Breach::midpoint_bounds, 2.01, SourceLaw::nesting},
                                         Case{Breach::one_spacing, 4.0, SourceLaw::nesting},
                                         Case{Breach::corner_bounds, 1.0, SourceLaw::no_vertex},
                                         Case{Breach::interval, 0.999, SourceLaw::interval},
                                         Case{Breach::interval_upside_down, 1.0,
                                              SourceLaw::interval},
                                         Case{Breach::rise, 0.97, SourceLaw::rise_bound},
                                         Case{Breach::rise_falls, 1.0, SourceLaw::rise_bound},
                                         Case{Breach::neighbour, 1.0, SourceLaw::height},
                                         Case{Breach::wide_windows, 1.0, SourceLaw::window},
                                         Case{Breach::coarse_levels, 1.0, SourceLaw::levels},
                                         Case{Breach::mesh_bounds, 1.0, SourceLaw::mesh_bounds},
                                         Case{Breach::second_time, 1.0, SourceLaw::repeatable},
                                         Case{Breach::other_threads, 1.0, SourceLaw::threads},
                                         Case{Breach::nan_sample, 1.0, SourceLaw::finite},
                                         Case{Breach::nan_bound, 1.0, SourceLaw::finite},
                                         Case{Breach::single_precision, 1.0, SourceLaw::cell_bound},
                                         Case{Breach::too_high, 1.0, SourceLaw::fits_quanta},
                                         Case{Breach::read_error, 1.0, SourceLaw::answers},
                                         Case{Breach::exception, 1.0, SourceLaw::answers},
                                         Case{Breach::height_throws, 1.0, SourceLaw::finite},
                                         Case{Breach::mesh_throws, 1.0, SourceLaw::answers},
                                         Case{Breach::bad_quantum, 1.0, SourceLaw::valid_lattice},
                                         Case{Breach::no_extent, 1.0, SourceLaw::valid_lattice}),
                         [](const auto& tested) {
                             return std::string(name_of(tested.param.law)) + "_" +
                                    std::to_string(tested.index);
                         });

TEST_P(CheckSource, FindsTheLawThatIsBrokenWithEverySeed) {
    const Case& tested = GetParam();
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        const BrokenHeights source(tested.breach, tested.factor);
        const SourceReport report = check(source, {.seed = seed});
        EXPECT_FALSE(report.is_clean());
        EXPECT_GT(report.of(tested.law).broken, 0u) << to_text(report);
        ASSERT_FALSE(report.of(tested.law).worst.empty());
        EXPECT_EQ(report.of(tested.law).worst.front().law, tested.law);
        const std::string text = to_text(report);
        EXPECT_NE(text.find(std::string(name_of(tested.law)) + ": broken in"), std::string::npos);
    }
}

TEST(CheckSource, FindsNothingWrongWithARightSource) {
    const BrokenHeights bowl(Breach::none);
    const SourceReport report = check(bowl, {.nesting_slack = 1.0});
    EXPECT_TRUE(report.is_clean()) << to_text(report);
    EXPECT_GT(report.tightest, 0.999);  // so that a bound 1 % too small is detected
    for (std::size_t law = 0; law < kSourceLawCount; ++law) {
        EXPECT_GT(report.laws[law].checks, 0u) << name_of(static_cast<SourceLaw>(law));
    }
    const WaveHeights wave(small_world(4, 2.0), 30.0, 200.0);
    const SourceReport of_wave = check(wave, {.nesting_slack = 1.0});
    EXPECT_TRUE(of_wave.is_clean()) << to_text(of_wave);
}

TEST(CheckSource, FindsNothingWrongWithFractals) {
    for (const FractalKind kind :
         {FractalKind::fbm, FractalKind::ridged, FractalKind::hybrid, FractalKind::warped}) {
        for (const int octaves : {6, 14}) {
            const auto source =
                FractalHeights::create({.seed = 5, .kind = kind, .octave_count = octaves}).value();
            const SourceReport report = check(*source, {.seed = 3, .places = 5});
            EXPECT_TRUE(report.is_clean())
                << "kind " << static_cast<int>(kind) << ": " << to_text(report);
            EXPECT_GT(report.tightest, 0.3);
        }
    }
}

TEST(CheckSource, SaysWhereAndByHowMuch) {
    const BrokenHeights source(Breach::bounds_in_a_patch, 0.1);
    const SourceReport report =
        check(source, {.places = 40, .region = WorldRect{0.0, 0.0, 6000.0, 6000.0}});
    const SourceLawReport& law = report.of(SourceLaw::vertex_bound);
    ASSERT_GT(law.broken, 0u);
    EXPECT_LT(law.broken, law.checks / 2);
    ASSERT_EQ(law.worst.size(), 3u);
    for (const SourceViolation& violation : law.worst) {
        // a triangle extends at most two spacings from its vertex
        const double spacing = std::ldexp(1.0, 9 - violation.level);
        EXPECT_GE(violation.x, 1000.0 - 2 * spacing);
        EXPECT_LE(violation.x, 3000.0 + 2 * spacing);
        EXPECT_NEAR(violation.measured, 10.0 * violation.claimed, 0.1 * violation.measured + 1e-7);
    }
    EXPECT_GE(law.worst[0].measured - law.worst[0].claimed,
              law.worst[2].measured - law.worst[2].claimed);
}

TEST(CheckSource, MeasuresInsideTheRegionOnly) {
    const BrokenHeights source(Breach::single_precision);
    const SourceReport near =
        check(source, {.region = WorldRect{-20'000.0, -20'000.0, 20'000.0, 20'000.0}});
    EXPECT_EQ(near.of(SourceLaw::cell_bound).broken, 0u) << to_text(near);
    const SourceReport far = check(source);
    ASSERT_GT(far.of(SourceLaw::cell_bound).broken, 0u);
    const SourceViolation& worst = far.of(SourceLaw::cell_bound).worst.front();
    EXPECT_GE(std::max(std::abs(worst.x), std::abs(worst.y)), 50'000.0);
}

TEST(CheckSource, AsksTheSameOfTheSameSeed) {
    const BrokenHeights source(Breach::vertex_bounds, 0.5);
    EXPECT_EQ(to_text(check(source, {.seed = 4})), to_text(check(source, {.seed = 4})));
    EXPECT_NE(to_text(check(source, {.seed = 4})), to_text(check(source, {.seed = 5})));
}

TEST(CheckSource, ChecksTheLevelsThatItIsTold) {
    const BrokenHeights source(Breach::one_spacing, 0.1);  // step 8: level 6 of 9
    EXPECT_TRUE(check(source, {.first_level = 7}).is_clean());
    const SourceReport report = check(source, {.first_level = 6, .last_level = 6});
    ASSERT_GT(report.of(SourceLaw::vertex_bound).broken, 0u);
    EXPECT_EQ(report.of(SourceLaw::vertex_bound).worst.front().level, 6);
}

TEST(CheckSource, RefusesSettingsOutOfRange) {
    const BrokenHeights source(Breach::none);
    const auto refusal = [&](const SourceCheckSettings& settings) {
        const Result<SourceReport> report = check_source(source, settings);
        EXPECT_FALSE(report.has_value());
        return report ? "" : report.error().message;
    };
    EXPECT_EQ(refusal({.places = 0}), "places must be 1 to 1000000, got 0");
    EXPECT_EQ(refusal({.points = -3}), "points must be 1 to 1000000, got -3");
    EXPECT_NE(refusal({.first_level = 3, .last_level = 2}).find("got 3 and 2"), std::string::npos);
    EXPECT_NE(refusal({.nesting_slack = 0.9}).find("nesting_slack"), std::string::npos);
    EXPECT_NE(refusal({.nesting_slack = std::nan("")}).find("nesting_slack"), std::string::npos);
    EXPECT_NE(refusal({.region = WorldRect{9e9, 0.0, 9.1e9, 1.0}}).find("region"),
              std::string::npos);
}

// The library itself refuses a source whose bounds are a hundredth of the correct ones.
TEST(WrongSource, IsRefusedByItsOwnSamplesAndCertifiesNoPicture) {
    EXPECT_TRUE(make_chunk(BrokenHeights(Breach::none), {0, 0, 0}));
    const auto source = std::make_shared<const BrokenHeights>(Breach::vertex_bounds, 0.01);
    const auto chunk = make_chunk(*source, {0, 0, 0});
    ASSERT_FALSE(chunk.has_value());
    EXPECT_EQ(chunk.error().code, ErrorCode::bad_data);
    EXPECT_NE(chunk.error().message.find("bound"), std::string::npos) << chunk.error().message;

    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({0, 0, 40'000}, {0, 1000, 0}, 1.0, 1280, 720).value();
    pager.update({{.view = view}}, {}, 0.0);
    EXPECT_GT(pager.stats().failed, 0u);
    EXPECT_EQ(pager.last_failure().find("the source's bound at ("), 0u) << pager.last_failure();
    Triangulator triangulator = Triangulator::create(*source, {}).value();
    const TerrainMesh mesh = triangulator.update(pager.resident(), view);
    EXPECT_EQ(mesh.status, MeshStatus::not_resident);
    EXPECT_EQ(mesh.triangle_count, 0u);
}

#if TERRANE_ASSERTS
TEST(WrongSource, IsSeenByBuildsWithAssertsWhileChunksAreMade) {
    testing::GTEST_FLAG(death_test_style) = "threadsafe";
    const BrokenHeights interval(Breach::interval, 0.5);
    EXPECT_DEATH((void)make_chunk(interval, {0, 0, 4}), "the source's interval at .*claimed");
    const BrokenHeights cells(Breach::cell_bounds, 0.1);
    EXPECT_DEATH((void)make_chunk(cells, {0, 0, 4}), "the source's cell bound at .*claimed");
}
#endif

}  // namespace terrane::check_source_test
