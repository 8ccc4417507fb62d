// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/function_heights.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>

namespace terrane::function_heights_test {

constexpr WorldRect kExtent{-4000.0, -3000.0, 4000.0, 3000.0};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double hills(double x, double y) {
    return 20.0 * test::wave(x / 900.0) + 5.0 * test::wave(y / 300.0);
}
double bowl(double x, double y) { return 0.5 * 0.001 * (x * x + y * y); }
double cone(double x, double y) { return 500.0 - 0.7 * std::sqrt(x * x + y * y); }
double plane(double x, double y) { return 12.0 + 0.25 * x - 0.5 * y; }
double terraces(double x, double /*y*/) {
    return 10.0 * std::abs(x / 100.0 - std::floor(x / 100.0) - 0.5);
}

struct Case {
    const char* name;
    double (*function)(double, double);
    FunctionHeightsSettings settings;
    double least_tightness = 0.0;
};

void PrintTo(const Case& tested, std::ostream* out) { *out << tested.name; }

FunctionHeightsSettings known(std::optional<double> slope, std::optional<double> curvature,
                              std::optional<HeightInterval> range = std::nullopt) {
    return {.extent = kExtent,
            .finest_spacing = 2.0,
            .slope = slope,
            .curvature = curvature,
            .range = range};
}

// 20 * 8 / 900 and 5 * 8 / 300, perpendicular to each other; 20 * 32 / 900^2 and 5 * 32 / 300^2 along the axes.
constexpr double kHillSlope = 0.2223, kHillCurvature = 0.00178;

std::shared_ptr<const HeightSource> make(HeightFunction function,
                                         const FunctionHeightsSettings& settings) {
    auto source = heights_from_function(std::move(function), settings);
    EXPECT_TRUE(source.has_value()) << source.error().message;
    return source.value_or(nullptr);
}

SourceReport check(const HeightSource& source, std::uint64_t seed, double nesting_slack = 1.0) {
    return check_source(source,
                        {.seed = seed, .places = 5, .points = 10, .nesting_slack = nesting_slack})
        .value();
}

class FunctionHeights : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(
    Functions, FunctionHeights,
    testing::Values(Case{"HillsBySlope", hills, known(kHillSlope, {})},
                    Case{"HillsByCurvature", hills, known({}, kHillCurvature), 0.8},
                    Case{"HillsByBoth", hills, known(kHillSlope, kHillCurvature), 0.8},
                    Case{"HillsByAll", hills,
                         known(kHillSlope, kHillCurvature, HeightInterval{-25.0, 25.0}), 0.8},
                    Case{"BowlByCurvature", bowl, known({}, 0.001), 0.999},
                    Case{"ConeBySlope", cone, known(0.7, {}), 0.5},
                    Case{"PlaneByNoCurvature", plane, known({}, 0.0)},
                    Case{"PlaneBySlope", plane, known(0.5591, {})},
                    Case{"FlatByNoSlope", [](double, double) { return -7.0; }, known(0.0, {})},
                    Case{"TerracesBySlope", terraces, known(0.1001, {}), 0.9}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(FunctionHeights, KeepTheLawsOfSourcesWithRightBounds) {
    const Case& tested = GetParam();
    const auto source = make(tested.function, tested.settings);
    EXPECT_TRUE(source->is_certified());
    double tightest = 0.0;
    for (const std::uint64_t seed : {1u, 2u}) {
        const SourceReport report = check(*source, seed);
        EXPECT_TRUE(report.is_clean()) << to_text(report);
        tightest = std::max(tightest, report.tightest);
    }
    EXPECT_GE(tightest, tested.least_tightness);
    EXPECT_EQ(source->height(12.5, -30.25), tested.function(12.5, -30.25));
}

TEST(FunctionHeights, HaveBoundsThatAreFoundWrongWhereTheFunctionIsSteeperOrMoreCurved) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        const auto curved = make(bowl, known({}, 0.00099));
        EXPECT_GT(check(*curved, seed).of(SourceLaw::vertex_bound).broken, 0u);
        EXPECT_GT(check(*curved, seed).of(SourceLaw::cell_bound).broken, 0u);
        const auto steep = make(terraces, known(0.05, {}));
        EXPECT_GT(check(*steep, seed).of(SourceLaw::vertex_bound).broken, 0u);
        EXPECT_GT(check(*steep, seed).of(SourceLaw::interval).broken, 0u);
        EXPECT_GT(check(*steep, seed).of(SourceLaw::rise_bound).broken, 0u);
    }
}

TEST(FunctionHeights, TakeTheSmallestOfTheBoundsThatFollowFromWhatIsKnown) {
    const auto cell_bound = [](const FunctionHeightsSettings& settings, std::int64_t step) {
        float bound = 0.0f;
        EXPECT_TRUE(
            make(plane, settings)->cell_bounds({{0, 0}, step, 2, 2}, {&bound, 1}).has_value());
        return static_cast<double>(bound);
    };
    const double edge = 2.0 * std::sqrt(2.0);
    EXPECT_NEAR(cell_bound(known(3.0, {}), 1), 3.0 * edge / 2.0, 1e-5);
    EXPECT_NEAR(cell_bound(known(3.0, 0.5), 1), 0.5 * edge * edge / 8.0, 1e-5);
    EXPECT_NEAR(cell_bound(known(3.0, 0.5, HeightInterval{-9000.0, 9000.0}), 1), 0.5, 1e-5);
    EXPECT_NEAR(cell_bound(known(3.0, 0.5, HeightInterval{-2.0, 2.0}), 8), 4.0, 1e-5);
    EXPECT_GE(cell_bound(known(3.0, {}), 1), 3.0 * edge / 2.0);  // rounded up
}

struct Scene {
    std::shared_ptr<const HeightSource> source;
    Pager pager;
    Triangulator triangulator;
    TerrainMesh mesh;
};

Scene look_over(std::shared_ptr<const HeightSource> source, double max_error_px, const View& view) {
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 300'000, .max_error_px = max_error_px})
            .value();
    Scene scene{std::move(source), std::move(pager), std::move(triangulator), {}};
    const RequiredRegion region = scene.pager.require({-10.0, -2010.0, 10.0, -1990.0}, 0.0);
    CameraNeed camera{.view = view, .threshold_px = max_error_px};
    for (int frame = 0; frame < 40; ++frame) {
        scene.pager.update({&camera, 1}, {}, frame);
        scene.mesh = scene.triangulator.update(scene.pager.resident(), view);
        camera.threshold_px = scene.mesh.threshold_px;
    }
    return scene;
}

TEST(FunctionHeights, SayThatNothingIsCertifiedWhereNothingIsKnown) {
    const View view = look_at({0.0, -2000.0, 300.0}, {0.0, 0.0, 0.0}, 1.0, 1280, 720).value();
    const auto source = make(hills, known({}, {}));
    EXPECT_FALSE(source->is_certified());
    const Scene scene = look_over(source, 1.0, view);
    EXPECT_EQ(scene.mesh.status, MeshStatus::error_met);
    EXPECT_EQ(scene.mesh.error_px, kInfinity);
    EXPECT_LE(scene.mesh.threshold_px, 1.0);
    const Ground ground(scene.pager.resident(), source->lattice().finest_level);
    const HeightAnswer answer = ground.height(0.3, -1999.5);
    ASSERT_EQ(answer.status, QueryStatus::ok);
    EXPECT_NEAR(answer.height, hills(0.3, -1999.5), 0.01);
    EXPECT_EQ(answer.error_m, kInfinity);
    EXPECT_EQ(ground.ray({0.3, -1999.5, 100.0}, {0.3, -1999.5, -100.0}).error_m, kInfinity);
    EXPECT_EQ(
        static_cast<double>(ground.cell(ground.column_at(0.3), ground.row_at(-1999.5)).error_m),
        kInfinity);
    EXPECT_EQ(static_cast<double>(
                  GroundReader(ground).error({ground.column_at(0.0), ground.row_at(-2000.0),
                                              ground.column_at(0.0), ground.row_at(-2000.0)})),
              kInfinity);

    // The same ground with declared bounds.
    const Scene bounded = look_over(make(hills, known(kHillSlope, kHillCurvature)), 1.0, view);
    EXPECT_EQ(bounded.mesh.status, MeshStatus::error_met);
    EXPECT_LE(bounded.mesh.error_px, 1.0);
    // With estimates the number of triangles is similar: neither the whole budget nor none.
    EXPECT_GT(scene.mesh.triangle_count, bounded.mesh.triangle_count / 8);
    EXPECT_LT(scene.mesh.triangle_count, bounded.mesh.triangle_count * 2);
}

TEST(FunctionHeights, CertifyTheErrorOfAFrame) {
    const View view = look_at({0.0, -2000.0, 300.0}, {0.0, 0.0, 0.0}, 1.0, 1280, 720).value();
    for (const auto& settings : {known(kHillSlope, {}), known({}, kHillCurvature)}) {
        const auto hilly = make(hills, settings);
        const FlatArea area{.polygon = polygon_of({-300.0, -900.0, 200.0, -500.0}), .height = 4.0};
        for (const auto& source : {hilly, flatten_heights(hilly, {&area, 1}).value()}) {
            const Scene scene = look_over(source, 4.0, view);
            const double measured =
                test::measure_error_px(test::make_soup(scene.mesh), *source, view, 3);
            EXPECT_LE(measured, scene.mesh.error_px);
            EXPECT_GT(measured, 0.0);
            const Ground ground(scene.pager.resident(), source->lattice().finest_level);
            const HeightAnswer answer = ground.height(1.3, -1999.1);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_LE(std::abs(answer.height - source->height(1.3, -1999.1)), answer.error_m);
            EXPECT_LT(answer.error_m, 0.4);
        }
    }
}

TEST(FunctionHeights, HaveEstimatesThatHoldOnSmoothGround) {
    for (const auto function : {hills, bowl, plane, cone}) {
        const auto source = make(function, known({}, {}));
        const SourceReport report = check(*source, 4, 1e9);
        EXPECT_TRUE(report.is_clean()) << to_text(report);
    }
}

TEST(FunctionHeights, FailWithOneLineThatNamesPlaceAndValue) {
    struct Failure {
        double (*at_place)();
        ErrorCode code;
        const char* message;
    };
    const Failure failures[] = {
        {[] { return std::nan(""); }, ErrorCode::io,
         "the height function gave nan m at x -3996 m, y -2998 m"},
        {[] { return -kInfinity; }, ErrorCode::io,
         "the height function gave -inf m at x -3996 m, y -2998 m"},
        {[]() -> double { throw std::runtime_error("no such tile"); }, ErrorCode::io,
         "the height function threw \"no such tile\" at x -3996 m, y -2998 m"},
        {[]() -> double { throw 5; }, ErrorCode::io,
         "the height function threw what is no std::exception at x -3996 m, y -2998 m"},
        {[] { return 100.5; }, ErrorCode::bad_data,
         "the height function gave 100.5 m at x -3996 m, y -2998 m, outside its range of -100 to "
         "100 m"},
    };
    for (const Failure& failure : failures) {
        const auto source =
            make([&](double x,
                     double y) { return x == -3996.0 && y == -2998.0 ? failure.at_place() : 0.0; },
                 known(1.0, {}, HeightInterval{-100.0, 100.0}));
        std::vector<double> heights(9);
        const Result<void> done = source->sample({{0, 0}, 1, 3, 3}, heights);
        ASSERT_FALSE(done.has_value()) << failure.message;
        EXPECT_EQ(done.error().code, failure.code);
        EXPECT_EQ(done.error().message, failure.message);
    }
}

TEST(FunctionHeights, NeverThrow) {
    const auto source = make([](double, double) -> double { throw 1; }, known(1.0, {}));
    EXPECT_TRUE(std::isnan(source->height(0.0, 0.0)));
    EXPECT_EQ(source->interval(kExtent).low, -kInfinity);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    pager.update({}, {}, 0.0);
    EXPECT_GT(pager.stats().failed, 0u);
    EXPECT_NE(pager.last_failure().find("the height function threw"), std::string::npos)
        << pager.last_failure();
    const auto unknown = heights_from_function(
        [](double x, double) { return x > 0.0 ? kInfinity : 0.0; }, known({}, {}));
    ASSERT_FALSE(unknown.has_value());
    EXPECT_EQ(unknown.error().code, ErrorCode::io);
}

TEST(FunctionHeights, CoverTheExtentWithFewRootSquares) {
    test::Random random(11);
    for (int i = 0; i < 200; ++i) {
        FunctionHeightsSettings settings = known(1.0, {});
        settings.finest_spacing = std::ldexp(random.between(0.5, 1.0), random.below(9) - 4);
        const double width = random.between(0.1, 60'000.0), depth = random.between(0.1, 60'000.0);
        settings.extent = {random.between(-1e5, 1e5), random.between(-1e5, 1e5), 0.0, 0.0};
        settings.extent.east = settings.extent.west + width;
        settings.extent.north = settings.extent.south + depth;
        const Lattice lattice = make(plane, settings)->lattice();
        EXPECT_EQ(lattice.x(0), settings.extent.west);
        EXPECT_EQ(lattice.y(0), settings.extent.south);
        EXPECT_GE(lattice.root_size() * lattice.root_count_x, width * (1.0 - 1e-12));
        EXPECT_GE(lattice.root_size() * lattice.root_count_y, depth * (1.0 - 1e-12));
        EXPECT_LE(lattice.root_count_x, 4);
        EXPECT_LE(lattice.root_count_y, 4);
        EXPECT_EQ(lattice.spacing, settings.finest_spacing);
    }
}

TEST(FunctionHeights, RefuseSettingsOutOfRange) {
    const auto refusal = [](const FunctionHeightsSettings& settings) {
        const auto source = heights_from_function(plane, settings);
        return source ? std::string("accepted") : source.error().message;
    };
    EXPECT_EQ(refusal(known(-1.0, {})), "slope must be 0 to 1e+06, got -1");
    EXPECT_EQ(refusal(known(std::nan(""), {})), "slope must be 0 to 1e+06, got nan");
    EXPECT_EQ(refusal(known({}, kInfinity)), "curvature must be 0 to 1e+09, got inf");
    EXPECT_EQ(refusal(known(1.0, {}, HeightInterval{5.0, 1.0})),
              "range.high must be 5 to 2.74878e+11, got 1");
    FunctionHeightsSettings settings = known(1.0, {});
    settings.extent.east = settings.extent.west;
    EXPECT_EQ(
        refusal(settings),
        "extent must be finite and not empty, got west -4000, south -3000, east -4000, north 3000");
    settings = known(1.0, {});
    settings.finest_spacing = 0.0;
    EXPECT_EQ(refusal(settings), "spacing must be 2^-30 to 2^20 m, got 0");
    settings.finest_spacing = 1e-9;
    EXPECT_EQ(refusal(settings),
              "finest_spacing is too small for the extent: it has more than 24 levels, got 1e-09");
    settings = known(1.0, {});
    settings.quantum = 0.3;
    EXPECT_EQ(refusal(settings), "quantum must be a power of two from 2^-60 to 2^20 m, got 0.3");
    settings = known(1.0, {});
    settings.lattice = Lattice{.finest_level = 25};
    EXPECT_EQ(refusal(settings), "lattice.finest_level must be 0 to 24, got 25");
    const auto empty = heights_from_function({}, known(1.0, {}));
    ASSERT_FALSE(empty.has_value());
    EXPECT_EQ(empty.error().message, "function must be one that can be called, got an empty one");
}

}  // namespace terrane::function_heights_test
