// SPDX-License-Identifier: MIT
#include "lab/crowd.h"

#include "lab/study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace crowd_test {

CrowdLayout layout_of(std::size_t count, CrowdScheme scheme) {
    CrowdLayout layout;
    layout.count = count;
    layout.scheme = scheme;
    return layout;
}

TEST(Crowd, EveryBroadphaseFindsTheSameTouchingPairs) {
    for (const double deviation : {0.0, 3.0}) {
        CrowdLayout layout = layout_of(300, CrowdScheme::brute);
        layout.share = 0.1;
        layout.detail_deviation = deviation;
        Crowd expected(layout);
        layout.scheme = CrowdScheme::sap;
        Crowd sap(layout);
        layout.scheme = CrowdScheme::grid;
        Crowd grid(layout);
        layout.scheme = CrowdScheme::two_scene;
        Crowd two_scene(layout);
        layout.scheme = CrowdScheme::hashed;
        Crowd hashed(layout);
        layout.scheme = CrowdScheme::dense;
        Crowd dense(layout);
        layout.scheme = CrowdScheme::centroid;
        Crowd centroid(layout);
        std::size_t touching = 0;
        for (int step = 0; step < 40; ++step) {
            const CrowdTotals brute = expected.query();
            EXPECT_EQ(brute.candidates, 300u * 299u / 2u);
            touching += brute.touching;
            for (Crowd* crowd : {&sap, &grid, &two_scene, &hashed, &dense, &centroid}) {
                const CrowdTotals query = crowd->query();
                if (crowd != &centroid) {
                    ASSERT_EQ(query.pairs, brute.pairs) << step;
                }
                ASSERT_EQ(query.touching, brute.touching) << step;
                ASSERT_LT(query.candidates, brute.candidates / 4);
                crowd->move(0.3);
            }
            expected.move(0.3);
        }
        EXPECT_GT(touching, 1000u);
    }
}

TEST(Crowd, EverySchemeFindsTheSamePairsOfAnySizeAndAspect) {
    struct Sizes {
        double spread = 1.0, power = 0.0, aspect = 1.0, detail_deviation = 1.0;
    };
    std::size_t touching = 0;
    for (const auto& [spread, power, aspect, deviation] :
         {Sizes{}, Sizes{.aspect = 100.0}, Sizes{.spread = 100.0},
          Sizes{.spread = 100.0, .aspect = 100.0}, Sizes{.spread = 100.0, .power = 2.5},
          Sizes{.spread = 100.0, .power = 2.5, .aspect = 100.0}, Sizes{.detail_deviation = 0.0},
          Sizes{.detail_deviation = 3.0}}) {
        SCOPED_TRACE(testing::Message()
                     << spread << " " << power << " " << aspect << " " << deviation);
        CrowdLayout layout = layout_of(200, CrowdScheme::brute);
        layout.share = 0.2;
        layout.size_spread = spread;
        layout.size_power = power;
        layout.aspect = aspect;
        layout.detail_deviation = deviation;
        Crowd expected(layout);
        std::vector<Crowd> crowds;
        for (const CrowdScheme scheme :
             {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene, CrowdScheme::hashed,
              CrowdScheme::dense}) {
            layout.scheme = scheme;
            crowds.emplace_back(layout);
        }
        layout.scheme = CrowdScheme::centroid;
        Crowd of_spheres(layout);
        std::size_t pairs = 0;
        for (int step = 0; step < 10; ++step) {
            const CrowdTotals brute = expected.query();
            EXPECT_EQ(brute.candidates, 200u * 199u / 2u);
            pairs += brute.pairs;
            touching += brute.touching;
            for (Crowd& crowd : crowds) {
                const CrowdTotals query = crowd.query();
                ASSERT_EQ(query.pairs, brute.pairs) << step;
                ASSERT_EQ(query.touching, brute.touching) << step;
                crowd.move(0.3);
            }
            ASSERT_EQ(of_spheres.query().touching, brute.touching) << step;
            of_spheres.move(0.3);
            expected.move(0.3);
        }
        EXPECT_GT(pairs, 100u);
    }
    EXPECT_GT(touching, 300u);
}

