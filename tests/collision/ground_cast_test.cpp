// SPDX-License-Identifier: MIT
#include "collision/ground_oracle.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

#include <cstring>

namespace terrane {
namespace {

using test::make_scenes;
using test::make_shapes;
using test::make_test_ground;
using test::Random;
using test::Scene;

constexpr std::uint64_t kSeed = 20260202;

Motion straight(const Eigen::Vector3d& from, const Eigen::Vector3d& way) {
    Motion motion;
    motion.start.translation = from;
    motion.translation = way;
    return motion;
}

Motion random_motion(Random& random, const Ground& ground, double way, double spin) {
    Motion motion;
    motion.start.rotation = random.rotation();
    const double x = random.between(20.0, 108.0);
    const double y = random.between(20.0, 108.0);
    motion.start.translation = {x, y, ground.height(x, y).height + random.between(2.0, 7.0)};
    motion.translation = way * random.direction();
    motion.rotation_vector = spin * random.direction();
    return motion;
}

// Walks the motion up to a fraction and looks for a place in the ground.
void expect_free(const Shape& shape, const Motion& motion, const Ground& ground, double fraction) {
    constexpr int kSteps = 300;
    for (int k = 0; k <= kSteps; ++k) {
        const double t = fraction * k / kSteps;
        const double lift = compute_lift(shape, motion.at(t), ground).lift;
        ASSERT_LE(lift, 1e-9) << "at " << t << " of " << fraction;
    }
}

TEST(Cast, StopsBeforeTheGroundAndWithinTheTolerance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const Shape& shape : make_shapes()) {
            for (int i = 0; i < 48; ++i) {
                const Motion motion = random_motion(
                    random, ground, i % 3 == 0 ? 5.0 : 60.0,
                    std::array<double, 4>{0.0, 0.3, 3.0, 25.0}[static_cast<std::size_t>(i % 4)]);
                if (compute_lift(shape, motion.start, ground).lift >= 0.0) continue;
                const CastAnswer answer = cast(shape, motion, ground);
                ASSERT_EQ(answer.status, ContactStatus::complete);
                EXPECT_FALSE(answer.started_in_contact);
                expect_free(shape, motion, ground, answer.fraction);
                if (!answer.hit) {
                    EXPECT_EQ(answer.fraction, 1.0);
                    continue;
                }
                const double distance =
                    signed_distance(shape, motion.at(answer.fraction), ground, 1.0).distance;
                EXPECT_GE(distance, -1e-9);
                EXPECT_LE(distance, 1e-4);
                EXPECT_GT(answer.contact.normal.z(), 0.0);
                EXPECT_NEAR(answer.contact.depth, 0.0, 1e-4 + 1e-9);
            }
        }
    }
}

TEST(Cast, MeetsAThinWallAtAnySpeed) {
    const Ground ground =
        make_test_ground([](double x, double) { return x == 64.0 ? 50.0 : 0.0; }, 1.0, 1);
    for (const Shape& shape : make_shapes()) {
        for (const double way : {100.0, 300.0, 1e6}) {
            for (const double spin : {0.0, 2.0, 40.0}) {
                Motion motion = straight({10.0, 60.3, 20.0}, {way, 0.0, 0.0});
                motion.rotation_vector = {0.3 * spin, spin, 0.1 * spin};
                const CastAnswer answer = cast(shape, motion, ground);
                ASSERT_TRUE(answer.hit);
                const double x = motion.at(answer.fraction).translation.x();
                EXPECT_GT(x, 60.0);
                EXPECT_LT(x, 64.0);
                EXPECT_LE(compute_lift(shape, motion.at(answer.fraction), ground).lift, 1e-9);
            }
        }
    }
}

TEST(Cast, FallsAKilometreOntoAPlaneToTheToleranceExactly) {
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

TEST(Cast, SlidesOverFlatSeamsWithoutAHit) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    for (const Shape& shape : make_shapes()) {
        for (int i = 0; i < 60; ++i) {
            Motion motion;
            motion.start.rotation =
                i == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : random.rotation();
            motion.start.translation = {120.0, 120.0 + random.between(0.0, 16.0), 0.0};
            const double lift = compute_lift(shape, motion.start, ground).lift;
            motion.start.translation.z() = lift + 1.01e-4;
            motion.translation = {16.0, random.between(-8.0, 8.0), 0.0};
            const CastAnswer answer = cast(shape, motion, ground);
            EXPECT_FALSE(answer.hit) << answer.fraction;
        }
    }
}

TEST(Cast, ReportsTouchAndOverlapAtTheStart) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const Shape& shape :
         {Shape(Sphere{0.5}), Shape(Capsule{0.25, 0.25}), Shape(Box{{1.0, 1.0, 0.5}})}) {
        for (const double depth : {0.0, 0.01, 2.0, 1000.0}) {
            const CastAnswer answer =
                cast(shape, straight({64.3, 64.4, 0.5 - depth}, {1.0, 0.0, 1.0}), ground);
            EXPECT_TRUE(answer.hit);
            EXPECT_TRUE(answer.started_in_contact);
            EXPECT_EQ(answer.fraction, 0.0);
            EXPECT_NEAR(answer.contact.depth, depth, 1e-9);
        }
    }
}

