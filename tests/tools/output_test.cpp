// SPDX-License-Identifier: MIT
#include "program/output_file.h"
#include "program/progress.h"
#include "program/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace figures_test {

TEST(RoundedText, HasSoManyDigitsAndNoMore) {
    EXPECT_EQ(rounded_text(5334.2177, 4, Rounding::nearest), "5334");
    EXPECT_EQ(rounded_text(0.0123456, 4, Rounding::nearest), "0.01235");
    EXPECT_EQ(rounded_text(123456.0, 4, Rounding::nearest), "123500");
    EXPECT_EQ(rounded_text(-2.5, 4, Rounding::nearest), "-2.5");
    EXPECT_EQ(rounded_text(0.0, 4, Rounding::up), "0");
    EXPECT_EQ(rounded_text(-0.0, 4, Rounding::nearest), "0");
    EXPECT_EQ(rounded_text(9999.6, 4, Rounding::nearest), "10000");
    EXPECT_EQ(rounded_text(std::numeric_limits<double>::infinity(), 4, Rounding::up), "inf");
}

TEST(RoundedText, RoundsBoundsOutward) {
    EXPECT_EQ(rounded_text(1.00001, 4, Rounding::up), "1.001");
    EXPECT_EQ(rounded_text(9.9999, 4, Rounding::up), "10");
    EXPECT_EQ(rounded_text(1.00001, 4, Rounding::down), "1");
    EXPECT_EQ(rounded_text(-1.00001, 4, Rounding::down), "-1.001");
    EXPECT_EQ(rounded_text(-1.00009, 4, Rounding::up), "-1");
    EXPECT_EQ(rounded_text(0.25, 4, Rounding::up), "0.25");
    std::mt19937 random(7);
    std::uniform_real_distribution<double> exponent(-30.0, 30.0), sign(-1.0, 1.0);
    for (int i = 0; i < 10'000; ++i) {
        const double value = std::copysign(std::pow(10.0, exponent(random)), sign(random));
        const double up = std::strtod(rounded_text(value, 4, Rounding::up).c_str(), nullptr);
        const double down = std::strtod(rounded_text(value, 4, Rounding::down).c_str(), nullptr);
        ASSERT_LE(down, value);
        ASSERT_GE(up, value);
        ASSERT_LE(up - down, 1.001e-3 * std::abs(value)) << value;
    }
}

TEST(FigureText, RoundsMeasuredFiguresBoundsAndCoordinatesByTheirOwnRules) {
    using Json = nlohmann::ordered_json;
    const Json extent{-300.123456, 225.5};
    for (const auto& [key, value, text] : std::vector<std::tuple<const char*, Json, const char*>>{
             {"update_ms_median", 1.2345678, "1.235"},
             {"measured_error_px_max", 1.00001, "1"},
             {"error_px_max", 1.00001, "1.001"},
             {"extent_m", extent, "-300.123456, 225.5"},
             {"bandwidth_mb", 0.123456789, "0.123456789"},
             {"bytes_loaded", 123456789, "123456789"},
             {"empty", "", "-"},
             {"arrived", true, "true"},
             {"altitude", nullptr, "-"},
             {"slopes", Json{{"sap", 1.23456}}, "sap 1.235"}}) {
        EXPECT_EQ(figure_text(key, value), text) << key;
    }
    for (const auto& [key, title] : std::vector<std::pair<const char*, const char*>>{
             {"depth_m", "Depth, m"},
             {"speed_m_s", "Speed, m/s"},
             {"update_ms_p99", "Update (99 %), ms"},
             {"error_px_max", "Certified screen error (most), px"},
             {"touching_pairs", "Touching pairs"},
             {"m", "M"},
             {"", ""}}) {
        EXPECT_EQ(figure_title(key), title);
    }
}

TEST(FigureNote, ExplainsTheScreenErrorOfADriveAndOfNothingElse) {
    const nlohmann::ordered_json flight{{"frames", 3}, {"error_px_max", 5334.0}};
    EXPECT_EQ(figure_note("error_px_max", flight), "");
    const nlohmann::ordered_json drive{
        {"distance_m", 10.0}, {"frames", 3}, {"error_px_max", 5334.2177}};
    EXPECT_EQ(figure_note("distance_m", drive), "");
    const std::string text = format_summary(drive, false);
    EXPECT_NE(text.find("error_px_max  5335  (an angle at the eye"), std::string::npos) << text;
}

}  // namespace figures_test

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

