// SPDX-License-Identifier: MIT
#include "query/answers.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
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

TEST(AnswerQuery, AnswersTheSameInAnyOrder) {
    test::Random random(22);
    std::vector<std::string> lines;
    for (int i = 0; i < 5; ++i) {
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

}  // namespace query_answers_test

namespace pair_answers_test {

using Json = nlohmann::ordered_json;

// None of these questions loads ground.
Json ask(const std::string& line) {
    static QueryGround ground = QueryGround::create(FractalHeights::create({.seed = 4}).value(),
                                                    {.memory_bytes = std::size_t{64} << 20})
                                    .value();
    return answer_query(parse_query(line), ground);
}

const std::string kSphere = R"({"sphere":{"radius":0.5}})";
const std::string kCapsule = R"({"capsule":{"radius":0.5,"half_height":0.25}})";
const std::string kBox = R"({"box":{"half_extents":[0.5,0.5,0.5]}})";
const std::string kHull =
    R"({"hull":{"points":[[-0.5,-0.5,-0.5],[0.5,-0.5,-0.5],[-0.5,0.5,-0.5],[0.5,0.5,-0.5],)"
    R"([-0.5,-0.5,0.5],[0.5,-0.5,0.5],[-0.5,0.5,0.5],[0.5,0.5,0.5]]}})";
const std::string kCompound =
    R"({"compound":[{"shape":)" + kBox + R"(},{"shape":)" + kSphere + R"(,"position":[-4,0,0]}]})";

std::string question(const std::string& op, const std::string& shape, double x,
                     const std::string& other, const std::string& more = "") {
    return R"({"id":3,"op":")" + op + R"(","shape":)" + shape + R"(,"position":[)" +
           Json(x).dump() + R"(,0,0],"other":{"shape":)" + other + R"(,"position":[0,0,0]})" +
           more + "}";
}

TEST(PairAnswers, CastBothWaysMeetHalfWay) {
    for (const std::string& shape : {kSphere, kCapsule, kHull, kCompound}) {
        SCOPED_TRACE(shape);
        // From 21 m apart, 20 m between the sides; each goes 20 m.
        const std::string line = R"({"op":"cast","shape":)" + shape +
                                 R"(,"position":[0,0,21],"to":[0,0,1],)" + R"("other":{"shape":)" +
                                 kBox + R"(,"position":[0,0,0],"to":[0,0,20]}})";
        const Json cast = ask(line);
        ASSERT_EQ(cast["status"], "ok") << cast;
        EXPECT_EQ(cast["hit"], true);
        const double sides = shape == kCapsule ? 1.25 : 1.0;
        EXPECT_NEAR(cast["fraction"].get<double>(), (21.0 - sides) / 40.0, 1e-5);
        EXPECT_NEAR(cast["normal"][2].get<double>(), 1.0, 1e-9);
        EXPECT_FALSE(cast["contacts"].empty());
    }
    const Json miss = ask(question("cast", kBox, 3.0, kCompound, R"(,"to":[3,0,9])"));
    EXPECT_EQ(miss["status"], "miss");
    EXPECT_EQ(miss["hit"], false);
    EXPECT_FALSE(miss.contains("contacts"));
    // in contact at the start, and separating
    const std::string away = R"(,"to":[9,0,0])";
    EXPECT_EQ(ask(question("cast", kBox, 0.9, kHull, away))["fraction"], 0.0);
    EXPECT_EQ(ask(question("cast", kBox, 0.9, kHull, away + R"(,"skip_separating":true)"))["hit"],
              false);
    // rotates by the smaller angle: a corner reaches the other shape
    const double half = std::sqrt(0.5);
    const std::string turn = R"(,"to":[1.1,0,0],"to_rotation":[)" + Json(half).dump() + ",0,0," +
                             Json(half).dump() + "]";
    const Json turned = ask(question("cast", kBox, 1.1, kHull, turn));
    EXPECT_EQ(turned["hit"], true) << turned;
}

TEST(PairAnswers, ARayMeetsTheOtherShape) {
    const std::string other = R"(,"other":{"shape":)" + kCompound + R"(,"position":[0,0,0]}})";
    const Json hit = ask(R"({"op":"ray","from":[-10,0,0],"to":[10,0,0])" + other);
    EXPECT_EQ(hit["status"], "ok") << hit;
    EXPECT_NEAR(hit["fraction"].get<double>(), 5.5 / 20.0, 1e-15);
    EXPECT_NEAR(hit["point"][0].get<double>(), -4.5, 1e-12);
    EXPECT_NEAR(hit["normal"][0].get<double>(), -1.0, 1e-12);
    EXPECT_EQ(hit["other_part"], 1);
    const Json miss = ask(R"({"op":"ray","from":[-10,0,5],"to":[10,0,5])" + other);
    EXPECT_EQ(miss["status"], "miss");
    EXPECT_EQ(miss["hit"], false);
}

TEST(PairAnswers, AreTheSameFarFromTheOrigin) {
    for (const char* op : {"test", "find", "distance", "pseudodistance"}) {
        Json near = Json::parse(question(op, kHull, 0.75, kCompound));
        Json far = near;
        for (Json* each : {&far["position"], &far["other"]["position"]}) {
            (*each)[0] = (*each)[0].get<double>() + 1e7;
            (*each)[1] = -1e7;
        }
        const Json here = ask(near.dump()), there = ask(far.dump());
        EXPECT_EQ(here.value("hit", false), there.value("hit", false));
        EXPECT_EQ(here.value("distance", 0.0), there.value("distance", 0.0));
    }
}

}  // namespace pair_answers_test
}  // namespace terrane::tools