TEST(Crowd, SchemesTestAFewOfThePairs) {
    for (const CrowdScheme scheme :
         {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene, CrowdScheme::hashed,
          CrowdScheme::dense, CrowdScheme::centroid}) {
        CrowdLayout layout = layout_of(300, scheme);
        layout.share = 0.1;
        Crowd crowd(layout);
        for (int step = 0; step < 5; ++step) {
            EXPECT_LT(crowd.query().candidates, 300u * 299u / 2u / 4u);
            crowd.move(0.3);
        }
    }
}

TEST(Crowd, TwoScenesComputeBoxesOfPairsOfCubesOnly) {
    CrowdLayout layout = layout_of(20, CrowdScheme::two_scene);
    layout.room = 80.0;
    Crowd crowd(layout);
    std::size_t boxes = 0;
    for (int step = 0; step < 100; ++step) {
        const CrowdTotals query = crowd.query();
        EXPECT_LE(query.pairs, query.boxes);
        boxes += query.boxes;
        crowd.move(1.0);
    }
    EXPECT_GT(boxes, 0u);
    EXPECT_LT(boxes, 100u * 20u / 4u);
}

TEST(Crowd, StaysInARoomOfTheWidthAskedFor) {
    CrowdLayout layout = layout_of(5, CrowdScheme::sap);
    layout.room = 80.0;
    EXPECT_EQ(Crowd(layout).width(), 80.0);
    // no narrower than its largest body
    layout.room = 1.0;
    EXPECT_EQ(Crowd(layout).width(), 2.0);
}

