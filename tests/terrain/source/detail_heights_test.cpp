// SPDX-License-Identifier: MIT
#include "source/fractal/amplitude_field.h"
#include "support/faulty_heights.h"
#include "terrain/source/bound_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terrane::detail_heights_test {

constexpr std::uint64_t kSeed = 31;

/// A fractal with flags, to check that detail forwards them.
class Flagged final : public ForwardedHeights {
public:
    explicit Flagged(std::shared_ptr<const HeightSource> ground)
        : ForwardedHeights(std::move(ground)) {}
    Result<void> cell_flags(const SampleGrid&, std::span<std::uint8_t> flags_out) const override {
        std::ranges::fill(flags_out, std::uint8_t{cell_filled});
        return {};
    }
};

std::shared_ptr<test::FaultyHeights> make_base(double amplitude = 40.0) {
    const auto ground = FractalHeights::create(
        {.octave_count = 3, .amplitude = amplitude, .wavelength_log2 = 10, .root_size_log2 = 13});
    return std::make_shared<test::FaultyHeights>(std::make_shared<Flagged>(ground.value()));
}

/// Cells of 16 finest spacings, or not square; the amplitude varies strongly between nodes.
DetailField make_field(double cell_x, double cell_y) {
    DetailField field{.origin_x = -1008.0,
                      .origin_y = 512.0,
                      .cell_x = cell_x,
                      .cell_y = cell_y,
                      .columns = 20,
                      .rows = 13,
                      .node_origin_x = -900.0,
                      .node_origin_y = -700.0,
                      .node_spacing_x = 90.0,
                      .node_spacing_y = 110.0,
                      .amplitude = {}};
    test::Random random(kSeed);
    for (int node = 0; node < field.columns * field.rows; ++node) {
        field.amplitude.push_back(static_cast<float>(random.between(0.0, 6.0)));
    }
    return field;
}

std::shared_ptr<const HeightSource> make(std::shared_ptr<const HeightSource> base,
                                         DetailField field, const DetailSettings& settings = {}) {
    const auto source = add_detail(std::move(base), std::move(field), settings);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    return source.value_or(nullptr);
}

std::string refusal(DetailField field, const DetailSettings& settings = {}) {
    const auto source = add_detail(make_base(), std::move(field), settings);
    EXPECT_FALSE(source.has_value());
    if (source) return "";
    EXPECT_EQ(source.error().code, ErrorCode::invalid_argument);
    return source.error().message;
}

TEST(DetailHeights, VanishesExactlyAtTheGridsPoints) {
    const auto base = make_base();
    DetailField field = make_field(16.0, 16.0);
    field.origin_x += 1e-8;  // rounding error of a projection
    const auto source = make(base, field, {.octave_count = 9});
    const SampleGrid grid{{-1008 - 64, 512 - 640}, 16, 40, 80};
    std::vector<double> heights(grid.size()), base_heights(grid.size());
    ASSERT_TRUE(source->sample(grid, heights).has_value());
    ASSERT_TRUE(base->sample(grid, base_heights).has_value());
    EXPECT_EQ(heights, base_heights);
}

TEST(DetailHeights, IsThereBetweenTheGridsPoints) {
    const auto base = make_base();
    const auto source = make(base, make_field(16.0, 16.0));
    double largest = 0.0;
    for (int x = -500; x < 500; x += 3) {
        largest = std::max(largest, std::abs(source->height(x, 5.0) - base->height(x, 5.0)));
    }
    EXPECT_GE(largest, 1.0);
}

TEST(DetailHeights, KeepsTheLawsOfSources) {
    for (const double cell_y : {16.0, 23.7}) {
        for (const int octave_count : {8, DetailSettings{}.octave_count}) {
            const auto source =
                make(make_base(), make_field(16.0, cell_y), {.octave_count = octave_count});
            const WorldRect region{-1500.0, -1500.0, 1500.0, 1500.0};
            const SourceReport report =
                check_source(*source, {.places = 4, .points = 10, .region = region}).value();
            EXPECT_TRUE(report.is_clean()) << to_text(report);
        }
    }
}

TEST(DetailHeights, BoundsAreNeverBelowTheTrueDeviation) {
    test::SeededRandom random(kSeed);
    for (const double cell_y : {16.0, 23.7}) {
        const auto source = make(make_base(1.0), make_field(16.0, cell_y));
        for (const std::int64_t step : {1, 2, 8, 64, 512}) {
            double closest = 0.0;
            for (int place = 0; place < 4; ++place) {
                const SampleGrid grid =
                    test::random_grid(step, std::max<std::int64_t>(1500 / step, 2), 9, 10, random);
                closest = std::max(closest, test::check_bounds(*source, grid, 40, random));
            }
            EXPECT_GE(closest, 0.1) << "a bound that is never near says little, step " << step;
        }
    }
}

TEST(DetailHeights, BoundsHoldWhereTheAmplitudeChangesFasterThanTheNoise) {
    test::SeededRandom random(kSeed);
    DetailField field = make_field(512.0, 512.0);
    field.node_spacing_x = 5.0;
    field.node_spacing_y = 7.0;
    field.node_origin_x = 0.0;
    field.node_origin_y = 0.0;
    const auto source = make(make_base(0.0), field, {.octave_count = 1});
    test::check_bounds(*source, {{0, 0}, 1, 60, 60}, 40, random);
    test::check_bounds(*source, {{-16, 0}, 8, 20, 20}, 40, random);
    test::check_nesting(*source, {{0, 0}, 4, 30, 30});
}

