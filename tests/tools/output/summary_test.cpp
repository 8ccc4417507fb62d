// SPDX-License-Identifier: MIT
#include "program/summary.h"

#include <gtest/gtest.h>

namespace terrane::tools {
namespace summary_test {

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
    summary["depth_m"] = 0.0024832973051702734;
    EXPECT_EQ(format_summary(summary, false),
              "name         a \"quoted\" name\n"
              "longer_name  1, 2\n"
              "empty        -\n"
              "depth_m      0.002483\n");
}

TEST(FormatSummary, ExplainsAFigureThatWouldMislead) {
    const nlohmann::ordered_json drive{
        {"distance_m", 10.0}, {"frames", 3}, {"error_px_max", 5334.2177}};
    const std::string text = format_summary(drive, false);
    EXPECT_NE(text.find("error_px_max  5335  (an angle at the eye"), std::string::npos) << text;
}

TEST(ToLine, SurvivesTextThatIsNoUtf8) {
    nlohmann::ordered_json summary;
    summary["path"] = "\xff\xfe";
    EXPECT_NE(to_line(summary), "");
}

}  // namespace summary_test
}  // namespace terrane::tools
