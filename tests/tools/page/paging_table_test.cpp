// SPDX-License-Identifier: MIT
#include "lab/paging_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace terrane::tools {
namespace paging_table_test {

PagingRow row(PagingChoice policy, std::size_t late_frames, double excess_px_s) {
    PagingRow made;
    made.cell = {.path = "turns",
                 .speed = 100.0,
                 .altitude = {},
                 .latency_ms = 20.0,
                 .bandwidth_mb = 10.0,
                 .memory_mb = 64.0};
    made.policy = policy;
    made.run.totals.frames = 600;
    made.run.totals.late_frames = late_frames;
    made.run.totals.excess_error_px_s = excess_px_s;
    made.run.totals.bytes_loaded = 1000;
    return made;
}

std::vector<PagingRow> three(std::size_t deadline, std::size_t distance, std::size_t oracle) {
    return {row(PagingChoice::deadline, deadline, 0.1 * static_cast<double>(deadline)),
            row(PagingChoice::distance, distance, 0.1 * static_cast<double>(distance)),
            row(PagingChoice::oracle, oracle, 0.1 * static_cast<double>(oracle))};
}

std::vector<std::string> missed(const std::vector<PagingRow>& rows) {
    return judge(rows).front().missed;
}

using Keys = std::vector<std::string>;

TEST(JudgePaging, LateFramesAreComparedWithTheNearestFirstWhereTheOracleHasNone) {
    const std::vector<PagingRow> met = three(5, 100, 0), not_met = three(6, 100, 0);
    EXPECT_DOUBLE_EQ(*judge(met).front().late_ratio, 0.05);
    EXPECT_EQ(missed(met), Keys{});
    EXPECT_EQ(missed(not_met), Keys{"late_frames"});
    EXPECT_EQ(judge(not_met).front().excess_ratio, std::nullopt);
    EXPECT_EQ(missed(three(0, 0, 0)), Keys{});
    const std::vector<PagingRow> worse = three(1, 0, 0);
    EXPECT_TRUE(std::isinf(*judge(worse).front().late_ratio));
    EXPECT_EQ(missed(worse), Keys{"late_frames"});
}

TEST(JudgePaging, ExcessIsComparedWithTheOracleWhereItIsLate) {
    const std::vector<PagingRow> met = three(12, 100, 10), not_met = three(13, 100, 10);
    EXPECT_EQ(judge(met).front().late_ratio, std::nullopt);
    EXPECT_NEAR(*judge(met).front().excess_ratio, 1.2, 1e-12);
    EXPECT_EQ(missed(not_met), Keys{"excess_error_px_s"});
}

TEST(JudgePaging, UnannouncedJumpsExcuseWaste) {
    std::vector<PagingRow> rows = three(0, 0, 0);
    rows[0].run.totals.bytes_wasted = 250;
    EXPECT_EQ(missed(rows), Keys{});
    rows[0].run.totals.bytes_wasted = 251;
    EXPECT_EQ(missed(rows), Keys{"wasted_share"});
    rows[0].has_unannounced_jumps = true;
    EXPECT_EQ(missed(rows), Keys{});
    rows[1].run.totals.bytes_wasted = 1000;
    EXPECT_EQ(missed(rows), Keys{}) << "the others may waste what they like";
}

TEST(JudgePaging, LateGroundIsExcusedWhereTheOracleIsLateToo) {
    std::vector<PagingRow> rows = three(0, 0, 0);
    rows[0].run.totals.contact_late = 1;
    EXPECT_EQ(missed(rows), Keys{"contact_late"});
    rows[2].run.totals.contact_late = 1;
    EXPECT_EQ(missed(rows), Keys{});
}

TEST(JudgePaging, NobodyMayExceedTheCeiling) {
    for (std::size_t i = 0; i < 3; ++i) {
        std::vector<PagingRow> rows = three(0, 0, 0);
        rows[i].run.totals.peak_bytes = std::size_t{64} << 20;
        EXPECT_EQ(missed(rows), Keys{});
        rows[i].run.totals.peak_bytes += 1;
        EXPECT_EQ(missed(rows), Keys{"peak_bytes"}) << i;
    }
}

TEST(JudgePaging, WhatWasNotPlayedIsNotJudged) {
    const std::vector<PagingRow> all = three(600, 0, 0);
    const std::vector<PagingRow> alone{all[0]};
    EXPECT_EQ(missed(alone), Keys{});
    EXPECT_EQ(judge(alone).front().distance, nullptr);
    EXPECT_EQ(missed({all[0], all[1]}), Keys{});
    EXPECT_TRUE(judge(std::vector<PagingRow>{}).empty());
}

TEST(JudgePaging, CellsKeepTheirOrder) {
    std::vector<PagingRow> rows = three(0, 0, 0);
    PagingRow other = rows[0];
    other.cell.memory_mb = 512.0;
    rows.insert(rows.begin() + 1, other);
    const std::vector<PagingVerdict> verdicts = judge(rows);
    ASSERT_EQ(verdicts.size(), 2u);
    EXPECT_EQ(verdicts[0].cell.memory_mb, 64.0);
    EXPECT_EQ(verdicts[0].oracle, &rows[3]);
    EXPECT_EQ(verdicts[1].deadline, &rows[1]);
    EXPECT_EQ(verdicts[1].oracle, nullptr);
}

TEST(IsBetter, CountsLateFramesBeforeExcess) {
    const PagingTotals many = row(PagingChoice::distance, 5, 1.0).run.totals;
    const PagingTotals few = row(PagingChoice::distance, 4, 9.0).run.totals;
    const PagingTotals few_and_small = row(PagingChoice::distance, 4, 8.0).run.totals;
    EXPECT_TRUE(is_better(few, many));
    EXPECT_FALSE(is_better(many, few));
    EXPECT_TRUE(is_better(few_and_small, few));
    EXPECT_FALSE(is_better(few, few));
}

TEST(PagingJson, HasTheKeysThatScriptsRead) {
    PagingRow made = row(PagingChoice::distance, 6, 0.6);
    made.radius = 2.0;
    made.run.totals.bytes_wasted = 250;
    const nlohmann::ordered_json json = to_json(made);
    for (const char* key : {"frames", "late_frames", "late_share", "excess_error_px_s",
                            "bytes_loaded", "bytes_wasted", "peak_bytes", "contact_late"}) {
        EXPECT_TRUE(json.contains(key)) << key;
    }
    EXPECT_EQ(json["policy"], "distance");
    EXPECT_EQ(json["radius"], 2.0);
    EXPECT_EQ(json["late_share"], 0.01);
    EXPECT_EQ(json["wasted_share"], 0.25);
    made.policy = PagingChoice::oracle;
    made.cell.speed.reset();
    EXPECT_TRUE(to_json(made)["radius"].is_null());
    EXPECT_TRUE(to_json(made)["speed"].is_null());
    made.run.totals = {};
    EXPECT_EQ(to_json(made)["wasted_share"], 0.0) << "nothing was loaded";
}

}  // namespace paging_table_test
}  // namespace terrane::tools