TEST(DetailHeights, BoundsAreNestedExactly) {
    test::SeededRandom random(kSeed);
    for (const double cell_y : {16.0, 23.7}) {
        const auto source = make(make_base(), make_field(16.0, cell_y));
        for (std::int64_t step = 2; step <= 1024; step *= 2) {
            test::check_nesting(*source, test::random_grid(step, 3000 / step + 2, 17, 19, random));
        }
    }
}

TEST(DetailHeights, ForwardsFlagsExtentLatticeAndFailures) {
    const auto base = make_base();
    const auto source = make(base, make_field(16.0, 16.0));
    EXPECT_EQ(source->lattice(), base->lattice());
    EXPECT_EQ(source->extent().west, base->extent().west);
    const SampleGrid grid{{0, 0}, 1, 3, 3};
    std::vector<std::uint8_t> flags(4);
    ASSERT_TRUE(source->cell_flags(grid, flags).has_value());
    EXPECT_EQ(flags, std::vector<std::uint8_t>(4, cell_filled));
    base->set_plan({{.fault = test::Fault::read_error}});
    std::vector<double> heights(9);
    std::vector<float> bounds(9);
    EXPECT_EQ(source->sample(grid, heights).error().code, ErrorCode::io);
    EXPECT_EQ(source->vertex_bounds(grid, bounds).error().code, ErrorCode::io);
    EXPECT_EQ(source->cell_bounds(grid, bounds).error().code, ErrorCode::io);
}

TEST(DetailHeights, GoesOnFiniteFarOutsideItsField) {
    const auto source = make(make_base(), make_field(16.0, 16.0), {.octave_count = 24});
    for (const double x : {1e9, -1e12, 1e30, std::numeric_limits<double>::max()}) {
        EXPECT_TRUE(std::isfinite(source->height(x, -x)));
    }
}

TEST(DetailHeights, RefusesFieldsAndSettingsByNameAndValue) {
    EXPECT_EQ(refusal(make_field(16.0, 16.0), {.octave_count = 25}),
              "octave_count must be 1 to 24, got 25");
    EXPECT_NE(refusal(make_field(16.0, 16.0), {.gain = 0.0}).find("gain"), std::string::npos);
    const std::vector<std::pair<const char*, void (*)(DetailField&)>> faults{
        {"cell_x", [](DetailField& f) { f.cell_x = 0.0; }},
        {"node_spacing_y", [](DetailField& f) { f.node_spacing_y = std::nan(""); }},
        {"origin_y", [](DetailField& f) { f.origin_y = std::numeric_limits<double>::infinity(); }},
        {"rows", [](DetailField& f) { f.rows = 0; }},
        {"260 nodes", [](DetailField& f) { f.amplitude.pop_back(); }},
        {"node 7", [](DetailField& f) { f.amplitude[7] = -1.0f; }},
        {"nan", [](DetailField& f) { f.amplitude[7] = std::nanf(""); }},
    };
    for (const auto& [part, spoil] : faults) {
        DetailField bad = make_field(16.0, 16.0);
        spoil(bad);
        EXPECT_NE(refusal(bad).find(part), std::string::npos) << part;
    }
}

TEST(AmplitudeField, BoundsContainTheFieldAndGrowWithTheRectangle) {
    test::SeededRandom random(kSeed);
    const DetailField source = make_field(16.0, 16.0);
    const AmplitudeField field(source);
    const auto at = [&](double x, double y) {
        return field.amplitude(field.place_x(x), field.place_y(y));
    };
    for (int trial = 0; trial < 3000; ++trial) {
        const double x = random.between(-1500.0, 1500.0), y = random.between(-1500.0, 1500.0);
        double half = random.between(0.1, 200.0);
        WorldRect rect{x - half, y - half, x + half, y + half};
        const AmplitudeBounds small = field.over(rect);
        const double to_x = random.between(rect.west, rect.east);
        const double to_y = random.between(rect.south, rect.north);
        ASSERT_LE(at(to_x, to_y), small.most);
        ASSERT_LE(std::abs(at(to_x, to_y) - at(x, y)),
                  small.slope * std::hypot(to_x - x, to_y - y) + 1e-12);
        half = random.between(0.0, 2000.0);
        rect = {rect.west - half, rect.south, rect.east, rect.north + half};
        const AmplitudeBounds large = field.over(rect);
        ASSERT_GE(large.most, small.most);
        ASSERT_GE(large.slope, small.slope);
        ASSERT_LE(large.most, field.everywhere().most);
        ASSERT_LE(large.slope, field.everywhere().slope);
    }
}

TEST(AmplitudeField, ASingleNodeIsConstant) {
    const DetailField source{.columns = 1, .rows = 1, .amplitude = {2.5f}};
    const AmplitudeField field(source);
    for (const double x : {-1e9, -0.5, 0.0, 0.5, 1e9}) {
        EXPECT_EQ(field.amplitude(field.place_x(x), field.place_y(-x)), 2.5);
    }
    EXPECT_EQ(field.over({-1e9, -1e9, 1e9, 1e9}).most, 2.5);
    EXPECT_EQ(field.over({-1e9, -1e9, 1e9, 1e9}).slope, 0.0);
}

}  // namespace terrane::detail_heights_test
