// SPDX-License-Identifier: MIT
#include "cast_checks.h"
#include "ground_checks.h"
#include "hull_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

namespace terrane {
namespace ground_cast_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260202;

class ShapeCasts : public EveryShape {};
INSTANTIATE_TEST_SUITE_P(All, ShapeCasts, testing::ValuesIn(make_named_shapes()), shape_name);

TEST_P(ShapeCasts, StopBeforeTheGroundAndWithinTheTolerance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (int i = 0; i < 24; ++i) {
            const Motion motion = random_motion(random, ground, i);
            if (compute_lift(shape(), motion.start, ground).lift >= 0.0) continue;
            expect_stops_at_the_ground(shape(), motion, ground);
        }
    }
}

TEST_P(ShapeCasts, HitAThinWallAtAnySpeed) { expect_hits_a_thin_wall_at_any_speed(shape()); }

TEST_P(ShapeCasts, SlideOverFlatSeamsWithoutAHit) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    expect_slides_over_flat_seams(random, shape(), 40);
}

TEST_P(ShapeCasts, ReportTouchAndOverlapAtTheStart) {
    expect_reports_touch_and_overlap_at_the_start(shape());
}

TEST_P(ShapeCasts, OfNoLengthAnswer) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const Motion high = straight({64.3, 64.4, 5.0}, {0.0, 0.0, 0.0});
    const CastAnswer apart = cast(shape(), high, ground);
    EXPECT_EQ(apart.status, QueryStatus::complete);
    EXPECT_FALSE(apart.hit);
    EXPECT_EQ(apart.fraction, 1.0);
    const Motion low = straight({64.3, 64.4, -5.0}, {0.0, 0.0, 0.0});
    EXPECT_TRUE(cast(shape(), low, ground).started_in_contact);
}

TEST_P(ShapeCasts, ReportNotResidentWhereUnloadedGroundComesFirst) {
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    const auto along_x = [&](double from, double distance) {
        return cast(shape(), straight({from, 64.4, 4.0}, {distance, 0.0, 0.0}), ground);
    };
    const CastAnswer wall = along_x(64.3, 100.0);
    EXPECT_EQ(wall.status, QueryStatus::complete);
    EXPECT_TRUE(wall.hit);
    const CastAnswer unloaded = along_x(104.3, 100.0);
    EXPECT_EQ(unloaded.status, QueryStatus::not_resident);
    EXPECT_FALSE(unloaded.hit);
    EXPECT_GT(unloaded.fraction, 0.15);
    EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 130.0);
    EXPECT_EQ(along_x(140.3, 1.0).status, QueryStatus::not_resident);
}

TEST_P(ShapeCasts, GiveTheSameBitsTenThousandKilometresOut) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const FarGround grounds;
    for (int i = 0; i < 30; ++i) {
        Motion motion = random_motion(random, grounds.near, 30.0, i % 2 == 0 ? 0.0 : 2.0);
        motion.start = FarGround::rounded(motion.start);
        expect_the_same_cast_far_out(shape(), motion, grounds);
    }
}

TEST(Cast, StopsAFallOfAKilometreWithinTheTolerance) {
    const Ground ground = make_test_ground([](double, double) { return 3.0; }, 1.0, 1);
    for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
        CastSettings settings;
        settings.tolerance = tolerance;
        const CastAnswer answer = cast(
            Sphere{0.5}, straight({64.3, 64.4, 1003.5}, {0.0, 0.0, -2000.0}), ground, settings);
        ASSERT_TRUE(answer.hit);
        const double gap = 1000.0 - 2000.0 * answer.fraction;
        EXPECT_GE(gap, 0.0);
        EXPECT_LE(gap, tolerance);
        EXPECT_EQ(answer.contact.normal, Eigen::Vector3d::UnitZ());
    }
}

TEST(Cast, SkipsSeparatingContactsUntilTheyCloseAgain) {
    const std::vector<CompoundPart> parts{
        {make_hull(box_corners({0.5, 1.0, 0.5})), pose_at(-0.5, 0.0, 0.0)},
        {Box{{0.5, 1.0, 0.5}}, pose_at(0.5, 0.0, 0.0)}};
    for (const Shape& shape :
         {Shape(Sphere{0.5}), Shape(Capsule{0.25, 0.25}), Shape(Box{{1.0, 1.0, 0.5}}),
          Shape(make_hull(box_corners({1.0, 1.0, 0.5}))), Shape(Compound::create(parts).value())}) {
        expect_skips_separating_contacts(shape);
    }
}

