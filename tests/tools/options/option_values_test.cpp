// SPDX-License-Identifier: MIT
#include "program/options.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace terrane::tools {
namespace option_values_test {

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
    EXPECT_EQ(parse_number("1e3"), 1000.0);
    EXPECT_EQ(parse_number("-0.5"), -0.5);
    EXPECT_EQ(parse_number("+2"), 2.0);
    for (const char* text : {"", " 1", "1 ", "1m", "x", "--1", "+-1", "+", "0x10", "1,5"}) {
        EXPECT_EQ(parse_number(text), std::nullopt) << text;
    }
}

TEST(ParseNumber, RefusesWhatIsNotFinite) {
    for (const char* text : {"nan", "NaN", "inf", "-inf", "infinity", "1e999"}) {
        EXPECT_EQ(parse_number(text), std::nullopt) << text;
    }
}

TEST(ParseNumber, TakesAQuotient) {
    EXPECT_EQ(parse_number("1/60"), 1.0 / 60.0);
    EXPECT_EQ(parse_number("1/0"), std::nullopt);
    EXPECT_EQ(parse_number("1/"), std::nullopt);
    EXPECT_EQ(parse_number("/2"), std::nullopt);
    EXPECT_EQ(parse_number("1/2/3"), std::nullopt);
}

TEST(ParsePoint, TakesThreeNumbersAndNothingElse) {
    ASSERT_TRUE(parse_point("-1,2.5,3e2"));
    EXPECT_EQ(*parse_point("-1,2.5,3e2"), WorldPos(-1.0, 2.5, 300.0));
    for (const char* text : {"", "1", "1,2", "1,2,", "1,2,3,4", "1,,3", "1, 2, 3", "nan,0,0"}) {
        EXPECT_EQ(parse_point(text), std::nullopt) << text;
    }
}

TEST(ParseSize, RefusesEmptyAndAbsurdPictures) {
    ASSERT_TRUE(parse_size("1920x1080"));
    EXPECT_EQ(parse_size("1920x1080")->width_px, 1920);
    EXPECT_EQ(parse_size("1920x1080")->height_px, 1080);
    for (const char* text :
         {"", "x", "0x5", "5x0", "-1x5", "5", "5x5x5", "16385x1", "1e3x5", "5 x 5"}) {
        EXPECT_FALSE(parse_size(text)) << text;
    }
}

TEST(ParseList, RefusesEmptyItems) {
    using List = std::vector<std::string>;
    EXPECT_EQ(parse_list("5"), (List{"5"}));
    EXPECT_EQ(parse_list("5,20,a b"), (List{"5", "20", "a b"}));
    for (const char* text : {"", ",", "5,", ",5", "5,,20"}) {
        EXPECT_EQ(parse_list(text), std::nullopt) << text;
    }
}

TEST(Given, NaNIsNotGiven) {
    EXPECT_EQ(given(std::numeric_limits<double>::quiet_NaN()), std::nullopt);
    EXPECT_EQ(given(0.0), 0.0);
}

/// The error message for `--value TEXT`; "" where it is valid.
std::string refusal(const std::string& text) {
    CLI::App app;
    std::size_t value = 0;
    add_count(app, "--value", value, 2, "");
    std::vector<std::string> arguments{text, "--value"};  // CLI11 takes them in reverse
    try {
        app.parse(arguments);
    } catch (const CLI::ParseError& error) {
        return error.what();
    }
    return "";
}

TEST(AddCount, NamesTheFlagAndTheValue) {
    EXPECT_EQ(refusal("2"), "");
    for (const char* text : {"1", "-1", "2.5", "99999999999999999999", "two", "1e3"}) {
        const std::string message = refusal(text);
        EXPECT_NE(message.find("--value"), std::string::npos) << text << ": " << message;
        EXPECT_NE(message.find(text), std::string::npos) << text << ": " << message;
    }
}

}  // namespace option_values_test
}  // namespace terrane::tools
