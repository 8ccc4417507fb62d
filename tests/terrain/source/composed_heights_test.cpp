// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/check_source.h>
#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/function_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace terrane::composed_heights_test {

using Source = std::shared_ptr<const HeightSource>;
using Function = std::function<double(double, double)>;

constexpr WorldRect kExtent{-2000.0, -1500.0, 2000.0, 1500.0};

// A source and a closed form of its heights.
struct Both {
    Source source;
    Function direct;
};

Both waves(test::Random& random) {
    const double amplitude = random.between(0.5, 40.0), wavelength = random.between(100.0, 900.0);
    const double phase = random.between(0.0, 1.0);
    const Function direct = [=](double x, double y) {
        return amplitude * (test::wave(x / wavelength + phase) + test::wave(y / wavelength));
    };
    return {heights_from_function(
                direct, {.extent = kExtent,
                         .slope = 8.0 * std::sqrt(2.0) * amplitude / wavelength * 1.001,
                         .curvature = 32.0 * amplitude / (wavelength * wavelength) * 1.001,
                         .range = HeightInterval{-2.0 * amplitude, 2.0 * amplitude}})
                .value(),
            direct};
}

// A blend whose mask is a tilted ring with all values from 0 to 1.
Both blend_of(const Both& a, const Both& b, test::Random& random) {
    const double x0 = random.between(-1000.0, 1000.0), y0 = random.between(-1000.0, 1000.0);
    const double width = random.between(30.0, 500.0), radius = random.between(100.0, 900.0);
    const Function mask = [=](double x, double y) {
        return (radius - std::sqrt((x - x0) * (x - x0) + (y - y0) * (y - y0))) / width + 0.5;
    };
    return {blend_heights(a.source, b.source, mask_from_function(mask, 1.0 / width * 1.001).value())
                .value(),
            [=](double x, double y) {
                const double m = std::clamp(mask(x, y), 0.0, 1.0);
                return (1.0 - m) * a.direct(x, y) + m * b.direct(x, y);
            }};
}

Both sum_of(const Both& a, const Both& b, test::Random& random) {
    const double factor = random.between(-2.0, 2.0);
    return {sum_heights(a.source, b.source, factor).value(),
            [=](double x, double y) { return a.direct(x, y) + factor * b.direct(x, y); }};
}

Polygon random_polygon(test::Random& random, double reach) {
    Polygon polygon;
    const double x = random.between(-1500.0, 1500.0), y = random.between(-1000.0, 1000.0);
    const int corners = 3 + random.below(6);
    for (int i = 0; i < corners; ++i) {
        polygon.corners.push_back(
            {x + random.between(-reach, reach), y + random.between(-reach, reach)});
    }
    return polygon;
}

// Winding numbers by summed angles, distances by sampled edges: methods that the library does not use.
double slow_distance(const Polygon& polygon, double x, double y) {
    const std::size_t count = polygon.corners.size();
    double least = std::numeric_limits<double>::infinity();
    int crossings = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const PlanePoint& a = polygon.corners[i];
        const PlanePoint& b = polygon.corners[(i + 1) % count];
        constexpr int kPoints = 4000;
        for (int k = 0; k <= kPoints; ++k) {
            const double t = static_cast<double>(k) / kPoints;
            least =
                std::min(least, std::hypot(a.x + t * (b.x - a.x) - x, a.y + t * (b.y - a.y) - y));
        }
        // a ray to the south
        if ((a.x > x) != (b.x > x) && a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y) < y) ++crossings;
    }
    return crossings % 2 == 1 ? 0.0 : least;
}

Both flat_in(const Both& base, test::Random& random) {
    std::vector<FlatArea> areas;
    for (int i = 0; i <= random.below(3); ++i) {
        areas.push_back({.polygon = random_polygon(random, 400.0),
                         .feather = random.between(5.0, 200.0),
                         .height = random.between(-50.0, 50.0),
                         .slope_x = random.between(-0.1, 0.1),
                         .slope_y = random.between(-0.1, 0.1)});
    }
    return {
        flatten_heights(base.source, areas).value(), [=](double x, double y) {
            double z = base.direct(x, y);
            for (const FlatArea& area : areas) {
                const double t = std::min(1.0, slow_distance(area.polygon, x, y) / area.feather);
                const double m = 1.0 - t * t * (3.0 - 2.0 * t);
                const PlanePoint& first = area.polygon.corners.front();
                z = (1.0 - m) * z +
                    m * (area.height + area.slope_x * (x - first.x) + area.slope_y * (y - first.y));
            }
            return z;
        }};
}