TEST(ToLine, SurvivesTextThatIsNoUtf8) {
    nlohmann::ordered_json summary;
    summary["path"] = "\xff\xfe";
    EXPECT_NE(to_line(summary), "");
}

}  // namespace summary_test

namespace progress_test {

TEST(FormatProgress, EstimatesTheTimeLeftFromTheSpeedSinceTheShareIsKnown) {
    EXPECT_EQ(format_progress("opening a.tif", -1.0, 3.2, 0.0, 0.0), "opening a.tif: 4 s");
    // 10 s for 20 %, so 40 s for the rest; time before the first share does not count
    EXPECT_EQ(format_progress("flying", 0.2, 100.0, 0.0, 10.0), "flying: 20 %, 40 s left");
    EXPECT_EQ(format_progress("flying", 0.75, 500.0, 0.5, 200.0), "flying: 75 %, 3 min 20 s left");
    EXPECT_EQ(format_progress("flying", 0.5, 9e3, 0.0, 9000.0), "flying: 50 %, 2 h 30 min left");
    EXPECT_EQ(format_progress("flying", 1.0, 10.0, 0.0, 10.0), "flying: 100 %, 0 s left");
    // nothing from too small a share
    EXPECT_EQ(format_progress("flying", 0.0, 10.0, 0.0, 10.0), "flying: 0 %");
    EXPECT_EQ(format_progress("flying", 0.5, 0.1, 0.0, 0.1), "flying: 50 %");
    EXPECT_EQ(format_progress("flying", 0.999, 10.0, 0.999, 10.0), "flying: 99 %");
}

}  // namespace progress_test

namespace output_file_test {

std::string temporary(const std::string& name) { return testing::TempDir() + "terrane_" + name; }

std::string content_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(OutputFile, TakesItsPlaceOnlyWhenItIsCommitted) {
    const std::string path = temporary("output_file");
    std::ofstream(path) << "old";
    {
        Result<OutputFile> file = OutputFile::create(path);
        ASSERT_TRUE(file) << file.error().message;
        file->write("half");
        EXPECT_EQ(content_of(path), "old");
    }
    EXPECT_EQ(content_of(path), "old");
    EXPECT_FALSE(std::filesystem::exists(path + ".partial"));
    Result<OutputFile> file = OutputFile::create(path);
    ASSERT_TRUE(file) << file.error().message;
    file->write("wh");
    file->write("ole");
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(content_of(path), "whole");
    EXPECT_FALSE(std::filesystem::exists(path + ".partial"));
}

TEST(OutputFile, InARunsFolderIsListedAndNeverTakesAFilesPlace) {
    const std::string folder = temporary("output_folder");
    std::filesystem::remove_all(folder);
    {
        Result<std::shared_ptr<OutputFolder>> run = OutputFolder::open(folder, {"a", "b"}, false);
        ASSERT_TRUE(run) << run.error().message;
        ASSERT_TRUE((*run)->clear());
        Result<OutputFile> a = OutputFile::create(OutputPlace(*run, "a"));
        Result<OutputFile> b = OutputFile::create(OutputPlace(*run, "b"));
        ASSERT_TRUE(a && b);
        a->write("run");
        b->write("run");
        ASSERT_TRUE(a->commit());
        std::ofstream(folder + "/b") << "mine";  // created during the run
        EXPECT_FALSE(b->commit());
        EXPECT_FALSE(OutputFolder::open(folder, {}, false)) << "it is in use";
    }
    EXPECT_EQ(content_of(folder + "/b"), "mine");
    EXPECT_NE(content_of(folder + "/" + kFileListName).find(" a\n"), std::string::npos);
    EXPECT_TRUE(OutputFolder::open(folder, {"a"}, false)) << "a is what the run wrote";
    EXPECT_FALSE(OutputFolder::open(folder, {"b"}, false)) << "b is not";
}

}  // namespace output_file_test
}  // namespace terrane::tools
