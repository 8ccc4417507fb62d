// SPDX-License-Identifier: MIT
#include "lab/paging_table.h"

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace terrane::tools {
namespace page_options_test {

/// The options of a command line, or the message that refuses it.
tl::expected<PageOptions, std::string> parse(std::vector<std::string> arguments) {
    CLI::App app;
    PageOptions options;
    add_page_options(app, options);
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them in reverse
    try {
        app.parse(arguments);
    } catch (const CLI::ParseError& error) {
        return tl::unexpected<std::string>(error.what());
    }
    return options;
}

TEST(PageOptions, EveryCombinationOfListsIsACell) {
    const auto options = parse({"--path", "straight,orbit", "--speed", "50,250", "--latency-ms",
                                "5,20,100", "--bandwidth-mb", "10", "--memory-mb", "64,512"});
    ASSERT_TRUE(options) << options.error();
    std::vector<PagingCell> expected;
    for (const char* path : {"straight", "orbit"})
        for (const double speed : {50.0, 250.0})
            for (const double latency : {5.0, 20.0, 100.0})
                for (const double memory : {64.0, 512.0})
                    expected.push_back({path, speed, {}, latency, 10.0, memory});
    EXPECT_EQ(list_cells(*options), expected);
}

TEST(PageOptions, APathMayBringItsOwnSpeedAndAltitude) {
    const auto options = parse(
        {"--path", "straight@1000,canyon@100:30,turns", "--speed", "50,60", "--altitude", "300"});
    ASSERT_TRUE(options) << options.error();
    EXPECT_EQ(list_cells(*options),
              (std::vector<PagingCell>{{"straight", 1000.0, 300.0, 20, 100, 512},
                                       {"canyon", 100.0, 30.0, 20, 100, 512},
                                       {"turns", 50.0, 300.0, 20, 100, 512},
                                       {"turns", 60.0, 300.0, 20, 100, 512}}));
    const auto without = parse({"--path", "spins"});
    ASSERT_TRUE(without) << without.error();
    EXPECT_EQ(list_cells(*without), (std::vector<PagingCell>{{"spins", {}, {}, 20, 100, 512}}));
}

TEST(PathItem, AnAtThatIsNoSpeedBelongsToTheName) {
    EXPECT_EQ(parse_path_item("a@b.csv").name, "a@b.csv");
    EXPECT_EQ(parse_path_item("a@b.csv@20").name, "a@b.csv");
    EXPECT_EQ(parse_path_item("a@b.csv@20").speed, 20.0);
    for (const char* text : {"turns@", "turns@-5", "turns@0", "turns@5:", "turns@5:0", "turns@5:x",
                             "turns@:5", "turns@nan", "turns@5 "}) {
        const PathItem item = parse_path_item(text);
        EXPECT_EQ(item.name, text);
        EXPECT_EQ(item.speed, std::nullopt) << text;
    }
}

TEST(PageOptions, ReachTheSettingsOfARun) {
    std::istringstream words(
        "--latency-ms 5 --bandwidth-mb 10 --memory-mb 64 --slots 3 --latency-spread 0.5 "
        "--failure-share 0.1 --hang-share 0.2 --storage-seed 9 --horizon-s 2 --contact-share 0.25 "
        "--fps 60 --bodies 3 --announce-s 2 --max-error-px 1.5 --budget 5000 --size 640x480");
    const auto options = parse({std::istream_iterator<std::string>(words), {}});
    ASSERT_TRUE(options) << options.error();
    const PagingRunSettings settings =
        run_settings(*options, list_cells(*options).front(), PagingChoice::distance, 2.0);
    EXPECT_EQ(settings.policy, PagingChoice::distance);
    EXPECT_EQ(settings.maker.pager.distance_radius, 2.0);
    EXPECT_EQ(settings.maker.pager.memory_bytes, std::size_t{64} << 20);
    EXPECT_EQ(settings.maker.pager.horizon, 2.0);
    EXPECT_EQ(settings.maker.pager.contact_share, 0.25);
    EXPECT_EQ(settings.maker.triangulator.max_error_px, 1.5);
    EXPECT_EQ(settings.maker.triangulator.triangle_budget, 5000u);
    EXPECT_DOUBLE_EQ(settings.storage.latency, 0.005);
    EXPECT_DOUBLE_EQ(settings.storage.bandwidth, 10e6);
    EXPECT_EQ(settings.storage.slots, 3);
    EXPECT_EQ(settings.storage.latency_spread, 0.5);
    EXPECT_EQ(settings.storage.failure_share, 0.1);
    EXPECT_EQ(settings.storage.hang_share, 0.2);
    EXPECT_EQ(settings.storage.seed, 9u);
    EXPECT_EQ(settings.view.width_px, 640);
    EXPECT_EQ(settings.fps, 60.0);
    EXPECT_EQ(settings.body_count, 3u);
    EXPECT_EQ(settings.announce, 2.0);
}

}  // namespace page_options_test

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
    made.run.totals.excess_error = {.all_px_s = 99.0, .late_px_s = excess_px_s};
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
    EXPECT_EQ(missed(not_met), Keys{"late_excess_error_px_s"});
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

TEST(PagingJson, HasSharesAndNullsForWhatARunHasNot) {
    PagingRow made = row(PagingChoice::distance, 6, 0.6);
    made.radius = 2.0;
    made.run.totals.bytes_wasted = 250;
    EXPECT_EQ(to_json(made)["late_share"], 0.01);
    EXPECT_EQ(to_json(made)["wasted_share"], 0.25);
    made.policy = PagingChoice::oracle;
    made.cell.speed.reset();
    EXPECT_TRUE(to_json(made)["radius"].is_null());
    EXPECT_TRUE(to_json(made)["speed"].is_null());
    made.run.totals = {};
    EXPECT_EQ(to_json(made)["wasted_share"], 0.0) << "nothing was loaded";
}

}  // namespace paging_table_test
}  // namespace terrane::tools
