// SPDX-License-Identifier: MIT
#include "cast_checks.h"
#include "ground_checks.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

namespace terrane {
namespace ground_cast_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260202;

// Half a metre above the ground they touch it.
std::vector<Shape> make_half_metre_shapes() {
    return {Sphere{0.5}, Capsule{0.25, 0.25}, Box{{1.0, 1.0, 0.5}}};
}

TEST(Cast, StopsBeforeTheGroundAndWithinTheTolerance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        for (const Shape& shape : make_shapes()) {
            for (int i = 0; i < 48; ++i) {
                const Motion motion = random_motion(random, ground, i);
                if (compute_lift(shape, motion.start, ground).lift >= 0.0) continue;
                expect_stops_at_the_ground(shape, motion, ground);
            }
        }
    }
}

TEST(Cast, MeetsAThinWallAtAnySpeed) {
    for (const Shape& shape : make_shapes()) {
        expect_meets_a_thin_wall_at_any_speed(shape, 60.0, 64.0);
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
    for (const Shape& shape : make_shapes()) expect_slides_over_flat_seams(random, shape, 60);
}

TEST(Cast, ReportsTouchAndOverlapAtTheStart) {
    for (const Shape& shape : make_half_metre_shapes()) {
        expect_reports_touch_and_overlap_at_the_start(shape, 0.5);
    }
}

TEST(Cast, PassesOverSeparatingContactsUntilTheyCloseAgain) {
    for (const Shape& shape : make_half_metre_shapes()) {
        expect_passes_over_separating_contacts(shape);
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
        EXPECT_EQ(apart.status, QueryStatus::complete);
        EXPECT_FALSE(apart.hit);
        EXPECT_EQ(apart.fraction, 1.0);
        EXPECT_TRUE(
            cast(shape, straight({64.3, 64.4, 0.1}, {0.0, 0.0, 0.0}), ground).started_in_contact);
    }
}

TEST(Cast, SaysNotResidentWhereUnloadedGroundComesFirst) {
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    for (const Shape& shape : make_shapes()) {
        const CastAnswer wall = cast(shape, straight({64.3, 64.4, 3.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(wall.status, QueryStatus::complete);
        EXPECT_TRUE(wall.hit);
        const CastAnswer unloaded =
            cast(shape, straight({104.3, 64.4, 3.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(unloaded.status, QueryStatus::not_resident);
        EXPECT_FALSE(unloaded.hit);
        EXPECT_GT(unloaded.fraction, 0.2);
        EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 128.0);
        EXPECT_EQ(cast(shape, straight({140.3, 64.4, 3.0}, {1.0, 0.0, 0.0}), ground).status,
                  QueryStatus::not_resident);
    }
}

TEST(Cast, RefusesWhatIsNotFinite) {
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

TEST(Cast, GivesTheSameBitsTenThousandKilometresOut) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const FarGround grounds;
    for (const Shape& shape : make_shapes()) {
        for (int i = 0; i < 30; ++i) {
            Motion motion = random_motion(random, grounds.near, 30.0, i % 2 == 0 ? 0.0 : 2.0);
            motion.start = FarGround::rounded(motion.start);
            expect_the_same_cast_far_out(shape, motion, grounds);
        }
    }
}

}  // namespace ground_cast_test
}  // namespace terrane