TEST(Cast, DoesNotHitWhenTurningAwayFromAContact) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // Starts a quarter of the tolerance above the ground, and tips away from it.
    Motion motion;
    motion.start.translation = {64.3, 64.4, 0.5 + 0.25e-4};
    motion.translation = {0.0, 0.0, 0.5};
    motion.rotation_vector = {0.2, 0.0, 0.0};
    EXPECT_FALSE(cast(Box{{1.0, 1.0, 0.5}}, motion, ground).hit);
    // Spinning about the normal moves no point towards the ground.
    motion.translation = {0.0, 0.0, 0.0};
    motion.rotation_vector = {0.0, 0.0, 3.0};
    motion.start.translation.z() = 0.5 + 2e-4;
    EXPECT_FALSE(cast(Box{{1.0, 1.0, 0.5}}, motion, ground).hit);
}

TEST(Cast, OfGreatLengthCostsNoMoreThanTheGroundBelowIt) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const auto cast_far = [&](const WorldPos& from, const Eigen::Vector3d& by) {
        return cast(Sphere{0.5}, straight(from, by), ground);
    };
    // From far above and from far beside: each must end within milliseconds.
    constexpr double kDistance = 1e9;
    const CastAnswer down = cast_far({64.3, 64.4, 0.5 * kDistance}, {0.0, 0.0, -kDistance});
    EXPECT_TRUE(down.hit);
    EXPECT_NEAR(down.fraction, 0.5, 1e-8);
    EXPECT_FALSE(cast_far({64.3, 64.4, 9.0}, {kDistance, 0.0, 0.0}).hit);
    EXPECT_FALSE(cast_far({-1e6, 64.4, 9.0}, {-kDistance, kDistance, 0.0}).hit);
    // Beyond that doubles do not resolve the tolerance.
    for (const double distance : {1e15, 1e100}) {
        EXPECT_EQ(cast_far({64.3, 64.4, 0.5 * distance}, {0.0, 0.0, -distance}).status,
                  QueryStatus::invalid);
    }
}

TEST(Cast, RejectsNonFiniteArguments) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(cast(Sphere{}, straight({nan, 0, 0}, {0, 0, 1}), ground).status,
              QueryStatus::invalid);
    EXPECT_EQ(cast(Sphere{}, straight({0, 0, 0}, {0, nan, 1}), ground).status,
              QueryStatus::invalid);
    EXPECT_EQ(cast(Sphere{nan}, Motion{}, ground).status, QueryStatus::invalid);
    Motion spinning;
    spinning.rotation_vector = {nan, 0.0, 0.0};
    EXPECT_EQ(cast(Sphere{}, spinning, ground).status, QueryStatus::invalid);
    CastSettings settings;
    settings.tolerance = 0.0;
    EXPECT_EQ(cast(Sphere{}, Motion{}, ground, settings).status, QueryStatus::invalid);
}

TEST(Cast, TurnsAboutTheBodysOriginAndNotAboutItsCentre) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // A needle 3 m to the east goes down a quarter of a circle, to 2 m below its start.
    const std::vector<Eigen::Vector3d> points{{3.0, 0.0, 0.0}, {2.9, 0.0, 0.0}};
    const std::vector<CompoundPart> parts{{Sphere{0.0}, pose_at(3.0, 0.0, 0.0)}};
    for (const Shape& shape :
         {Shape(ConvexHull::create(points).value()), Shape(Compound::create(parts).value())}) {
        Motion motion = straight({64.3, 64.4, 1.5}, {0.0, 0.0, 0.0});
        motion.rotation_vector = {0.0, 1.5707963267948966, 0.0};
        const CastAnswer answer = cast(shape, motion, ground);
        ASSERT_TRUE(answer.hit);
        // 3 sin(angle) = 1.5
        EXPECT_NEAR(answer.fraction, 1.0 / 3.0, 1e-4);
        EXPECT_LE(answer.fraction, 1.0 / 3.0);
        motion.rotation_vector.y() = 0.523;
        EXPECT_FALSE(cast(shape, motion, ground).hit);
    }
}

TEST(Cast, OfAHullOfTenThousandPointsIsThatOfItsSphere) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const ConvexHull hull = make_hull(sphere(random, 10'000));
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    for (int i = 0; i < 10; ++i) {
        const Motion motion = random_motion(random, ground, 30.0, i % 2 == 0 ? 0.0 : 2.0);
        if (compute_lift(Sphere{1.0}, motion.start, ground).lift >= 0.0) continue;
        const CastAnswer answer = cast(hull, motion, ground);
        const CastAnswer of_sphere = cast(Sphere{1.0}, motion, ground);
        if (!answer.hit) continue;
        EXPECT_TRUE(of_sphere.hit);
        EXPECT_GE(answer.fraction, of_sphere.fraction - 1e-4 / 30.0);
        const double distance =
            signed_distance(hull, motion.at(answer.fraction), ground, 1.0).distance;
        EXPECT_GE(distance, -1e-9);
        EXPECT_LE(distance, 1e-4);
    }
}

}  // namespace ground_cast_test
}  // namespace terrane
