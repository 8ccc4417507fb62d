// SPDX-License-Identifier: MIT
#include "query/answers.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace terrane::tools {
namespace query_answers_test {

using Json = nlohmann::ordered_json;

QueryGround make_ground(std::size_t memory_bytes = std::size_t{256} << 20) {
    return QueryGround::create(FractalHeights::create({.seed = 4}).value(),
                               {.memory_bytes = memory_bytes})
        .value();
}

Json ask(QueryGround& ground, const std::string& line) {
    return answer_query(parse_query(line), ground);
}

std::string height_at(double x, double y) {
    return Json{{"op", "height"}, {"x", x}, {"y", y}}.dump();
}

TEST(AnswerQuery, GivesTheHeightWithinItsOwnError) {
    QueryGround ground = make_ground();
    const std::shared_ptr<const HeightSource> truth = FractalHeights::create({.seed = 4}).value();
    test::Random random(21);
    for (int i = 0; i < 300; ++i) {
        const double x = random.between(-2000.0, 2000.0);
        const double y = random.between(-2000.0, 2000.0);
        const Json answer = ask(ground, height_at(x, y));
        ASSERT_EQ(answer["status"], "ok") << answer;
        EXPECT_LE(std::abs(answer["height"].get<double>() - truth->height(x, y)),
                  answer["error_m"].get<double>())
            << "seed 21, " << x << ", " << y;
    }
}

TEST(AnswerQuery, AnswersTheSameInAnyOrder) {
    test::Random random(22);
    std::vector<std::string> lines;
    for (int i = 0; i < 12; ++i) {
        const double x = random.between(-60'000.0, 60'000.0);
        const double y = random.between(-60'000.0, 60'000.0);
        lines.push_back(height_at(x, y));
        lines.push_back(
            Json{{"op", "ray"}, {"from", {x, y, 2000.0}}, {"to", {x + 900.0, y, -2000.0}}}.dump());
        lines.push_back(Json{{"op", "test"},
                             {"shape", {{"sphere", {{"radius", 2.0}}}}},
                             {"position", {x, y, random.between(-100.0, 100.0)}}}
                            .dump());
    }
    // the second one has a ceiling of about 60 chunks, so that chunks are evicted repeatedly
    QueryGround wide = make_ground();
    QueryGround narrow = make_ground(Chunk::max_bytes() * 64);
    std::vector<Json> forward;
    for (const std::string& line : lines) forward.push_back(ask(wide, line));
    for (std::size_t i = lines.size(); i-- > 0;) {
        EXPECT_EQ(ask(narrow, lines[i]), forward[i]) << "seed 22: " << lines[i];
    }
}

TEST(AnswerQuery, IsNotResidentWhereTheCeilingForbidsIt) {
    QueryGround ground = make_ground(Chunk::max_bytes() * 5);
    EXPECT_EQ(ask(ground, height_at(100.0, 100.0))["status"], "not_resident");
    EXPECT_EQ(ask(ground, height_at(1e6, 0.0))["status"], "outside");
}

TEST(AnswerQuery, LoadsALongRayOnlyAsFarAsItGoes) {
    QueryGround ground = make_ground(Chunk::max_bytes() * 64);
    const Json steep = ask(ground, R"({"op":"ray","from":[-60000,7,1200],"to":[60000,7,-100000]})");
    EXPECT_EQ(steep["status"], "ok") << steep;
    EXPECT_LT(steep["fraction"].get<double>(), 0.05);
}

TEST(AnswerQuery, SaysOutsideForAShapeBesideTheWorld) {
    QueryGround ground = make_ground();
    const std::string beside = R"("shape":{"sphere":{"radius":1}},"position":[900000,0,0]})";
    for (const char* op : {"test", "find", "pseudodistance"}) {
        EXPECT_EQ(ask(ground, R"({"op":")" + std::string(op) + "\"," + beside)["status"],
                  "outside");
    }
    const Json cast = ask(ground, R"({"op":"cast","to":[900000,0,-9000],)" + beside);
    EXPECT_EQ(cast["status"], "miss") << cast;
    EXPECT_EQ(cast["hit"], false);
}

/// A sphere of radius 1 with its centre `above` metres above the ground at (50, 60).
std::string sphere_over(QueryGround& ground, const std::string& op, double above,
                        const std::string& more = "") {
    const double z = ask(ground, height_at(50.0, 60.0))["height"].get<double>();
    return R"({"id":5,"op":")" + op + R"(","shape":{"sphere":{"radius":1}},"position":[50,60,)" +
           Json(z + above).dump() + "]" + more + "}";
}