Both compose(int depth, test::Random& random) {
    if (depth == 0) return waves(random);
    const Both a = compose(depth - 1, random);
    switch (random.below(3)) {
        case 0:
            return sum_of(a, compose(depth - 1, random), random);
        case 1:
            return blend_of(a, compose(depth - 1, random), random);
        default:
            return flat_in(a, random);
    }
}

TEST(ComposedHeights, AreTheDirectEvaluationOfRandomCompositions) {
    for (std::uint64_t seed = 1; seed <= 24; ++seed) {
        test::Random random(seed);
        const Both both = compose(1 + random.below(3), random);
        for (int i = 0; i < 25; ++i) {
            const double x = random.between(-2000.0, 2000.0), y = random.between(-1500.0, 1500.0);
            // sampled distances are off by up to half a step along an edge
            EXPECT_NEAR(both.source->height(x, y), both.direct(x, y), 0.02)
                << "seed " << seed << ": " << x << ", " << y;
        }
    }
}

TEST(ComposedHeights, KeepTheLawsOfSources) {
    for (std::uint64_t seed = 1; seed <= 16; ++seed) {
        test::Random random(seed);
        const Both both = compose(1 + random.below(3), random);
        EXPECT_TRUE(both.source->is_certified());
        const SourceReport report =
            check_source(*both.source,
                         {.seed = seed, .places = 3, .points = 8, .nesting_slack = 1.0})
                .value();
        EXPECT_TRUE(report.is_clean()) << "seed " << seed << ": " << to_text(report);
    }
}

TEST(ComposedHeights, AddAFunctionToAFractalOnItsLatticeAndBlendThem) {
    const auto fractal = FractalHeights::create({.seed = 5, .octave_count = 6}).value();
    const Function dome = [](double x, double y) {
        return std::max(0.0, 400.0 - 0.0002 * (x * x + y * y));
    };
    const auto function = heights_from_function(dome, {.extent = fractal->extent(),
                                                       .lattice = fractal->lattice(),
                                                       .slope = 0.6,
                                                       .range = HeightInterval{0.0, 400.0}})
                              .value();
    EXPECT_EQ(function->lattice(), fractal->lattice());
    const auto sum = sum_heights(fractal, function).value();
    const auto mask =
        mask_from_polygon(polygon_of({-3000.0, -2000.0, 1000.0, 2500.0}), 500.0).value();
    const auto blend = blend_heights(fractal, sum, mask).value();
    for (const Source& source : {sum, blend}) {
        const SourceReport report =
            check_source(*source, {.seed = 2,
                                   .places = 4,
                                   .points = 8,
                                   .region = WorldRect{-4000.0, -4000.0, 4000.0, 4000.0}})
                .value();
        EXPECT_TRUE(report.is_clean()) << to_text(report);
        EXPECT_EQ(source->height(300.5, 20.25), fractal->height(300.5, 20.25) + dome(300.5, 20.25));
    }
}

TEST(ComposedHeights, HaveBoundsThatAreFoundWrongWhereAPartIsWrong) {
    test::Random random(3);
    const Both right = waves(random);
    const auto wrong =
        heights_from_function([](double x, double) { return 8.0 * test::wave(x / 200.0); },
                              {.extent = kExtent, .slope = 0.1})
            .value();
    for (const Source& source :
         {sum_heights(right.source, wrong).value(),
          blend_heights(right.source, wrong,
                        mask_from_function([](double, double) { return 0.9; }, 0.0).value())
              .value(),
          // the mask is steeper than declared
          blend_heights(
              right.source, sum_heights(right.source, right.source, -3.0).value(),
              mask_from_function([](double x, double) { return 0.5 + 0.5 * test::wave(x / 100.0); },
                                 1e-4)
                  .value())
              .value()}) {
        EXPECT_FALSE(
            check_source(*source, {.seed = 2, .places = 4, .points = 8}).value().is_clean());
    }
}