TEST(Cast, PassesOverSeparatingContactsUntilTheyCloseAgain) {
    const Ground ground =
        make_test_ground([](double x, double) { return x > 70.0 ? x - 70.0 : 0.0; }, 1.0, 1);
    CastSettings settings;
    settings.skip_separating = true;
    for (const Shape& shape :
         {Shape(Sphere{0.5}), Shape(Capsule{0.25, 0.25}), Shape(Box{{1.0, 1.0, 0.5}})}) {
        for (const double depth : {0.0, 0.01}) {
            const Eigen::Vector3d from(60.3, 64.4, 0.5 - depth);
            EXPECT_FALSE(cast(shape, straight(from, {0.0, 0.0, 1.0}), ground, settings).hit);
            EXPECT_FALSE(cast(shape, straight(from, {3.0, 2.0, 0.0}), ground, settings).hit);
            const CastAnswer closing =
                cast(shape, straight(from, {0.0, 0.0, -1.0}), ground, settings);
            EXPECT_TRUE(closing.hit);
            EXPECT_TRUE(closing.started_in_contact);
            EXPECT_EQ(closing.fraction, 0.0);
            const CastAnswer slope =
                cast(shape, straight(from, {30.0, 0.0, 0.0}), ground, settings);
            EXPECT_TRUE(slope.hit);
            EXPECT_GT(slope.fraction, 0.25);
            EXPECT_LT(slope.fraction, 0.35);
        }
    }
}

TEST(Cast, TurningAwayFromAContactIsNoHit) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // Rests on one edge, a quarter of the tolerance up, and tips further onto nothing.
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

TEST(Cast, OfAbsurdLengthCostsNoMoreThanItsGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const double way : {1e9, 1e15, 1e100}) {
        // From far above and from far beside: over within a second, or this test takes forever.
        const CastAnswer down =
            cast(Sphere{0.5}, straight({64.3, 64.4, 0.5 * way}, {0.0, 0.0, -way}), ground);
        EXPECT_TRUE(down.hit);
        EXPECT_NEAR(down.fraction, 0.5, 1e-8);
        EXPECT_FALSE(cast(Sphere{0.5}, straight({64.3, 64.4, 9.0}, {way, 0.0, 0.0}), ground).hit);
        EXPECT_FALSE(cast(Sphere{0.5}, straight({-1e6, 64.4, 9.0}, {-way, way, 0.0}), ground).hit);
    }
}

TEST(Cast, OfNoLengthAnswers) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const Shape& shape : make_shapes()) {
        const CastAnswer apart = cast(shape, straight({64.3, 64.4, 5.0}, {0.0, 0.0, 0.0}), ground);
        EXPECT_EQ(apart.status, ContactStatus::complete);
        EXPECT_FALSE(apart.hit);
        EXPECT_EQ(apart.fraction, 1.0);
        EXPECT_TRUE(
            cast(shape, straight({64.3, 64.4, 0.1}, {0.0, 0.0, 0.0}), ground).started_in_contact);
    }
}

TEST(Cast, SaysNotResidentWhereUnloadedGroundComesFirst) {
    test::TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    for (const Shape& shape : make_shapes()) {
        const CastAnswer wall = cast(shape, straight({64.3, 64.4, 3.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(wall.status, ContactStatus::complete);
        EXPECT_TRUE(wall.hit);
        const CastAnswer unloaded =
            cast(shape, straight({104.3, 64.4, 3.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(unloaded.status, ContactStatus::not_resident);
        EXPECT_FALSE(unloaded.hit);
        EXPECT_GT(unloaded.fraction, 0.2);
        EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 128.0);
        EXPECT_EQ(cast(shape, straight({140.3, 64.4, 3.0}, {1.0, 0.0, 0.0}), ground).status,
                  ContactStatus::not_resident);
    }
}

TEST(Cast, RefusesWhatIsNotFinite) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(cast(Sphere{}, straight({nan, 0, 0}, {0, 0, 1}), ground).status,
              ContactStatus::invalid);
    EXPECT_EQ(cast(Sphere{}, straight({0, 0, 0}, {0, nan, 1}), ground).status,
              ContactStatus::invalid);
    EXPECT_EQ(cast(Sphere{nan}, Motion{}, ground).status, ContactStatus::invalid);
    Motion spinning;
    spinning.rotation_vector = {nan, 0.0, 0.0};
    EXPECT_EQ(cast(Sphere{}, spinning, ground).status, ContactStatus::invalid);
    CastSettings settings;
    settings.tolerance = 0.0;
    EXPECT_EQ(cast(Sphere{}, Motion{}, ground, settings).status, ContactStatus::invalid);
}

TEST(Cast, GivesTheSameBitsTenThousandKilometresOut) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    constexpr std::int32_t kFar = 78125;  // roots of 128 m: 1e7 m
    const double shift = 128.0 * kFar;
    test::TableGroundSettings far_settings;
    far_settings.first_root = kFar;
    const Ground near =
        make_test_ground([](double x, double y) { return test::hash_height(x, y); }, 1.0, 1);
    const Ground far = make_test_ground(
        [&](double x, double y) { return test::hash_height(x - shift, y - shift); }, far_settings);
    for (const Shape& shape : make_shapes()) {
        for (int i = 0; i < 30; ++i) {
            Motion motion = random_motion(random, near, 30.0, i % 2 == 0 ? 0.0 : 2.0);
            for (int k = 0; k < 3; ++k) {
                motion.start.translation[k] =
                    std::floor(motion.start.translation[k] * 0x1p20) * 0x1p-20;
            }
            Motion far_motion = motion;
            far_motion.start.translation += Eigen::Vector3d(shift, shift, 0.0);
            const CastAnswer here = cast(shape, motion, near);
            const CastAnswer there = cast(shape, far_motion, far);
            EXPECT_EQ(here.hit, there.hit);
            EXPECT_EQ(std::memcmp(&here.fraction, &there.fraction, sizeof(double)), 0)
                << here.fraction << " and " << there.fraction;
        }
    }
}

}  // namespace
}  // namespace terrane