TEST(AnswerQuery, AgreesWithItselfAboutAShapeAboveAndInTheGround) {
    QueryGround ground = make_ground();
    for (const double above : {-3.0, -0.5, 0.5, 5.0, 400.0}) {
        const Json test = ask(ground, sphere_over(ground, "test", above));
        const Json find = ask(ground, sphere_over(ground, "find", above));
        const Json distance = ask(ground, sphere_over(ground, "distance", above));
        const Json pseudo = ask(ground, sphere_over(ground, "pseudodistance", above));
        for (const Json& answer : {test, find, distance, pseudo}) {
            ASSERT_EQ(answer["status"], "ok") << answer;
            EXPECT_EQ(answer["id"], 5);
            EXPECT_GT(answer["error_m"].get<double>(), 0.0);
        }
        const bool is_in = above < 1.0;
        EXPECT_EQ(test["hit"], is_in) << above;
        EXPECT_EQ(find["hit"], is_in) << above;
        EXPECT_EQ(find["contacts"].empty(), !is_in) << above;
        EXPECT_EQ(distance["distance"].get<double>() <= 0.0, is_in) << above;
        EXPECT_EQ(pseudo["distance"].get<double>() <= 0.0, is_in) << above;
        // the minimum translation is never longer than the vertical one
        EXPECT_LE(distance["distance_lower_bound"].get<double>(),
                  std::abs(distance["distance"].get<double>()));
        EXPECT_LE(std::abs(distance["distance"].get<double>()),
                  std::abs(pseudo["distance"].get<double>()) + 1e-9);
    }
}

// A box of 2 x 4 x 1 m and three equivalent shapes.
TEST(AnswerQuery, TakesAHullAndCompoundsForTheBoxThatTheyAre) {
    QueryGround ground = make_ground();
    const std::string box = R"({"box":{"half_extents":[1,2,0.5]}})";
    const std::string half = R"({"box":{"half_extents":[0.5,2,0.5]}})";
    const std::vector<std::string> same{
        R"({"hull":{"points":[[-1,-2,-0.5],[1,-2,-0.5],[-1,2,-0.5],[1,2,-0.5],)"
        R"([-1,-2,0.5],[1,-2,0.5],[-1,2,0.5],[1,2,0.5],[0.1,0.2,0.3]]}})",
        R"({"compound":[{"shape":)" + box + "}]}",
        R"({"compound":[{"shape":)" + half + R"(,"position":[-0.5,0,0]},{"shape":)" + half +
            R"(,"position":[0.5,0,0],"rotation":[0,0,0,1]}]})"};
    const double z = ask(ground, height_at(50.0, 60.0))["height"].get<double>();
    const auto about = [&](const std::string& op, const std::string& shape, double above) {
        return ask(ground, R"({"op":")" + op + R"(","shape":)" + shape + R"(,"position":[50,60,)" +
                               Json(z + above).dump() +
                               R"(],"rotation":[0.8,0.6,0,0],"to":[70,60,)" +
                               Json(z - 2000.0).dump() + "]}");
    };
    for (const double above : {-0.2, 4.0, 400.0}) {
        for (const std::string& shape : same) {
            SCOPED_TRACE(shape + " " + std::to_string(above));
            for (const char* op : {"test", "find", "distance", "pseudodistance", "cast"}) {
                const Json expected = about(op, box, above);
                const Json answer = about(op, shape, above);
                ASSERT_EQ(answer["status"], expected["status"]) << op << answer;
                if (expected.contains("hit")) {
                    EXPECT_EQ(answer["hit"], expected["hit"]) << op;
                }
                if (expected.contains("distance") && above > 0.0) {
                    EXPECT_NEAR(answer["distance"].get<double>(),
                                expected["distance"].get<double>(), 1e-9)
                        << op;
                }
                if (expected.contains("contacts")) {
                    EXPECT_EQ(answer["contacts"].empty(), expected["contacts"].empty()) << op;
                }
                if (expected.contains("fraction")) {
                    EXPECT_NEAR(answer["fraction"].get<double>() * 2000.0,
                                expected["fraction"].get<double>() * 2000.0, 2e-3);
                }
            }
        }
    }
}

TEST(AnswerQuery, CastsAShapeDownToItsFirstTouch) {
    QueryGround ground = make_ground();
    const Json cast = ask(ground, sphere_over(ground, "cast", 500.0, R"(,"to":[50,60,-2000])"));
    ASSERT_EQ(cast["status"], "ok") << cast;
    EXPECT_EQ(cast["hit"], true);
    EXPECT_GT(cast["normal"][2].get<double>(), 0.0);
    ASSERT_FALSE(cast["contacts"].empty());
    const Json start = Json::parse(sphere_over(ground, "cast", 500.0, ""));
    Json touching{{"op", "distance"}, {"shape", start["shape"]}, {"position", start["position"]}};
    const double z = start["position"][2].get<double>();
    touching["position"][2] = z + cast["fraction"].get<double>() * (-2000.0 - z);
    const double gap = ask(ground, touching.dump())["distance"].get<double>();
    EXPECT_GE(gap, -1e-9);
    EXPECT_LE(gap, 1e-4 + 1e-9);
}

}  // namespace query_answers_test
}  // namespace terrane::tools
