// SPDX-License-Identifier: MIT
#include "program/geometry.h"
#include "query/questions.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace terrane::tools {
namespace quaternion_test {

TEST(Quaternion, TurnsXToYByAQuarterAboutZ) {
    const Eigen::Matrix3d rotation = matrix_from_quaternion({1.0, 0.0, 0.0, 1.0});
    EXPECT_LT((rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST(Quaternion, ComesBackFromItsMatrix) {
    test::Random random(5);
    for (int i = 0; i < 10'000; ++i) {
        Quaternion q{};
        double square = 0.0;
        for (double& component : q) {
            // many zeros, so that each component is sometimes the largest
            component = random.below(3) == 0 ? 0.0 : random.between(-1.0, 1.0);
            square += component * component;
        }
        if (square < 1e-6) continue;
        for (double& component : q) component /= std::sqrt(square);
        const Quaternion back = quaternion_from_matrix(matrix_from_quaternion(q));
        double along = 0.0;
        for (std::size_t k = 0; k < 4; ++k) along += q[k] * back[k];
        EXPECT_NEAR(std::abs(along), 1.0, 1e-14) << "seed 5, round " << i;
        EXPECT_GE(back[0], 0.0);
    }
}

}  // namespace quaternion_test

namespace line_reader_test {

using Status = LineReader::Status;

/// All results of a reader for bytes from a pipe.
std::vector<std::pair<Status, std::string>> read_all(const std::string& bytes) {
    int ends[2] = {};
    EXPECT_EQ(pipe(ends), 0);
    std::thread writer([&] {
        for (std::size_t at = 0; at < bytes.size();) {
            const ssize_t count = write(ends[1], bytes.data() + at, bytes.size() - at);
            if (count <= 0) break;
            at += static_cast<std::size_t>(count);
        }
        close(ends[1]);
    });
    std::vector<std::pair<Status, std::string>> lines;
    LineReader reader(ends[0], [] {});
    std::string_view line;
    for (Status status = reader.next(line); status != Status::end; status = reader.next(line)) {
        EXPECT_NE(status, Status::failed);
        lines.emplace_back(status, status == Status::line ? std::string(line) : std::string());
    }
    writer.join();
    close(ends[0]);
    return lines;
}

TEST(LineReader, GivesEveryLineOnceInOrder) {
    EXPECT_TRUE(read_all("").empty());
    std::string bytes = "a\n\nbc\r\n";
    for (int i = 3; i < 40'000; ++i) bytes += "line " + std::to_string(i) + "\n";
    const std::vector<std::pair<Status, std::string>> lines = read_all(bytes + "last");
    ASSERT_EQ(lines.size(), 40'001u);
    EXPECT_EQ(lines[0].second, "a");
    EXPECT_EQ(lines[1].second, "");
    EXPECT_EQ(lines[2].second, "bc");
    EXPECT_EQ(lines[39'999].second, "line 39999");
    EXPECT_EQ(lines[40'000].second, "last");
}

TEST(LineReader, PassesOverALineThatIsTooLongAndGoesOn) {
    const std::string longest(LineReader::kMaxLine_bytes, 'x');
    const std::vector<std::pair<Status, std::string>> lines =
        read_all(longest + "\n" + longest + "y\n" + longest + longest + longest + "\nnext\n" +
                 longest + "y");
    ASSERT_EQ(lines.size(), 5u);
    EXPECT_EQ(lines[0].first, Status::line);
    EXPECT_EQ(lines[1].first, Status::too_long);
    EXPECT_EQ(lines[2].first, Status::too_long);
    EXPECT_EQ(lines[3].second, "next");
    EXPECT_EQ(lines[4].first, Status::too_long);
}

TEST(LineReader, SaysThatAnInputCannotBeRead) {
    LineReader reader(-1, [] {});
    std::string_view line;
    EXPECT_EQ(reader.next(line), Status::failed);
}

}  // namespace line_reader_test

namespace query_parsing_test {

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

TEST(ParseQuery, NamesTheColumnOfAnErrorOfTheJson) {
    EXPECT_EQ(complaint(R"({"op":"ray",})").find("the line is no JSON: column 13: "), 0u);
    EXPECT_EQ(complaint("[1,2]"), "the line must be a JSON object, got [1,2]");
}

TEST(ParseQuery, KeepsTheIdOfABadQuestion) {
    const QueryLine parsed = parse_query(R"({"id":"seven","op":"dance"})");
    ASSERT_FALSE(parsed.question);
    EXPECT_EQ(parsed.id, "seven");
    EXPECT_NE(parsed.question.error().find("dance"), std::string::npos);
}

/// The complaint about each line has its word, "" stands for any; `with` puts each text into a line.
using Faults = std::vector<std::pair<std::string, std::string>>;

template <class With>
void expect_complaints(const Faults& faults, const With& with) {
    for (const auto& [text, word] : faults) {
        const std::string said = complaint(with(text));
        EXPECT_FALSE(said.empty()) << text;
        EXPECT_NE(said.find(word), std::string::npos) << text << ": " << said;
    }
}

const std::string kBall = R"("shape":{"sphere":{"radius":1}},"position":[0,0,5])";

TEST(ParseQuery, SaysWhatIsWrongInALine) {
    const Faults faults{
        {"", ""},
        {"{", ""},
        {"nonsense", ""},
        {"7", ""},
        {"[]", ""},
        {"null", ""},
        {"{}", ""},
        {R"({"op":5})", ""},
        {R"({"op":"height","x":1})", "y is missing"},
        {R"({"op":"height","x":"1","y":2})", "x must be"},
        {R"({"op":"height","x":1e10,"y":2})", "2e9"},
        {R"({"op":"height","x":1e999,"y":2})", ""},
        {R"({"op":"ray","from":[0,0],"to":[0,0,1]})", "from"},
        {R"({"op":"test",)" + kBall + R"(,"rotation":[1,0,0]})", "rotation"},
        {R"({"op":"test",)" + kBall + R"(,"rotation":[1.0000011,0,0,0]})", "rotation"},
        {R"({"op":"test",)" + kBall + R"(,"rotation":[0,0,0,0]})", "rotation"},
        {R"({"op":"test",)" + kBall + R"(,"rotation":[1e200,0,0,0]})", "rotation"},
        {R"({"op":"test","shape":{"cone":{}},"position":[0,0,0]})", "cone"},
        {R"({"op":"test","shape":{"sphere":{}},"position":[0,0,0]})", "radius"},
        {R"({"op":"test","shape":{"sphere":{"radius":-1}},"position":[0,0,0]})", ""},
        {R"({"op":"cast",)" + kBall + "}", "to is missing"},
        {R"({"op":"cast",)" + kBall + R"(,"other":{)" + kBall + "}}", "to is missing"},
        {R"({"op":"height","x":0,"y":0,"other":{)" + kBall + "}}", "height"},
        // brackets without end are not followed
        {std::string(100'000, '['), ""},
        {R"({"id":)" + std::string(500'000, '[') + std::string(500'000, ']') + "}", ""}};
    expect_complaints(faults, [](const std::string& line) { return line; });
    for (const std::string& good :
         {R"({"op":"test",)" + kBall + "}",
          // rotations are of length 1 to a millionth
          R"({"op":"test",)" + kBall + R"(,"rotation":[1.0000009,0,0,0]})",
          R"({"op":"test",)" + kBall + R"(,"rotation":[-0.9999991,0,0,0]})",
          // either shape may move
          R"({"op":"cast",)" + kBall + R"(,"other":{)" + kBall + R"(,"to":[1,2,3]}})",
          R"({"op":"ray","from":[0,0,9],"to":[0,0,0],"other":{)" + kBall + "}}",
          // brackets inside strings do not count
          R"({"id":")" + std::string(1000, '[') + R"(","op":"height","x":0,"y":0})"}) {
        EXPECT_EQ(complaint(good), "");
    }
}

const Shape& shape_of(const QueryLine& parsed) {
    return std::get<ShapeQuestion>(parsed.question.value()).shape;
}

TEST(ParseQuery, ReadsHulls) {
    const QueryLine parsed = parse_query(
        R"({"op":"test","shape":{"hull":{"points":[[0,0,0],[1,0,0],[0,1,0],[0,0,1],[0.1,0.1,0.1]]}},"position":[1,2,3]})");
    ASSERT_TRUE(parsed.question) << parsed.question.error();
    EXPECT_EQ(std::get<ConvexHull>(shape_of(parsed)).vertices().size(), 4u);
    // the largest hull fits into a line
    std::string points;
    for (std::size_t i = 0; i < ConvexHull::kMaxPoints; ++i) points += "[0,1.5,2],";
    const auto with = [](const std::string& hull) {
        return R"({"op":"test","shape":{"hull":)" + hull + R"(},"position":[0,0,0]})";
    };
    EXPECT_EQ(complaint(with(R"({"points":[)" + points.substr(0, points.size() - 1) + "]}")), "");
    expect_complaints({{R"({"points":[)" + points + "[0,0,0]]}", "100001"},
                       {R"({"points":[]})", "got 0"},
                       {R"({"points":[[1,2,3],[1,null,2]]})", "points[1] must be 3 numbers"},
                       {R"({"points":[[1,2,3],[[1,2,3]]]})", "points[1]"},
                       {R"({"points":[[1,2,3,4]]})", "points[0]"},
                       {R"({"points":[[1,2,2e5]]})", "1e5"},
                       {R"({"points":[[1,2,1e999]]})", ""},
                       {R"({"points":[[1,2,NaN]]})", ""},
                       {"[[0,0,0]]", "hull"},
                       {R"({"point":[[0,0,0]]})", "points is missing"},
                       {R"({"points":7})", "got 7"}},
                      with);
}

TEST(ParseQuery, ReadsCompounds) {
    const QueryLine parsed = parse_query(
        R"({"op":"find","shape":{"compound":[{"shape":{"sphere":{"radius":1}},"position":[0,0,2]},)"
        R"({"shape":{"hull":{"points":[[0,0,0]]}},"rotation":[0,0,0,1]}]},"position":[0,0,0]})");
    ASSERT_TRUE(parsed.question) << parsed.question.error();
    const std::span<const CompoundPart> parts = std::get<Compound>(shape_of(parsed)).parts();
    ASSERT_EQ(parts.size(), 2u);
    EXPECT_EQ(std::get<Sphere>(parts[0].shape).radius, 1.0);
    EXPECT_EQ(parts[0].body_from_part.translation, Eigen::Vector3d(0.0, 0.0, 2.0));
    EXPECT_EQ(parts[1].body_from_part.translation, Eigen::Vector3d::Zero());
    EXPECT_EQ(parts[1].body_from_part.rotation(0, 0), -1.0);

    const std::string ball = R"({"shape":{"sphere":{"radius":1}}})";
    expect_complaints(
        {{"[]", "got 0"},
         {"{}", "array"},
         {"[" + ball + R"(,{"shape":{"compound":[)" + ball + "]}}]", "compound[1]: shape"},
         {"[" + ball + ",5]", "compound[1]: must be an object, got 5"},
         {R"([{"shpe":{"sphere":{"radius":1}}}])", "compound[0]: shape is missing"},
         {R"([{"shape":{"sphere":{"radius":-1}}}])", "compound[0]: sphere radius"},
         {R"([{"shape":{"cone":{}}}])", "cone"},
         {R"([{"shape":{"sphere":{"radius":1}},"rotation":[1,0.1,0,0]}])", "length 1"},
         {R"([{"shape":{"sphere":{"radius":1}},"position":[2e5,0,0]}])", "1e5"}},
        [](const std::string& list) {
            return R"({"op":"test","shape":{"compound":)" + list + R"(},"position":[0,0,0]})";
        });
}

TEST(ParseQuery, ReadsTheOtherShape) {
    const QueryLine cast = parse_query(R"({"op":"cast",)" + kBall + R"(,"to":[0,0,1],"other":{)" +
                                       kBall + R"(,"to":[1,2,3],"to_rotation":[0,0,0,1]}})");
    ASSERT_TRUE(cast.question) << cast.question.error();
    const auto& swept = std::get<CastQuestion>(*cast.question);
    ASSERT_TRUE(swept.other);
    EXPECT_EQ(swept.other->to_world, WorldPos(1.0, 2.0, 3.0));
    EXPECT_EQ(swept.other->to_rotation(0, 0), -1.0);
    expect_complaints(
        {{"{}", "other: shape is missing"},
         {"7", "other must be an object, got 7"},
         {"null", "other must be an object, got null"},
         {R"({"shape":{"sphere":{"radius":1}}})", "other: position is missing"},
         {R"({"shape":{"sphere":{"raduis":1}},"position":[0,0,0]})", "other: radius is missing"},
         {"{" + kBall + R"(,"rotation":[2,0,0,0]})", "other: rotation"}},
        [](const std::string& other) {
            return R"({"op":"test",)" + kBall + R"(,"other":)" + other + "}";
        });
}

}  // namespace query_parsing_test
}  // namespace terrane::tools