TEST(Crowd, HasSizesOfItsPower) {
    // the room's volume is that of all spheres over the share: compares the mean cube of the radii
    for (const double power : {0.0, 1.0, 2.5}) {
        CrowdLayout layout = layout_of(20'000, CrowdScheme::hashed);
        layout.size_spread = 9.0;
        layout.size_power = power;
        double weights = 0.0, cubes = 0.0;
        for (int size = 0; size < 100; ++size) {
            const double radius = std::pow(9.0, size / 99.0 - 0.5);
            weights += std::pow(radius, -power);
            cubes += std::pow(radius, 3.0 - power);
        }
        const double volume =
            4.0 / 3.0 * std::numbers::pi * 20'000.0 * cubes / weights / layout.share;
        EXPECT_NEAR(std::pow(Crowd(layout).width(), 3.0) / volume, 1.0, 0.05) << power;
    }
}

TEST(Crowd, DentedBodiesTouchLessOftenThanConvexOnes) {
    CrowdLayout layout = layout_of(60, CrowdScheme::hashed);
    layout.share = 0.2;
    layout.detail = 4.0;
    layout.detail_deviation = 0.0;
    Crowd convex(layout);
    layout.is_dented = true;
    Crowd dented(layout);
    EXPECT_EQ(dented.corner_count(), convex.corner_count());
    std::size_t of_convex = 0, of_dented = 0;
    for (int step = 0; step < 20; ++step) {
        of_convex += convex.query().touching;
        of_dented += dented.query().touching;
        convex.move(0.5);
        dented.move(0.5);
    }
    EXPECT_GT(of_dented, 0u);
    EXPECT_LT(of_dented, of_convex);
}

TEST(Crowd, OneBodyTouchesNothing) {
    Crowd crowd(layout_of(1, CrowdScheme::grid));
    for (int step = 0; step < 10; ++step) {
        const CrowdTotals query = crowd.query();
        EXPECT_EQ(query.pairs, 0u);
        EXPECT_EQ(query.touching, 0u);
        crowd.move(1e3);
    }
}

TEST(Crowd, HasTheCornerCountOfItsDetail) {
    CrowdLayout layout = layout_of(10, CrowdScheme::sap);
    layout.detail = 5.0;
    layout.detail_deviation = 0.0;
    EXPECT_EQ(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
    layout.detail_deviation = 2.0;
    EXPECT_NE(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
}

TEST(Crowd, BallsTouchAboutAsOftenAsProbabilitySays) {
    // two spheres of radius r in a volume V overlap with probability 32 / 3 pi r^3 / V; bodies of many corners are
    // nearly spheres
    CrowdLayout layout = layout_of(200, CrowdScheme::grid);
    layout.detail = 20.0;
    layout.detail_deviation = 0.0;
    Crowd crowd(layout);
    double touching = 0.0;
    constexpr int kSteps = 60;
    for (int step = 0; step < kSteps; ++step) {
        touching += static_cast<double>(crowd.query().touching);
        crowd.move(5.0);
    }
    // n^2 / 2 pairs times 8 times the share of a sphere, share / n
    const double expected = 4.0 * 200.0 * layout.share;
    // the walls confine centres to less than the room
    EXPECT_GT(touching / kSteps, expected);
    EXPECT_LT(touching / kSteps, 2.0 * expected);
}

}  // namespace crowd_test

namespace study_test {

TEST(LogLogSlope, IsThePowerOfAPowerLaw) {
    std::vector<double> x, y;
    for (const double at : {0.5, 1.0, 7.0, 300.0}) {
        x.push_back(at);
        y.push_back(3.0 * std::pow(at, 1.7));
    }
    EXPECT_NEAR(log_log_slope(x, y).value(), 1.7, 1e-12);
}

TEST(LogLogSlope, IsAbsentForOnePoint) {
    const std::array<double, 2> x{5.0, 5.0}, y{1.0, 2.0};
    EXPECT_FALSE(log_log_slope(x, y));
    EXPECT_FALSE(log_log_slope({}, {}));
}

TEST(SignChange, HasAllNegativeValuesBelowAndAllPositiveValuesAbove) {
    const std::array<double, 6> x{8.0, 16.0, 24.0, 32.0, 40.0, 48.0};
    const auto change = [&x](const std::array<double, 6>& values) {
        const std::optional<SignChange> found = find_sign_change(x, values);
        return found ? std::pair(found->from, found->to) : std::pair(0.0, 0.0);
    };
    EXPECT_EQ(change({-3, -2, -1, 1, 2, 3}), std::pair(24.0, 32.0));
    EXPECT_EQ(change({-3, -2, 0, 0, 2, 3}), std::pair(16.0, 40.0));
    EXPECT_EQ(change({-3, 1, -1, 1, -1, 3}), std::pair(16.0, 40.0));  // noise
    EXPECT_EQ(change({1, 1, 1, 1, 1, 1}), std::pair(0.0, 0.0));
    EXPECT_EQ(change({-1, -1, -1, -1, -1, 0}), std::pair(0.0, 0.0));
    EXPECT_FALSE(find_sign_change({}, {}));
}

TEST(PowerLaw, FindsTheFixedCostBesideThePower) {
    std::vector<double> x, y;
    for (const double at : {1.0, 5.0, 20.0, 50.0, 200.0}) {
        x.push_back(at);
        y.push_back(4.0 + 0.5 * std::pow(at, 1.25));
    }
    const PowerLaw law = fit_power_law(x, y).value();
    EXPECT_NEAR(law.power, 1.25, 1e-9);
    EXPECT_NEAR(law.fixed, 4.0, 1e-6);
    EXPECT_NEAR(law.factor, 0.5, 1e-6);
    // the fixed cost is not taken for a power below 1
    EXPECT_LT(log_log_slope(x, y).value(), 1.0);
}

TEST(PowerLaw, SaysWhereThePowerMeansLittle) {
    const std::array<double, 5> x{1.0, 5.0, 20.0, 50.0, 200.0};
    for (const double factor : {0.001, 1.0}) {
        std::array<double, 5> y{};
        std::transform(x.begin(), x.end(), y.begin(),
                       [factor](double at) { return 4.0 + factor * at; });
        const PowerLaw law = fit_power_law(x, y).value();
        EXPECT_NEAR(law.fixed_share, 4.0 / y.back(), 1e-3);
        EXPECT_EQ(law.is_mostly_fixed(), factor < 1.0);
    }
}

TEST(PowerLaw, IsAbsentForThreePointsOrATimeOfZero) {
    const std::array<double, 4> x{1.0, 2.0, 3.0, 4.0}, y{1.0, 2.0, 0.0, 4.0};
    EXPECT_FALSE(fit_power_law(std::span(x).first(3), std::span(x).first(3)));
    EXPECT_FALSE(fit_power_law(x, y));
}

// A point whose schemes take the given times, microseconds a query and an update.
StudyPoint point_of(double x, std::span<const std::array<double, 2>> times) {
    StudyPoint point;
    point.x = x;
    for (const auto& [query_us, update_us] : times) {
        CrowdTotals totals;
        totals.queries = 1;
        totals.query_ms = 1e-3 * query_us;
        totals.update_ms = 1e-3 * update_us;
        point.measured.push_back(totals);
    }
    return point;
}

// A table without points.
StudyTable table_of(const std::string& key, const std::vector<std::string>& series) {
    StudyTable table;
    table.key = key;
    table.x_name = "bodies";
    for (const std::string& name : series) table.series.push_back({.name = name});
    return table;
}

std::string findings_of(const StudyTable& table) {
    std::string all;
    for (const std::string& finding : study_findings(table)) all += finding + "\n";
    return all;
}

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

using Times = std::array<double, 2>;

TEST(StudyFindings, JudgeTheClaimByTheMeasuredRatio) {
    StudyTable table = table_of("count", {"sap"});
    table.points.push_back(point_of(50.0, std::array<Times, 1>{{{1000.0, 5.0}}}));
    table.points[0].published_query_ms = 6.0;
    table.points[0].published_update_ms = 0.1;
    EXPECT_TRUE(has(findings_of(table), "are 60 to 1; sap: a query of 1000 us"));
    EXPECT_TRUE(has(findings_of(table), "so it is"));
    table.points[0].measured[0].update_ms = 1.0;
    EXPECT_TRUE(has(findings_of(table), "not so"));
}

TEST(StudyFindings, SortPowersByTheWantedOne) {
    StudyTable table = table_of("count", {"linear", "square", "flat"});
    for (const double x : {1.0, 5.0, 10.0, 20.0, 50.0}) {
        table.points.push_back(point_of(
            x, std::array<Times, 3>{{{2.0 + x, 0.0}, {1.0 + x * x, 0.0}, {1e6 + x * x, 0.0}}}));
    }
    const std::string queries = study_findings(table).front();
    EXPECT_TRUE(has(queries, "At most 1.05: linear 1.00 (2 us fixed).")) << queries;
    EXPECT_TRUE(has(queries, "Above: square 2.00 (1 us fixed).")) << queries;
    EXPECT_TRUE(has(queries, "Mostly fixed: flat (1000000 us fixed).")) << queries;
}

TEST(StudyFindings, SeeARiseAndAPlateauOnlyWhereTheyAre) {
    StudyTable table = table_of("radius", {"sap"});
    const std::array<double, 4> pairs{1.0, 50.0, 185.0, 190.0};
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const double x = static_cast<double>(1 + i);
        table.points.push_back(point_of(x, std::array<Times, 1>{{{10.0 * x, 1.0}}}));
        table.points.back().measured[0].pairs = static_cast<std::size_t>(pairs[i]);
    }
    EXPECT_TRUE(has(findings_of(table), "from radius 1 to 2 a query by sweep-and-prune takes 2 "));
    EXPECT_TRUE(has(findings_of(table), "Plateau: from radius 3 on"));
    table.points.pop_back();
    table.points.pop_back();
    EXPECT_TRUE(has(findings_of(table), "No plateau"));
}

TEST(StudyFindings, NameTheRatioOfDenseAndHashedUpdates) {
    StudyTable table = table_of("equal", {"hashed", "dense"});
    table.points.push_back(point_of(1.0, std::array<Times, 2>{{{1.0, 0.5}, {2.0, 54.0}}}));
    table.points.push_back(point_of(20.0, std::array<Times, 2>{{{1.0, 0.5}, {2.0, 60.0}}}));
    EXPECT_TRUE(has(findings_of(table), "120 times less, at least the 100"));
    table.points[1].measured[1].update_ms = 0.02;
    EXPECT_TRUE(has(findings_of(table), "40 times less, less than the 100"));
}

TEST(StudyFindings, ComparePublishedTimesWithTheGridOfCentroids) {
    StudyTable table = table_of("equal", {"sap", "hashed", "dense", "centroid"});
    table.points.push_back(
        point_of(20.0, std::array<Times, 4>{{{1.0, 2.0}, {1.0, 2.0}, {2.0, 60.0}, {4.0, 32.0}}}));
    table.points[0].measured[3].candidates = 7;
    table.points[0].measured[3].pairs = 3;
    EXPECT_TRUE(has(findings_of(table),
                    "grid of centroids compares 7 pairs of spheres and tests 3 for contact, 4 us"))
        << findings_of(table);
    std::vector<std::string> rows;
    for (const Comparison& each : compare_with_published(table)) {
        rows.push_back(each.what);
        if (each.what != "update, grid of centroids, 20 bodies") continue;
        EXPECT_EQ(each.published_ms, 65.0);
        EXPECT_EQ(each.our_ms, 0.032);
        EXPECT_TRUE(has(each.reason, "64000 lists there and 0.5 ns here")) << each.reason;
    }
    EXPECT_EQ(rows,
              (std::vector<std::string>{
                  "query, grid of centroids, 20 bodies", "update, grid of centroids, 20 bodies",
                  "query, dense grid, 20 bodies", "update, dense grid, 20 bodies"}));
}

TEST(StudyFindings, NameTheSchemesThatNeedSimilarBodies) {
    StudyTable table = table_of("spread_1000", {"sap", "grid"});
    table.points.push_back(point_of(1.0, std::array<Times, 2>{{{10.0, 0.0}, {8.0, 0.0}}}));
    table.points.push_back(point_of(10.0, std::array<Times, 2>{{{10.0, 0.0}, {30.0, 0.0}}}));
    table.points.push_back(point_of(100.0, std::array<Times, 2>{{{11.0, 0.0}, {110.0, 0.0}}}));
    table.left_out.push_back({1000.0, "grid", 77.0});
    table.most_seconds = 30.0;
    const std::string all = findings_of(table);
    EXPECT_TRUE(has(all, "needs similar bodies: grid 10 (from 10 on). Not so: sap 0.8.")) << all;
    EXPECT_TRUE(has(all, "longer than 30 s by the growth from fewer bodies: grid at 1000 (77 s)"))
        << all;
}

TEST(StepTimes, GrowWithThePowerOfTheLargestCounts) {
    StepTimes times;
    EXPECT_FALSE(times.seconds_at("a", "b", 1000));
    times.add("a", 10, 1.0);
    EXPECT_FALSE(times.seconds_at("a", "b", 10));
    EXPECT_DOUBLE_EQ(times.seconds_at("a", "b", 100).value(), 100.0);
    times.add("b", 10, 1.0);
    times.add("b", 100, std::pow(10.0, 1.5));
    EXPECT_NEAR(times.seconds_at("a", "b", 1000).value(), 1000.0, 1e-9);
    times.add("a", 100, 10.0);
    EXPECT_NEAR(times.seconds_at("a", "b", 1000).value(), 100.0, 1e-9);
    // neither below linear nor above quadratic
    times.add("a", 1000, 11.0);
    EXPECT_NEAR(times.seconds_at("a", "b", 2000).value(), 22.0, 1e-9);
    times.add("a", 10'000, 1e9);
    EXPECT_NEAR(times.seconds_at("a", "b", 20'000).value(), 4e9, 1.0);
}

TEST(Study, LeavesOutWhatIsEstimatedToTakeTooLong) {
    StudySettings settings;
    settings.seconds_a_point = 1e-4;
    settings.most_seconds_a_point = 1e-6;
    settings.most_bodies = 3000;
    std::vector<StudyTable> wanted = make_study_tables(settings);
    std::erase_if(wanted, [](const StudyTable& table) { return table.key != "many"; });
    const std::vector<StudyTable> tables =
        measure_tables(std::move(wanted), settings, [](double) {});
    ASSERT_EQ(tables.size(), 1u);
    const StudyTable* const many = tables.data();
    ASSERT_EQ(many->left_out.size(), many->series.size());
    for (const LeftOut& left : many->left_out) {
        EXPECT_EQ(left.x, 3000.0);
        EXPECT_GT(left.seconds, settings.most_seconds_a_point);
        EXPECT_EQ(many->totals_at(3000.0, left.series), nullptr);
        EXPECT_NE(many->totals_at(1000.0, left.series), nullptr);
    }
    EXPECT_TRUE(has(findings_of(*many), "Left out"));
}

TEST(Study, MeasuresAndReportsEveryPublishedPoint) {
    StudySettings settings;
    settings.seconds_a_point = 0.001;
    settings.most_bodies = 300;
    double last = -1.0;
    const std::vector<StudyTable> tables =
        measure_tables(make_study_tables(settings), settings, [&](double share) {
            EXPECT_GT(share, last);
            EXPECT_LT(share, 1.0);
            last = share;
        });
    std::vector<std::string> keys;
    std::size_t published = 0;
    for (const StudyTable& table : tables) {
        keys.push_back(table.key);
        for (const StudyPoint& point : table.points) {
            ASSERT_EQ(point.measured.size(), table.series.size());
            published += point.published_query_ms ? 1u : 0u;
            for (const CrowdTotals& totals : point.measured) {
                EXPECT_GE(totals.queries, 5u);
                EXPECT_GT(totals.query_ms, 0.0);
            }
        }
        EXPECT_FALSE(to_json(table)["findings"].empty()) << table.key;
    }
    EXPECT_EQ(keys, (std::vector<std::string>{"count", "many", "detail", "radius", "equal"}));
    EXPECT_EQ(published, 11u + 7u + 5u + 1u);
    EXPECT_EQ(tables[0].points.size(), 11u);
    EXPECT_EQ(tables[1].points.size(), 2u);  // 100 and 300
}

TEST(CrowdTotals, CountPositiveQueriesSeparately) {
    CrowdTotals totals;
    Crowd alone(crowd_test::layout_of(1, CrowdScheme::sap));
    totals.add(alone.query());
    EXPECT_EQ(totals.positive_queries, 0u);
    EXPECT_EQ(totals.mean_positive_ms(), 0.0);
    CrowdLayout layout = crowd_test::layout_of(20, CrowdScheme::sap);
    layout.room = 3.0;
    Crowd crowded(layout);
    const CrowdTotals query = crowded.query();
    ASSERT_GT(query.touching, 0u);
    totals.add(query);
    EXPECT_EQ(totals.queries, 2u);
    EXPECT_EQ(totals.positive_queries, 1u);
    EXPECT_EQ(totals.mean_positive_ms(), query.query_ms);
    EXPECT_EQ(totals.mean_query_ms(), totals.query_ms / 2.0);
}

}  // namespace study_test
}  // namespace terrane::tools
