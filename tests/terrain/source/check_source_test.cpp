// SPDX-License-Identifier: MIT
#include "broken_heights.h"
#include "support/heights/wave_heights.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace terrane {
namespace check_source_test {

using test::Breach;
using test::BrokenHeights;

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
    EXPECT_GT(report.tightest, 0.999);  // so a bound that is 1 % too small is seen
    for (std::size_t law = 0; law < kSourceLawCount; ++law) {
        EXPECT_GT(report.laws[law].checks, 0u) << name_of(static_cast<SourceLaw>(law));
    }
    const test::WaveHeights wave(test::small_world(4, 2.0), 30.0, 200.0);
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

TEST(CheckSource, FindsNothingWrongWithDetail) {
    const auto base = FractalHeights::create({.seed = 5, .octave_count = 4}).value();
    const DetailField field{.origin_x = 3.0,
                            .cell_x = 32.0,
                            .cell_y = 23.7,
                            .columns = 2,
                            .rows = 2,
                            .node_spacing_x = 20'000.0,
                            .node_spacing_y = 30'000.0,
                            .amplitude = {1.0f, 4.0f, 0.0f, 2.0f}};
    const auto source = add_detail(base, field, {}).value();
    const SourceReport report = check(*source, {.places = 5});
    EXPECT_TRUE(report.is_clean()) << to_text(report);
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
        // a triangle reaches at most two spacings beyond its vertex
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
    EXPECT_EQ(refusal({.threads = 65}), "threads must be 1 to 64, got 65");
    EXPECT_NE(refusal({.first_level = 3, .last_level = 2}).find("got 3 and 2"), std::string::npos);
    EXPECT_NE(refusal({.nesting_slack = 0.9}).find("nesting_slack"), std::string::npos);
    EXPECT_NE(refusal({.nesting_slack = std::nan("")}).find("nesting_slack"), std::string::npos);
    EXPECT_NE(refusal({.region = WorldRect{9e9, 0.0, 9.1e9, 1.0}}).find("region"),
              std::string::npos);
}

// The library itself, with a source whose bounds are a hundredth of what they should be.
TEST(WrongSource, IsRefusedByItsOwnSamplesAndCertifiesNoPicture) {
    const auto source = std::make_shared<const BrokenHeights>(Breach::vertex_bounds, 0.01);
    const auto chunk = make_chunk(*source, {0, 0, 0});
    ASSERT_FALSE(chunk.has_value());
    EXPECT_EQ(chunk.error().code, ErrorCode::bad_data);
    EXPECT_NE(chunk.error().message.find("bound"), std::string::npos) << chunk.error().message;

    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({0, 0, 40'000}, {0, 1000, 0}, 1.0, 1280, 720).value();
    const CameraNeed camera{.view = view};
    pager.update({&camera, 1}, {}, 0.0);
    EXPECT_GT(pager.stats().failed, 0u);
    EXPECT_EQ(pager.last_failure().find("the source's bound at ("), 0u) << pager.last_failure();
    Triangulator triangulator = Triangulator::create(*source, {}).value();
    const TerrainMesh mesh = triangulator.update(pager.resident(), view);
    EXPECT_EQ(mesh.status, MeshStatus::not_resident);
    EXPECT_EQ(mesh.triangle_count, 0u);
}

TEST(WrongSource, WithRightBoundsIsNotRefused) {
    const auto source = std::make_shared<const BrokenHeights>(Breach::none);
    for (const ChunkKey& key : {ChunkKey{-1, -1, 0}, ChunkKey{0, 0, 0}, ChunkKey{511, 511, 9}}) {
        const auto chunk = make_chunk(*source, key);
        EXPECT_TRUE(chunk.has_value()) << chunk.error().message;
    }
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    pager.update({}, {}, 0.0);
    EXPECT_EQ(pager.last_failure(), "");
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

}  // namespace check_source_test
}  // namespace terrane
