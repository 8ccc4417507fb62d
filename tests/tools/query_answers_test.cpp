// SPDX-License-Identifier: MIT
#include "query/answers.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

// Every shape here extends to x = 0.5 or -0.5.
TEST(PairAnswers, AreKnownForAllPairsBesideEachOther) {
    const std::vector<std::string> shapes{kSphere, kCapsule, kBox, kHull, kCompound};
    for (const std::string& shape : shapes) {
        for (const std::string& other : shapes) {
            SCOPED_TRACE(shape + " beside " + other);
            for (const double gap : {0.25, -0.125}) {
                const double x = 1.0 + gap;
                const std::string where =
                    shape == kCompound ? kBox : shape;  // its sphere is beyond
                const Json distance = ask(question("distance", where, x, other));
                ASSERT_EQ(distance["status"], "ok") << distance;
                EXPECT_EQ(distance["id"], 3);
                EXPECT_NEAR(distance["distance"].get<double>(), gap, 1e-12);
                EXPECT_NEAR(distance["normal"][0].get<double>(), 1.0, 1e-12);
                EXPECT_NEAR(distance["point"][0].get<double>(), 0.5 + gap, 1e-12);
                EXPECT_NEAR(distance["other_point"][0].get<double>(), 0.5, 1e-12);
                EXPECT_EQ(ask(question("test", where, x, other))["hit"], gap < 0.0);
                const Json pseudo = ask(question("pseudodistance", where, x, other));
                EXPECT_EQ(pseudo["distance"].get<double>() < 0.0, gap < 0.0);
                const Json find = ask(question("find", where, x, other));
                EXPECT_EQ(find["hit"], gap < 0.0);
                EXPECT_EQ(find["contacts"].empty(), gap > 0.0);
                if (gap > 0.0) continue;
                const Json& contact = find["contacts"][0];
                EXPECT_NEAR(contact["depth"].get<double>(), -gap, 1e-12);
                EXPECT_NEAR(contact["normal"][0].get<double>(), 1.0, 1e-12);
                EXPECT_TRUE(contact.contains("feature"));
                EXPECT_EQ(contact["other_part"], 0);
            }
        }
    }
}

TEST(PairAnswers, CastBothWaysMeetHalfWay) {
    const std::vector<std::string> shapes{kSphere, kCapsule, kBox, kHull, kCompound};
    for (const std::string& shape : shapes) {
        for (const std::string& other : shapes) {
            SCOPED_TRACE(shape + " to " + other);
            // From 21 m apart, 20 m between the sides; each goes 20 m.
            const std::string line =
                R"({"op":"cast","shape":)" + shape + R"(,"position":[0,0,21],"to":[0,0,1],)" +
                R"("other":{"shape":)" + other + R"(,"position":[0,0,0],"to":[0,0,20]}})";
            const Json cast = ask(line);
            ASSERT_EQ(cast["status"], "ok") << cast;
            EXPECT_EQ(cast["hit"], true);
            const double sides =
                (shape == kCapsule ? 0.75 : 0.5) + (other == kCapsule ? 0.75 : 0.5);
            EXPECT_NEAR(cast["fraction"].get<double>(), (21.0 - sides) / 40.0, 1e-5);
            EXPECT_NEAR(cast["normal"][2].get<double>(), 1.0, 1e-9);
            EXPECT_FALSE(cast["contacts"].empty());
        }
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
