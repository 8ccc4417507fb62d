// SPDX-License-Identifier: MIT
#include "output/summary.h"

#include <gtest/gtest.h>

namespace terrane::tools {
namespace {

TEST(FormatSummary, PrintsNumbersThatReadBackTheSame) {
    nlohmann::ordered_json summary;
    summary["z"] = 0.1 + 0.2;
    summary["a"] = {1.0, 1e300};
    const std::string line = format_summary(summary, true);
    EXPECT_EQ(line.back(), '\n');
    const nlohmann::ordered_json back = nlohmann::ordered_json::parse(line);
    EXPECT_EQ(back["z"].get<double>(), 0.1 + 0.2);
    EXPECT_EQ(back["a"][1].get<double>(), 1e300);
    EXPECT_LT(line.find("\"z\""), line.find("\"a\""));
}

TEST(FormatSummary, GivesPeopleOneLineForEachKey) {
    nlohmann::ordered_json summary;
    summary["name"] = "a \"quoted\" name";
    summary["longer_name"] = {1, 2};
    summary["empty"] = "";
    EXPECT_EQ(format_summary(summary, false),
              "name         a \"quoted\" name\n"
              "longer_name  1, 2\n"
              "empty        -\n");
}

TEST(ToLine, SurvivesTextThatIsNoUtf8) {
    nlohmann::ordered_json summary;
    summary["path"] = "\xff\xfe";
    EXPECT_NE(to_line(summary), "");
}

}  // namespace
}  // namespace terrane::tools
