// SPDX-License-Identifier: MIT
#include "program/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

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
    EXPECT_EQ(figure_text("update_ms_median", 1.2345678), "1.235");
    EXPECT_EQ(figure_text("measured_error_px_max", 1.00001), "1");
    EXPECT_EQ(figure_text("error_px_max", 1.00001), "1.001");
    EXPECT_EQ(figure_text("extent_m", nlohmann::ordered_json{-300.123456, 225.5}),
              "-300.123456, 225.5");
    EXPECT_EQ(figure_text("bandwidth_mb", 0.123456789), "0.123456789");
    EXPECT_EQ(figure_text("bytes_loaded", 123456789), "123456789");
    EXPECT_EQ(figure_text("empty", ""), "-");
    EXPECT_EQ(figure_text("arrived", true), "true");
    EXPECT_EQ(figure_text("altitude", nullptr), "-");
    EXPECT_EQ(figure_text("slopes", nlohmann::ordered_json{{"sap", 1.23456}}), "sap 1.235");
}

TEST(FigureTitle, IsWordsWithAUnit) {
    EXPECT_EQ(figure_title("depth_m"), "Depth, m");
    EXPECT_EQ(figure_title("speed_m_s"), "Speed, m/s");
    EXPECT_EQ(figure_title("wheels_on_ground"), "Wheels on ground");
    EXPECT_EQ(figure_title("update_ms_p99"), "Update (99 %), ms");
    EXPECT_EQ(figure_title("error_px_max"), "Certified screen error (most), px");
    EXPECT_EQ(figure_title("touching_pairs"), "Touching pairs");
    EXPECT_EQ(figure_title("m"), "M");
    EXPECT_EQ(figure_title(""), "");
}

TEST(FigureNote, ExplainsTheScreenErrorOfADriveAndOfNothingElse) {
    const nlohmann::ordered_json flight{{"frames", 3}, {"error_px_max", 5334.0}};
    EXPECT_EQ(figure_note("error_px_max", flight), "");
    nlohmann::ordered_json drive = flight;
    drive["distance_m"] = 12.0;
    EXPECT_NE(figure_note("error_px_max", drive), "");
    EXPECT_EQ(figure_note("distance_m", drive), "");
}

}  // namespace figures_test
}  // namespace terrane::tools
