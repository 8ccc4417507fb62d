// SPDX-License-Identifier: MIT
//
// The table of extremes: every row keeps its promise over its range, and says where the range ends.
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/terrain/function_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <ostream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace terrane::extremes {

/// For messages of GoogleTest.
void PrintTo(const ExtremeRow& row, std::ostream* out) { *out << row.name; }

namespace extremes_test {

class ExtremeRows : public testing::TestWithParam<ExtremeRow> {};

/// Whether the values that take minutes are measured too.
bool is_long() { return std::getenv("TERRANE_EXTREMES_LONG") != nullptr; }

TEST_P(ExtremeRows, KeepTheirPromiseAtEveryValue) {
    const ExtremeRow& row = GetParam();
    const std::vector<double>& values = is_long() ? row.long_values : row.values;
    for (const double value : values) {
        EXPECT_EQ(row.refusal(value), "") << value;
        const double figure = row.measure(value);
        EXPECT_TRUE(keeps_promise(row, figure))
            << row.figure << " is " << figure << ", more than " << row.limit << ", at " << value
            << ": " << row.swept;
    }
}

TEST_P(ExtremeRows, EndWithAMessageThatNamesTheThing) {
    const ExtremeRow& row = GetParam();
    if (row.ends.empty()) {
        EXPECT_NE(row.note, "") << "neither an end nor a reason why there is none";
    }
    for (const RangeEnd& end : row.ends) {
        EXPECT_EQ(row.refusal(end.accepted), "") << end.accepted;
        const FoundEnd found = find_end(row, end);
        SCOPED_TRACE(testing::Message() << "first refused: " << found.first_refused);
        EXPECT_NE(found.message.find(end.message), std::string::npos) << found.message;
        EXPECT_NE(found.far_message.find(end.message), std::string::npos) << found.far_message;
        // A result names the value; a status has no room for it.
        const bool is_status = found.message.find("::") != std::string::npos;
        EXPECT_TRUE(is_status || found.message.find("got ") != std::string::npos ||
                    found.message.find("gave ") != std::string::npos)
            << found.message;
        EXPECT_EQ(found.message.find('\n'), std::string::npos);
        for (const double value : row.values) {
            const bool is_beyond = end.refused > end.accepted ? value >= found.first_refused
                                                              : value <= found.first_refused;
            EXPECT_FALSE(is_beyond) << value;
        }
    }
}

TEST_P(ExtremeRows, RefuseWhatIsNoNumber) {
    const ExtremeRow& row = GetParam();
    if (row.ends.empty() || row.ends.front().is_whole || row.ends.back().is_whole) {
        GTEST_SKIP() << "whole numbers";
    }
    EXPECT_NE(row.refusal(kNan), "");
    EXPECT_NE(row.refusal(kInfinite), "");
    EXPECT_NE(row.refusal(-kInfinite), "");
}

INSTANTIATE_TEST_SUITE_P(All, ExtremeRows, testing::ValuesIn(all_rows()),
                         [](const testing::TestParamInfo<ExtremeRow>& row) {
                             return row.param.name;
                         });

TEST(AllRows, SayWhatTheySweepInWordsOfTheirOwn) {
    std::set<std::string> swept;
    for (const ExtremeRow& row : all_rows()) {
        EXPECT_TRUE(swept.insert(row.swept).second) << row.name << ": " << row.swept;
    }
}

ExtremeRow row_to(double last) {
    ExtremeRow row;
    row.refusal = [last](double value) -> std::string {
        return value <= last && value >= -last ? "" : "got too much";
    };
    return row;
}

TEST(FindEnd, FindsNeighbouringDoubles) {
    for (const double last : {0.0, 1e-300, 0.1, 1.0, 1e9, 1e300}) {
        const ExtremeRow row = row_to(last);
        const FoundEnd above = find_end(row, {0.0, kInfinite});
        EXPECT_EQ(above.last_accepted, last);
        EXPECT_EQ(above.first_refused, std::nextafter(last, kInfinite));
        EXPECT_EQ(above.message, "got too much");
        const FoundEnd below = find_end(row, {0.0, -kInfinite});
        EXPECT_EQ(below.last_accepted, -last);
        EXPECT_EQ(below.first_refused, std::nextafter(-last, -kInfinite));
    }
}

TEST(FindEnd, FindsNeighbouringWholeNumbers) {
    const ExtremeRow row = row_to(1000.5);
    const FoundEnd above = find_end(row, {2.0, 1e9, true});
    EXPECT_EQ(above.last_accepted, 1000.0);
    EXPECT_EQ(above.first_refused, 1001.0);
    EXPECT_EQ(find_end(row, {2.0, -1e9, true}).last_accepted, -1000.0);
}

TEST(KeepsPromise, HoldsUpToTheLimitAndForNoNumberThatIsNotFinite) {
    const ExtremeRow row{.limit = 0.5};
    EXPECT_TRUE(keeps_promise(row, 0.5));
    EXPECT_FALSE(keeps_promise(row, 0.6));
    EXPECT_FALSE(keeps_promise(row, kNan));
    EXPECT_FALSE(keeps_promise(row, kInfinite));
    EXPECT_FALSE(keeps_promise(row, -kInfinite));
}

TEST(ExtremesTable, ShowsValuesFiguresAndEnds) {
    ExtremeRow row = row_to(2.0);
    row.name = "Width";
    row.topic = "Widths";
    row.swept = "width, m";
    row.promise = "It is kept.";
    row.figure = "share of it";
    row.values = {1.0, 2.0};
    row.long_values = {1.5};
    row.measure = [](double value) { return 0.25 * value; };
    row.ends = {{1.0, 3.0, true}};
    std::vector<double> begun;
    const MeasuredRow measured = measure(row, true, [&](double value) { begun.push_back(value); });
    EXPECT_EQ(begun, measured.values);
    EXPECT_EQ(measured.figures, (std::vector<double>{0.25, 0.5, 0.375}));
    const std::string page = to_markdown({&measured, 1});
    EXPECT_NE(page.find("| width, m | 1 | 2 | 0.5 | 1 | - | 2 |"), std::string::npos) << page;
    EXPECT_NE(page.find("| 1 | 2 | 1.5 |\n|---|---|---|\n| 0.25 | 0.5 | 0.375 |"),
              std::string::npos);
    EXPECT_NE(page.find("- 2 is accepted, 3 refused. Far beyond: \"got too much\"."),
              std::string::npos);
    MeasuredRow failed = measured;
    failed.figures[1] = kNan;
    EXPECT_NE(to_markdown({&failed, 1}).find("| width, m | 1 | 2 | nan | 1 |"), std::string::npos);
}

/// A text with every run of white space as one blank.
std::string unwrapped(const std::string& text) {
    std::istringstream words(text);
    std::string out;
    for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
    return out;
}

// The figures of the document are measured in a quarter of an hour; its words are compared here.
TEST(ExtremesTable, HasTheWordsOfTheDocument) {
    std::ifstream file(TERRANE_SOURCE_DIR "/docs/measurements.md");
    std::string document(std::istreambuf_iterator<char>(file), {});
    document = unwrapped(document);
    for (const ExtremeRow& row : all_rows()) {
        const MeasuredRow words{&row, {0.0}, {0.0}, std::vector<FoundEnd>(row.ends.size())};
        std::string page = to_markdown({&words, 1});
        const std::string head = page.substr(0, page.find("\n| " + row.swept));
        EXPECT_NE(document.find(unwrapped(head)), std::string::npos) << head;
        page.erase(0, page.find("\n#### "));
        const std::string section = page.substr(0, page.find("\n|"));
        EXPECT_NE(document.find(unwrapped(section)), std::string::npos) << section;
        EXPECT_NE(document.find("### " + row.topic + " "), std::string::npos) << row.topic;
        EXPECT_NE(document.find(row.note), std::string::npos) << row.note;
    }
}

}  // namespace extremes_test

// What lies beyond a limit is refused with the name of the thing, and what moves beyond one stops there and is counted.

namespace refusals_test {

const double kBeyond = std::nextafter(kFarthestPlace, kInfinite);

const Ground& hills() {
    static const Ground ground = load(**make_hills({})).value();
    return ground;
}

TEST(Refusals, NameTheFieldOfALatticeThatDoublesCannotTellApart) {
    const auto refusal = [](const Lattice& lattice) { return message_of(lattice.validate()); };
    EXPECT_EQ(refusal({.spacing = 0.0}), "spacing must be 2^-30 to 2^20 m, got 0");
    EXPECT_EQ(refusal({.spacing = 1e300}), "spacing must be 2^-30 to 2^20 m, got 1e+300");
    EXPECT_EQ(refusal({.origin_x = 1e13}),
              "origin_x must be within 2^40 spacings of 0, spacing 1 m, got 1e+13");
    EXPECT_EQ(refusal({.origin_y = -1e10, .spacing = 1e-3}),
              "origin_y must be within 2^40 spacings of 0, spacing 0.001 m, got -1e+10");
    EXPECT_EQ(refusal({.spacing = 1e6, .root_count_x = 1024, .root_count_y = 1024}), "");
    EXPECT_NE(refusal({.spacing = 1e6, .finest_level = 10, .root_count_x = 1024})
                  .find("root squares must lie within 2^40 m of 0, got "),
              std::string::npos);
}

TEST(Refusals, NameTheCornerOfAFunctionsExtent) {
    const auto source =
        heights_from_function([](double, double) { return 0.0; },
                              {.extent = {1e15, 0.0, 1e15 + 1000.0, 1000.0}, .slope = 0.0});
    ASSERT_FALSE(source.has_value());
    EXPECT_NE(source.error().message.find("extent's south-western corner"), std::string::npos)
        << source.error().message;
}

TEST(Refusals, OfRaysAndPosesBeyondTheFarthestPlaceAreStatuses) {
    const WorldPos far(kBeyond, 0.0, 0.0);
    EXPECT_EQ(hills().ray({0.0, 0.0, 100.0}, far).status, QueryStatus::invalid);
    EXPECT_EQ(hills().ray(far, {0.0, 0.0, 0.0}).status, QueryStatus::invalid);
    EXPECT_EQ(hills().ray({0.0, 0.0, 100.0}, {0.0, 0.0, -kFarthestPlace}).status, QueryStatus::ok);
    const Shape sphere = Sphere{};
    const Pose pose = at_place(kBeyond, 0.0, 0.0).pose;
    EXPECT_EQ(signed_distance(sphere, pose, hills(), 1.0).status, QueryStatus::invalid);
    EXPECT_EQ(compute_lift(sphere, pose, hills()).status, QueryStatus::invalid);
    EXPECT_EQ(signed_distance(sphere, pose, sphere, {}).status, QueryStatus::invalid);
}

TEST(Refusals, OfMotionsThatAreTooLongOrTurnTooFarAreStatuses) {
    const Shape sphere = Sphere{};
    Motion motion;
    motion.start = at_place(0.0, 0.0, 100.0).pose;
    motion.translation.z() = -kBeyond;
    EXPECT_EQ(cast(sphere, motion, hills()).status, QueryStatus::invalid);
    EXPECT_EQ(cast(sphere, motion, sphere, {}).status, QueryStatus::invalid);
    // Doubles at the end are 1.2e-4 m apart: too far for a tolerance of 1e-4 m.
    motion.translation.z() = -1e12;
    EXPECT_EQ(cast(sphere, motion, hills()).status, QueryStatus::invalid);
    EXPECT_EQ(cast(sphere, motion, hills(), {.tolerance = 1e-2}).status, QueryStatus::ok);
    World world = World::create({}).value();
    EXPECT_EQ(world.cast(hills(), sphere, motion).status, QueryStatus::invalid);
    motion.translation.z() = -1.0;
    EXPECT_EQ(cast(sphere, motion, hills()).status, QueryStatus::ok);
    motion.rotation_vector.x() = 1e8;
    EXPECT_EQ(cast(sphere, motion, hills()).status, QueryStatus::invalid);
    EXPECT_EQ(cast(sphere, motion, sphere, {}).status, QueryStatus::invalid);
}

TEST(Refusals, OfShapesThatAreTooFarApartAreStatusesAndNoDistanceIsInfinite) {
    for (const Shape& a : shapes_of_size(0.5)) {
        for (const Shape& b : shapes_of_size(0.5)) {
            const Pose here = at_place(-kFarthestPlace, -kFarthestPlace, -kFarthestPlace).pose;
            const Pose end = at_place(kFarthestPlace, kFarthestPlace, kFarthestPlace).pose;
            const PairDistanceAnswer answer = signed_distance(a, here, b, end);
            EXPECT_EQ(answer.status, QueryStatus::ok);
            EXPECT_NEAR(answer.distance, 2.0 * std::sqrt(3.0) * kFarthestPlace, 2.0);
            for (const double far : {kBeyond, 1e100, 1e231, 1e308, kInfinite}) {
                Motion motion;
                motion.start = at_place(0.0, far, 0.0).pose;
                const Pose& there = motion.start;
                EXPECT_EQ(signed_distance(a, {}, b, there).status, QueryStatus::invalid) << far;
                EXPECT_EQ(signed_distance(a, there, b, {}).status, QueryStatus::invalid) << far;
                EXPECT_EQ(pseudodistance(a, {}, b, there).status, QueryStatus::invalid) << far;
                EXPECT_EQ(test_contact(a, {}, b, there).status, QueryStatus::invalid) << far;
                EXPECT_EQ(find_contacts(a, {}, b, there, 1.0, {}).status, QueryStatus::invalid);
                EXPECT_EQ(cast(a, {}, b, motion).status, QueryStatus::invalid) << far;
                EXPECT_EQ(cast_ray(a, {}, {0.0, far, 0.0}, {0.0, 0.0, 0.0}).status,
                          QueryStatus::invalid);
                EXPECT_EQ(signed_distance(a, there, hills(), kInfinite).status,
                          QueryStatus::invalid);
            }
        }
    }
}

TEST(Refusals, OfBodiesNameTheirSizeMassPlaceAndSpeedAndTheWorldStaysAsItIs) {
    World world = World::create({}).value();
    const auto refusal = [&](const BodySettings& settings, const BodyState& state) {
        return message_of(world.add(settings, state));
    };
    BodyState fast;
    fast.velocity.x() = 1e7;
    EXPECT_NE(refusal({.shape = Sphere{1e6}}, {}).find("sphere radius"), std::string::npos);
    EXPECT_NE(refusal({.mass = 1e13}, {}).find("mass"), std::string::npos);
    EXPECT_NE(refusal({}, at_place(0.0, 3e9, 0.0)).find("pose.translation.y"), std::string::npos);
    EXPECT_NE(refusal({}, fast).find("velocity.x"), std::string::npos);
    EXPECT_TRUE(world.states().empty());
}

TEST(Refusals, ABodyThatFallsToTheLimitOfPlacesParksThereAndTheWorldCanBeSaved) {
    World world = World::create({}).value();
    ExtremeRow places;
    places.refusal = [](double x) {
        return message_of(World::create({}).value().add({}, at_place(x, 0.0, 0.0)));
    };
    const double limit = find_end(places, {1e6, 1e15}).last_accepted;
    BodyState falling = at_place(0.3 * limit, 0.0, -0.999999 * limit);
    falling.velocity.z() = -1e5;
    ASSERT_TRUE(world.add({}, falling));
    BodyState moving = at_place(0.0, 0.999999 * limit, 0.0);
    moving.velocity.y() = 1e5;
    ASSERT_TRUE(world.add({.type = BodyType::kinematic_body}, moving));
    StepReport report;
    for (int i = 0; i < 20; ++i) report = world.step(hills(), 0.01);
    EXPECT_EQ(report.parked, 1u);
    EXPECT_EQ(report.left_world, 0u);
    const WorldPos parked = world.states()[0].pose.translation;
    EXPECT_LE(-parked.z(), limit);
    EXPECT_GE(-parked.z(), limit - 2e3);
    EXPECT_EQ(world.states()[0].condition, BodyCondition::parked);
    EXPECT_EQ(world.states()[1].velocity.norm(), 0.0);
    EXPECT_LE(world.states()[1].pose.translation.y(), limit);
    for (int i = 0; i < 20; ++i) world.step(hills(), kMostStep);
    EXPECT_EQ(world.states()[0].pose.translation, parked);
    EXPECT_TRUE(World::load(world.save()).has_value());
}

TEST(Refusals, AStepOfTheLongestLengthIsTakenAndALongerOneIsNot) {
    World world = World::create({}).value();
    ASSERT_TRUE(world.add({}, at_place(0.0, 0.0, 1e5)));
    EXPECT_EQ(world.step(hills(), std::nextafter(kMostStep, kInfinite)).refused_steps, 1u);
    EXPECT_EQ(world.states()[0].velocity.z(), 0.0);
    EXPECT_EQ(world.step(hills(), kMostStep).refused_steps, 0u);
    EXPECT_NEAR(world.states()[0].velocity.z(), -9.81 * kMostStep, 1e-9);
}

}  // namespace refusals_test
}  // namespace terrane::extremes
