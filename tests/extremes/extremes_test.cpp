// SPDX-License-Identifier: MIT
// The table of extremes: every row keeps its promise over its range, and says where the range ends.
#include "extremes/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <ostream>
#include <set>
#include <string>
#include <vector>

namespace terrane::extremes {

/// For messages of GoogleTest.
void PrintTo(const ExtremeRow& row, std::ostream* out) { *out << row.name; }

namespace extremes_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

class ExtremeRows : public testing::TestWithParam<ExtremeRow> {};

/// Whether the values that take minutes are measured too.
bool is_long() { return std::getenv("TERRANE_EXTREMES_LONG") != nullptr; }

TEST_P(ExtremeRows, KeepTheirPromiseAtEveryValue) {
    const ExtremeRow& row = GetParam();
    const std::vector<double>& values = is_long() ? row.long_values : row.values;
    for (const double value : values) {
        EXPECT_EQ(row.refusal(value), "") << value;
        const double figure = row.measure(value);
        EXPECT_TRUE(keeps_promise(row, figure))
            << row.figure << " is " << figure << ", more than " << row.limit << ", at " << value
            << ": " << row.swept;
    }
}

TEST_P(ExtremeRows, EndWithAMessageThatNamesTheThing) {
    const ExtremeRow& row = GetParam();
    if (row.ends.empty()) {
        EXPECT_NE(row.note, "") << "neither an end nor a reason why there is none";
    }
    for (const RangeEnd& end : row.ends) {
        EXPECT_EQ(row.refusal(end.accepted), "") << end.accepted;
        const FoundEnd found = find_end(row, end);
        SCOPED_TRACE(testing::Message() << "first refused: " << found.first_refused);
        EXPECT_NE(found.message.find(end.message), std::string::npos) << found.message;
        EXPECT_NE(found.far_message.find(end.message), std::string::npos) << found.far_message;
        // A result names the value; a status has no room for it.
        const bool is_status = found.message.find("::") != std::string::npos;
        EXPECT_TRUE(is_status || found.message.find("got ") != std::string::npos ||
                    found.message.find("gave ") != std::string::npos)
            << found.message;
        EXPECT_EQ(found.message.find('\n'), std::string::npos);
        for (const double value : row.values) {
            const bool is_beyond = end.refused > end.accepted ? value >= found.first_refused
                                                              : value <= found.first_refused;
            EXPECT_FALSE(is_beyond) << value;
        }
    }
}

TEST_P(ExtremeRows, RefuseWhatIsNoNumber) {
    const ExtremeRow& row = GetParam();
    if (row.ends.empty() || row.ends.front().is_whole || row.ends.back().is_whole) {
        GTEST_SKIP() << "whole numbers";
    }
    EXPECT_NE(row.refusal(kNan), "");
    EXPECT_NE(row.refusal(kInfinite), "");
    EXPECT_NE(row.refusal(-kInfinite), "");
}

INSTANTIATE_TEST_SUITE_P(All, ExtremeRows, testing::ValuesIn(all_rows()),
                         [](const testing::TestParamInfo<ExtremeRow>& row) {
                             return row.param.name;
                         });

TEST(AllRows, SayWhatTheySweepInWordsOfTheirOwn) {
    std::set<std::string> swept;
    for (const ExtremeRow& row : all_rows()) {
        EXPECT_TRUE(swept.insert(row.swept).second) << row.name << ": " << row.swept;
    }
}

ExtremeRow row_to(double last) {
    ExtremeRow row;
    row.refusal = [last](double value) -> std::string {
        return value <= last && value >= -last ? "" : "got too much";
    };
    return row;
}

TEST(FindEnd, FindsNeighbouringDoubles) {
    for (const double last : {0.0, 1e-300, 0.1, 1.0, 1e9, 1e300}) {
        const ExtremeRow row = row_to(last);
        const FoundEnd above = find_end(row, {0.0, kInfinite});
        EXPECT_EQ(above.last_accepted, last);
        EXPECT_EQ(above.first_refused, std::nextafter(last, kInfinite));
        EXPECT_EQ(above.message, "got too much");
        const FoundEnd below = find_end(row, {0.0, -kInfinite});
        EXPECT_EQ(below.last_accepted, -last);
        EXPECT_EQ(below.first_refused, std::nextafter(-last, -kInfinite));
    }
}

TEST(FindEnd, FindsNeighbouringWholeNumbers) {
    const ExtremeRow row = row_to(1000.5);
    const FoundEnd above = find_end(row, {2.0, 1e9, true});
    EXPECT_EQ(above.last_accepted, 1000.0);
    EXPECT_EQ(above.first_refused, 1001.0);
    EXPECT_EQ(find_end(row, {2.0, -1e9, true}).last_accepted, -1000.0);
}

TEST(KeepsPromise, HoldsUpToTheLimitAndForNoNumberThatIsNotFinite) {
    const ExtremeRow row{.limit = 0.5};
    EXPECT_TRUE(keeps_promise(row, 0.5));
    EXPECT_FALSE(keeps_promise(row, 0.6));
    EXPECT_FALSE(keeps_promise(row, kNan));
    EXPECT_FALSE(keeps_promise(row, kInfinite));
    EXPECT_FALSE(keeps_promise(row, -kInfinite));
}

TEST(ExtremesTable, ShowsValuesFiguresAndEnds) {
    ExtremeRow row = row_to(2.0);
    row.name = "Width";
    row.topic = "Widths";
    row.swept = "width, m";
    row.promise = "It is kept.";
    row.figure = "share \"of\" it";
    row.values = {1.0, 2.0};
    row.long_values = {1.5};
    row.measure = [](double value) { return 0.25 * value; };
    row.ends = {{1.0, 3.0, true}};
    std::vector<double> begun;
    const MeasuredRow measured = measure(row, true, [&](double value) { begun.push_back(value); });
    EXPECT_EQ(begun, measured.values);
    EXPECT_EQ(measured.figures, (std::vector<double>{0.25, 0.5, 0.375}));
    const std::string page = to_markdown({&measured, 1});
    EXPECT_NE(page.find("| width, m | 1 | 2 | 0.5 | 1 | - | 2 |"), std::string::npos) << page;
    EXPECT_NE(page.find("| 1 | 2 | 1.5 |\n|---|---|---|\n| 0.25 | 0.5 | 0.375 |"),
              std::string::npos);
    EXPECT_NE(page.find("- 2 is accepted, 3 refused. Far beyond: \"got too much\"."),
              std::string::npos);
    MeasuredRow failed = measured;
    failed.figures[1] = kNan;
    EXPECT_NE(to_markdown({&failed, 1}).find("| width, m | 1 | 2 | nan | 1 |"), std::string::npos);
    const std::string json = to_json({&measured, 1});
    EXPECT_NE(json.find("\"figures\":[0.25,0.5,0.375]"), std::string::npos) << json;
    EXPECT_NE(json.find("share \\\"of\\\" it"), std::string::npos);
}

}  // namespace extremes_test
}  // namespace terrane::extremes
