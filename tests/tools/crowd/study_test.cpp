// SPDX-License-Identifier: MIT
#include "crowd/study.h"

#include "crowd/study_report.h"

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
        EXPECT_GT(least_speedup(table).value(), 0.0);
    }
    EXPECT_EQ(keys, (std::vector<std::string>{"count", "detail", "radius", "equal"}));
    EXPECT_EQ(published, 11u + 7u + 5u + 1u);
    // 11 published ones, and 100 and 300
    EXPECT_EQ(tables[0].points.size(), 13u);

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
