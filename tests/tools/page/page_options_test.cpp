// SPDX-License-Identifier: MIT
#include "lab/paging_table.h"

#include <gtest/gtest.h>

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
    const std::vector<PagingCell> cells = list_cells(*options);
    ASSERT_EQ(cells.size(), 24u);
    EXPECT_EQ(cells[0], (PagingCell{"straight", 50.0, {}, 5.0, 10.0, 64.0}));
    EXPECT_EQ(cells[1], (PagingCell{"straight", 50.0, {}, 5.0, 10.0, 512.0}));
    EXPECT_EQ(cells[2], (PagingCell{"straight", 50.0, {}, 20.0, 10.0, 64.0}));
    EXPECT_EQ(cells[6], (PagingCell{"straight", 250.0, {}, 5.0, 10.0, 64.0}));
    EXPECT_EQ(cells[23], (PagingCell{"orbit", 250.0, {}, 100.0, 10.0, 512.0}));
}

TEST(PageOptions, WithoutASpeedAPathKeepsItsOwn) {
    const auto options = parse({"--path", "spins"});
    ASSERT_TRUE(options);
    EXPECT_EQ(list_cells(*options), (std::vector<PagingCell>{{"spins", {}, {}, 20, 100, 512}}));
}

TEST(PageOptions, APathMayBringItsOwnSpeedAndAltitude) {
    const auto options = parse(
        {"--path", "straight@1000,canyon@100:30,turns", "--speed", "50,60", "--altitude", "300"});
    ASSERT_TRUE(options) << options.error();
    const std::vector<PagingCell> cells = list_cells(*options);
    ASSERT_EQ(cells.size(), 4u);
    EXPECT_EQ(cells[0], (PagingCell{"straight", 1000.0, 300.0, 20, 100, 512}));
    EXPECT_EQ(cells[1], (PagingCell{"canyon", 100.0, 30.0, 20, 100, 512}));
    EXPECT_EQ(cells[2], (PagingCell{"turns", 50.0, 300.0, 20, 100, 512}));
    EXPECT_EQ(cells[3], (PagingCell{"turns", 60.0, 300.0, 20, 100, 512}));
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

TEST(PageOptions, PoliciesAreParsedInOrder) {
    const auto options = parse({"--policy", "oracle,deadline,distance"});
    ASSERT_TRUE(options);
    EXPECT_EQ(options->policies,
              (std::vector{PagingChoice::oracle, PagingChoice::deadline, PagingChoice::distance}));
}

TEST(PageOptions, BadValuesAreRefusedByALineThatNamesFlagAndValue) {
    const std::vector<std::pair<std::string, std::string>> bad{
        {"--latency-ms", "-1"},     {"--latency-ms", "5,,20"},
        {"--latency-ms", "5,"},     {"--latency-ms", ","},
        {"--latency-ms", "nan"},    {"--latency-ms", "5;20"},
        {"--bandwidth-mb", "0"},    {"--bandwidth-mb", "-10"},
        {"--memory-mb", "0"},       {"--memory-mb", "64,inf"},
        {"--policy", "x"},          {"--policy", "deadline,"},
        {"--policy", "deadline,x"}, {"--speed", "0"},
        {"--speed", "50,-50"},      {"--radius", "0"},
        {"--radius", "1,,2"},       {"--path", ",straight"},
        {"--slots", "0"},           {"--slots", "1.5"},
        {"--horizon-s", "-1"},      {"--contact-share", "1.1"},
        {"--failure-share", "2"},   {"--hang-share", "-0.1"},
        {"--bodies", "-1"},         {"--fps", "0"},
        {"--seconds", "0"},         {"--announce-s", "-1"},
        {"--max-error-px", "0"},    {"--threads", "0"},
        {"--latency-spread", "-1"}, {"--altitude", "0"},
        {"--storage-seed", "-1"}};
    for (const auto& [flag, value] : bad) {
        const auto options = parse({flag + "=" + value});
        ASSERT_FALSE(options) << flag << " " << value;
        EXPECT_NE(options.error().find(flag), std::string::npos) << options.error();
        EXPECT_NE(options.error().find(value.substr(value.rfind(',') + 1)), std::string::npos)
            << options.error();
        EXPECT_EQ(options.error().find('\n'), std::string::npos) << options.error();
    }
}

TEST(PageOptions, WhatIsTooMuchIsAUsageError) {
    for (const auto& [flag, value] :
         std::vector<std::pair<std::string, std::string>>{{"--slots", "1025"},
                                                          {"--threads", "257"},
                                                          {"--bodies", "1000000"},
                                                          {"--path", "straight,zigzag"}}) {
        // refused by the parser, or by the checks of combinations
        const auto options = parse({flag, value});
        std::string message = options ? "" : options.error();
        if (options) {
            const CommandResult<void> checked = check(*options);
            ASSERT_FALSE(checked) << flag;
            EXPECT_EQ(checked.error().exit_code, exit_usage);
            message = checked.error().message;
        }
        EXPECT_NE(message.find(flag), std::string::npos) << message;
    }
    const auto options = parse({"--slots", "1024", "--threads", "256"});
    EXPECT_TRUE(check(*options));
}

TEST(PageOptions, ReachTheSettingsOfARun) {
    const auto options = parse({"--latency-ms",
                                "5",
                                "--bandwidth-mb",
                                "10",
                                "--memory-mb",
                                "64",
                                "--slots",
                                "3",
                                "--latency-spread",
                                "0.5",
                                "--failure-share",
                                "0.1",
                                "--hang-share",
                                "0.2",
                                "--storage-seed",
                                "9",
                                "--horizon-s",
                                "2",
                                "--contact-share",
                                "0.25",
                                "--fps",
                                "60",
                                "--bodies",
                                "3",
                                "--announce-s",
                                "2",
                                "--max-error-px",
                                "1.5",
                                "--budget",
                                "5000",
                                "--size",
                                "640x480"});
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
}  // namespace terrane::tools
