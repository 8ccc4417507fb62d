// SPDX-License-Identifier: MIT
#include "crowd/study/study.h"

#include "crowd/study/power_law.h"
#include "crowd/study/study_findings.h"
#include "crowd/study/study_plans.h"
#include "crowd/study/study_report.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace terrane::tools {
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

TEST(StudyFindings, JudgeTheClaimByTheMeasuredRatio) {
    StudyTable table;
    table.key = "count";
    table.x_name = "bodies";
    table.series = {"sap"};
    table.points.push_back(point_of(50.0, std::array<std::array<double, 2>, 1>{{{1000.0, 5.0}}}));
    const auto claims = [&] {
        std::string all;
        for (const std::string& finding : study_findings(table)) all += finding;
        return all;
    };
    EXPECT_NE(claims().find("so it is here"), std::string::npos);
    table.points[0].measured[0].update_ms = 1.0;
    EXPECT_NE(claims().find("not here"), std::string::npos);
}

TEST(StudyFindings, NameTheRatioOfDenseAndHashedUpdates) {
    StudyTable table;
    table.key = "equal";
    table.x_name = "bodies";
    table.series = {"hashed", "dense"};
    table.points.push_back(
        point_of(20.0, std::array<std::array<double, 2>, 2>{{{1.0, 0.5}, {2.0, 60.0}}}));
    EXPECT_NE(study_findings(table).front().find("120 times less"), std::string::npos);
}

TEST(Study, MeasuresAndReportsEveryPublishedPoint) {
    StudySettings settings;
    settings.seconds_a_point = 0.001;
    settings.most_bodies = 300;
    double last = -1.0;
    const std::vector<StudyTable> tables = run_study(settings, [&](double share) {
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

    const std::string path = testing::TempDir() + "study_report.html";
    ASSERT_TRUE(write_study_report(
        path, {.title = "Many bodies", .command_line = "terrane", .film = "", .summary = {}},
        tables));
    std::ifstream file(path, std::ios::binary);
    const std::string page{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    for (const StudyTable& table : tables) {
        EXPECT_NE(page.find("\"" + table.key + "\""), std::string::npos);
    }
    EXPECT_NE(page.find("\"published_query_ms\":0.167"), std::string::npos);
    std::filesystem::remove(path);
}

TEST(CrowdTotals, CountPositiveQueriesSeparately) {
    CrowdTotals totals;
    CrowdQuery query;
    query.query_ms = 1.0;
    totals.add(query);
    EXPECT_EQ(totals.mean_positive_ms(), 0.0);
    query.query_ms = 3.0;
    query.touching = 2;
    totals.add(query);
    EXPECT_EQ(totals.queries, 2u);
    EXPECT_EQ(totals.positive_queries, 1u);
    EXPECT_EQ(totals.mean_query_ms(), 2.0);
    EXPECT_EQ(totals.mean_positive_ms(), 3.0);
}

}  // namespace study_test
}  // namespace terrane::tools