TEST(ComposedHeights, AreOneOfTheirPartsBitForBitWhereAMaskSaysSo) {
    test::Random random(8);
    const Both base = waves(random);
    const Polygon square = polygon_of({-200.0, -100.0, 300.0, 250.0});
    const FlatArea area{
        .polygon = square, .feather = 40.0, .height = 17.5, .slope_x = 0.02, .slope_y = -0.01};
    const auto flat = flatten_heights(base.source, {&area, 1}).value();
    for (int i = 0; i < 2000; ++i) {
        const double x = random.between(-1000.0, 1000.0), y = random.between(-1000.0, 1000.0);
        const double beside = std::hypot(std::max({-200.0 - x, x - 300.0, 0.0}),
                                         std::max({-100.0 - y, y - 250.0, 0.0}));
        if (beside == 0.0) {
            EXPECT_EQ(flat->height(x, y), 17.5 + 0.02 * (x + 200.0) + -0.01 * (y + 100.0));
        } else if (beside >= 40.0) {
            EXPECT_EQ(flat->height(x, y), base.source->height(x, y));
        } else {
            EXPECT_NE(flat->height(x, y), base.source->height(x, y));
        }
    }
    // edges and corners belong to it
    EXPECT_EQ(flat->height(-200.0, -100.0), 17.5);
    EXPECT_EQ(flat->height(300.0, -100.0), 17.5 + 0.02 * 500.0);
    EXPECT_EQ(flatten_heights(base.source, {}).value(), base.source);
}

TEST(ComposedHeights, AreNotCertifiedWhereAPartIsNot) {
    test::Random random(4);
    const Both known = waves(random);
    const auto unknown = heights_from_function(known.direct, {.extent = kExtent}).value();
    EXPECT_FALSE(sum_heights(known.source, unknown).value()->is_certified());
    EXPECT_FALSE(sum_heights(unknown, known.source).value()->is_certified());
    const FlatArea area{.polygon = polygon_of({0.0, 0.0, 100.0, 100.0})};
    EXPECT_FALSE(flatten_heights(unknown, {&area, 1}).value()->is_certified());
    EXPECT_TRUE(flatten_heights(known.source, {&area, 1}).value()->is_certified());
}

TEST(ComposedHeights, PassFailuresOfTheirPartsOn) {
    test::Random random(4);
    const Both good = waves(random);
    const auto broken = heights_from_function([](double, double) { return std::nan(""); },
                                              {.extent = kExtent, .slope = 1.0})
                            .value();
    const auto half = mask_from_function([](double, double) { return 0.5; }, 0.0).value();
    const auto no_mask =
        mask_from_function([](double, double) { return std::nan(""); }, 0.0).value();
    std::vector<double> heights(4);
    const SampleGrid grid{{0, 0}, 1, 2, 2};
    for (const Source& source :
         {sum_heights(good.source, broken).value(), sum_heights(broken, good.source).value(),
          blend_heights(good.source, broken, half).value()}) {
        const auto read = source->sample(grid, heights);
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().message, "the height function gave nan m at x -2000 m, y -1500 m");
        EXPECT_TRUE(std::isnan(source->height(0.0, 0.0)));
    }
    const auto read =
        blend_heights(good.source, good.source, no_mask).value()->sample(grid, heights);
    ASSERT_FALSE(read.has_value());
    EXPECT_EQ(read.error().message, "the mask has no value at x -2000 m, y -1500 m");
}

TEST(ComposedHeights, RefuseWhatIsOutOfRange) {
    test::Random random(4);
    const Both good = waves(random);
    const auto message = [](const auto& result) {
        return result ? std::string("accepted") : result.error().message;
    };
    const auto coarse =
        heights_from_function(good.direct, {.extent = kExtent, .finest_spacing = 2.0, .slope = 9.0})
            .value();
    EXPECT_NE(message(sum_heights(good.source, coarse)).find("must have the same lattice"),
              std::string::npos);
    EXPECT_EQ(message(sum_heights(good.source, good.source, std::nan(""))),
              "factor must be -1e+06 to 1e+06, got nan");
    EXPECT_EQ(message(mask_from_function({}, 1.0)),
              "function must be one that can be called, got an empty one");
    EXPECT_EQ(message(mask_from_polygon({}, 1.0)), "polygon must have at least 3 corners, got 0");
    const Polygon bad{{{0.0, 0.0}, {1.0, std::nan("")}, {1.0, 1.0}}};
    EXPECT_EQ(message(mask_from_polygon(bad, 1.0)),
              "polygon.corners[1] must be finite, got 1, nan");
    FlatArea area{.polygon = polygon_of({0.0, 0.0, 1.0, 1.0}), .feather = 0.0};
    EXPECT_EQ(message(flatten_heights(good.source, {&area, 1})),
              "areas[0].feather must be > 0 m, got 0");
    area = {.polygon = area.polygon, .height = std::nan("")};
    EXPECT_EQ(message(flatten_heights(good.source, {&area, 1})),
              "areas[0].height must be -2.74878e+11 to 2.74878e+11, got nan");
}

}  // namespace terrane::composed_heights_test
