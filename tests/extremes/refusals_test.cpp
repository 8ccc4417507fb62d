// SPDX-License-Identifier: MIT
// What lies beyond a limit is refused with the name of the thing, and what moves beyond one stops there and is counted.
#include "extremes/rows/falls.h"
#include "extremes/rows/grounds.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/terrain/function_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane::extremes {
namespace refusals_test {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
const double kBeyond = std::nextafter(kFarthestPlace, kInfinite);

const Ground& hills() {
    static const Ground ground = load(**make_hills({})).value();
    return ground;
}

TEST(Refusals, NameTheFieldOfALatticeThatDoublesCannotTellApart) {
    const auto refusal = [](const Lattice& lattice) { return message_of(check(lattice)); };
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
    EXPECT_EQ(hills().ray({0.0, 0.0, 100.0}, far).status, GroundStatus::invalid);
    EXPECT_EQ(hills().ray(far, {0.0, 0.0, 0.0}).status, GroundStatus::invalid);
    EXPECT_EQ(hills().ray({0.0, 0.0, 100.0}, {0.0, 0.0, -kFarthestPlace}).status, GroundStatus::ok);
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
    EXPECT_EQ(cast(sphere, motion, hills(), {.tolerance = 1e-2}).status, QueryStatus::complete);
    World world = World::create({}).value();
    EXPECT_EQ(world.cast(hills(), sphere, motion).status, QueryStatus::invalid);
    motion.translation.z() = -1.0;
    EXPECT_EQ(cast(sphere, motion, hills()).status, QueryStatus::complete);
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
            EXPECT_EQ(answer.status, QueryStatus::complete);
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

/// The largest coordinate at which add() accepts a body.
double limit_of_places() {
    World world = World::create({}).value();
    double accepted = 1e6, refused = 1e15;
    while (std::nextafter(accepted, kInfinite) < refused) {
        const double middle = 0.5 * (accepted + refused);
        (world.add({}, at_place(middle, 0.0, 0.0)) ? accepted : refused) = middle;
    }
    return accepted;
}

TEST(Refusals, ABodyThatFallsToTheLimitOfPlacesParksThereAndTheWorldCanBeSaved) {
    const double limit = limit_of_places();
    World world = World::create({}).value();
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
