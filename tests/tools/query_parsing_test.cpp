// SPDX-License-Identifier: MIT
#include "query/query_parsing.h"

#include <gtest/gtest.h>

#include <string>

namespace terrane::tools {
namespace {

std::string complaint(const std::string& line) {
    const QueryLine parsed = parse_query(line);
    return parsed.question ? std::string() : parsed.question.error();
}

TEST(ParseQuery, ReadsEveryOperation) {
    const QueryLine height = parse_query(R"({"id":[1,"a"],"op":"height","x":1.5,"y":-2})");
    ASSERT_TRUE(height.question) << height.question.error();
    EXPECT_TRUE(height.has_id);
    EXPECT_EQ(height.id.dump(), R"([1,"a"])");
    EXPECT_EQ(std::get<HeightQuestion>(*height.question).x, 1.5);
    EXPECT_EQ(std::get<HeightQuestion>(*height.question).y, -2.0);

    const QueryLine ray = parse_query(R"({"op":"ray","from":[1,2,3],"to":[4,5,6]})");
    ASSERT_TRUE(ray.question) << ray.question.error();
    EXPECT_FALSE(ray.has_id);
    EXPECT_EQ(std::get<RayQuestion>(*ray.question).to_world, WorldPos(4.0, 5.0, 6.0));

    const QueryLine test = parse_query(
        R"({"op":"find","shape":{"box":{"half_extents":[1,2,3]}},"position":[0,0,9],"rotation":[0,0,0,1]})");
    ASSERT_TRUE(test.question) << test.question.error();
    const auto& found = std::get<ShapeQuestion>(*test.question);
    EXPECT_EQ(found.op, ShapeOp::find);
    EXPECT_EQ(std::get<Box>(found.shape).half_extents, Eigen::Vector3d(1.0, 2.0, 3.0));
    // half a turn about z
    EXPECT_EQ(found.world_from_shape.rotation.diagonal(), Eigen::Vector3d(-1.0, -1.0, 1.0));

    const QueryLine cast = parse_query(
        R"({"op":"cast","shape":{"capsule":{"radius":1,"half_height":2}},"position":[0,0,9],"to":[0,0,0],"skip_separating":true})");
    ASSERT_TRUE(cast.question) << cast.question.error();
    const auto& swept = std::get<CastQuestion>(*cast.question);
    EXPECT_TRUE(swept.skip_separating);
    EXPECT_EQ(swept.to_rotation, Eigen::Matrix3d::Identity());
}

TEST(ParseQuery, KeepsTheIdOfABadQuestion) {
    const QueryLine parsed = parse_query(R"({"id":"seven","op":"dance"})");
    ASSERT_FALSE(parsed.question);
    EXPECT_EQ(parsed.id, "seven");
    EXPECT_NE(parsed.question.error().find("dance"), std::string::npos);
}

TEST(ParseQuery, SaysWhatIsWrongInALine) {
    const std::string sphere = R"("shape":{"sphere":{"radius":1}},"position":[0,0,0])";
    for (const std::string line : {"", "{", "nonsense", "7", "[]", "null", "{}", "{\"op\":5}"}) {
        EXPECT_NE(complaint(line), "") << line;
    }
    EXPECT_NE(complaint(R"({"op":"height","x":1})").find("y is missing"), std::string::npos);
    EXPECT_NE(complaint(R"({"op":"height","x":"1","y":2})").find("x must be"), std::string::npos);
    EXPECT_NE(complaint(R"({"op":"height","x":1e10,"y":2})").find("1e9"), std::string::npos);
    EXPECT_NE(complaint(R"({"op":"height","x":1e999,"y":2})"), "");
    EXPECT_NE(complaint(R"({"op":"ray","from":[0,0],"to":[0,0,1]})").find("from"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"op":"test",)" + sphere + R"(,"rotation":[1,0,0]})").find("rotation"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"op":"test","shape":{"cone":{}},"position":[0,0,0]})").find("cone"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"op":"test","shape":{"sphere":{}},"position":[0,0,0]})").find("radius"),
              std::string::npos);
    EXPECT_NE(complaint(R"({"op":"test","shape":{"sphere":{"radius":-1}},"position":[0,0,0]})"),
              "");
    EXPECT_NE(complaint(R"({"op":"cast",)" + sphere + "}").find("to is missing"),
              std::string::npos);
    EXPECT_EQ(complaint(R"({"op":"test",)" + sphere + "}"), "");
}

TEST(ParseQuery, SaysWhatIsNotSupportedYet) {
    const auto names = [](const std::string& line, const char* what) {
        const std::string text = complaint(line);
        return text.find(what) != std::string::npos &&
               text.find("not supported yet") != std::string::npos;
    };
    EXPECT_TRUE(
        names(R"({"op":"test","shape":{"hull":{"points":[]}},"position":[0,0,0]})", "hull"));
    EXPECT_TRUE(names(R"({"op":"test","shape":{"compound":[]},"position":[0,0,0]})", "compound"));
    EXPECT_TRUE(names(
        R"({"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0,0],"other":{}})", "other"));
}

TEST(ParseQuery, TakesRotationsOfLengthOneToOneMillionth) {
    const auto with_w = [](const std::string& w) {
        return complaint(R"({"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0,0],)"
                         R"("rotation":[)" +
                         w + ",0,0,0]}");
    };
    EXPECT_EQ(with_w("1.0000009"), "");
    EXPECT_EQ(with_w("-0.9999991"), "");
    EXPECT_NE(with_w("1.0000011"), "");
    EXPECT_NE(with_w("0"), "");
    EXPECT_NE(with_w("1e200"), "");
}

TEST(ParseQuery, DoesNotFollowBracketsWithoutEnd) {
    EXPECT_NE(complaint(std::string(100'000, '[')), "");
    EXPECT_NE(complaint(R"({"id":)" + std::string(500'000, '[') + std::string(500'000, ']') + "}"),
              "");
    // brackets in text are no brackets
    EXPECT_EQ(complaint(R"({"id":")" + std::string(1000, '[') + R"(","op":"height","x":0,"y":0})"),
              "");
}

}  // namespace
}  // namespace terrane::tools
