// SPDX-License-Identifier: MIT
#include "collision/ground/hull_cases.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

namespace terrane {
namespace {

using namespace test;

constexpr std::uint64_t kSeed = 20261103;

Motion straight(const Eigen::Vector3d& from, const Eigen::Vector3d& way) {
    Motion motion;
    motion.start.translation = from;
    motion.translation = way;
    return motion;
}

Motion random_motion(Random& random, const Ground& ground, double way, double spin) {
    Motion motion;
    motion.start = random_pose(random, ground, 2.0, 7.0);
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

// Hulls, and a compound of bodies that are all off its origin.
std::vector<Shape> make_cast_shapes(Random& random) {
    std::vector<Shape> shapes;
    for (const NamedHull& named : make_hulls(random)) shapes.emplace_back(make_hull(named.points));
    const std::vector<CompoundPart> parts{
        {make_hull(sphere(random, 20)), pose_at(2.0, 0.0, 0.3)},
        {Box{{0.5, 1.0, 0.2}}, pose_at(-1.5, 1.0, 0.0)},
        {Capsule{0.3, 0.6}, pose_at(0.0, -2.0, 0.5)},
        {Sphere{0.4}, pose_at(0.5, 0.5, -1.0)},
    };
    shapes.emplace_back(Compound::create(parts).value());
    return shapes;
}

TEST(HullCast, StopsBeforeTheGroundAndWithinTheTolerance) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Scene& scene : make_scenes()) {
        SCOPED_TRACE(scene.name);
        const Ground ground = make_test_ground(scene.height, 1.0, 1);
        const std::vector<Shape> shapes = make_cast_shapes(random);
        for (std::size_t s = 0; s < shapes.size(); ++s) {
            SCOPED_TRACE(s);
            const Shape& shape = shapes[s];
            for (int i = 0; i < 24; ++i) {
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

TEST(HullCast, MeetsAThinWallAtAnySpeed) {
    Random random(kSeed);
    const Ground ground =
        make_test_ground([](double x, double) { return x == 64.0 ? 50.0 : 0.0; }, 1.0, 1);
    for (const Shape& shape : make_cast_shapes(random)) {
        for (const double way : {100.0, 300.0, 1e6}) {
            for (const double spin : {0.0, 2.0, 40.0}) {
                Motion motion = straight({10.0, 60.3, 20.0}, {way, 0.0, 0.0});
                motion.rotation_vector = {0.3 * spin, spin, 0.1 * spin};
                const CastAnswer answer = cast(shape, motion, ground);
                ASSERT_TRUE(answer.hit);
                const double x = motion.at(answer.fraction).translation.x();
                EXPECT_GT(x, 59.0);
                EXPECT_LT(x, 64.5);
                EXPECT_LE(compute_lift(shape, motion.at(answer.fraction), ground).lift, 1e-9);
            }
        }
    }
}

TEST(HullCast, TurnsAboutTheBodysOriginAndNotAboutItsMiddle) {
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

TEST(HullCast, SlidesOverFlatSeamsWithoutAHit) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 2);
    for (const Shape& shape : make_cast_shapes(random)) {
        for (int i = 0; i < 20; ++i) {
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

TEST(HullCast, ReportsTouchAndOverlapAtTheStart) {
    Random random(kSeed);
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const Shape& shape : make_cast_shapes(random)) {
        for (const double depth : {0.0, 0.01, 2.0, 1000.0}) {
            Pose pose = pose_at(64.3, 64.4, 0.0);
            pose.translation.z() = compute_lift(shape, pose, ground).lift - depth;
            const CastAnswer answer = cast(shape, straight(pose.translation, {1, 0, 1}), ground);
            EXPECT_TRUE(answer.hit);
            EXPECT_TRUE(answer.started_in_contact);
            EXPECT_EQ(answer.fraction, 0.0);
            EXPECT_NEAR(answer.contact.depth, depth, 1e-9);
        }
    }
}

TEST(HullCast, PassesOverSeparatingContactsUntilTheyCloseAgain) {
    const Ground ground =
        make_test_ground([](double x, double) { return x > 70.0 ? x - 70.0 : 0.0; }, 1.0, 1);
    CastSettings settings;
    settings.skip_separating = true;
    const ConvexHull hull = make_hull(box_corners({1.0, 1.0, 0.5}));
    const std::vector<CompoundPart> parts{
        {make_hull(box_corners({0.5, 1.0, 0.5})), pose_at(-0.5, 0.0, 0.0)},
        {Box{{0.5, 1.0, 0.5}}, pose_at(0.5, 0.0, 0.0)}};
    for (const Shape& shape : {Shape(hull), Shape(Compound::create(parts).value())}) {
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

TEST(HullCast, OfTenThousandPointsMeetsWhatItsBallMeets) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const ConvexHull hull = make_hull(sphere(random, 10'000));
    const Ground ground =
        make_test_ground([](double x, double y) { return hash_height(x, y); }, 1.0, 1);
    for (int i = 0; i < 10; ++i) {
        const Motion motion = random_motion(random, ground, 30.0, i % 2 == 0 ? 0.0 : 2.0);
        if (compute_lift(Sphere{1.0}, motion.start, ground).lift >= 0.0) continue;
        const CastAnswer answer = cast(hull, motion, ground);
        const CastAnswer of_ball = cast(Sphere{1.0}, motion, ground);
        if (!answer.hit) continue;
        EXPECT_TRUE(of_ball.hit);
        EXPECT_GE(answer.fraction, of_ball.fraction - 1e-4 / 30.0);
        const double distance =
            signed_distance(hull, motion.at(answer.fraction), ground, 1.0).distance;
        EXPECT_GE(distance, -1e-9);
        EXPECT_LE(distance, 1e-4);
    }
}

TEST(HullCast, SaysNotResidentWhereUnloadedGroundComesFirst) {
    Random random(kSeed);
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    for (const Shape& shape : make_cast_shapes(random)) {
        const CastAnswer wall = cast(shape, straight({64.3, 64.4, 4.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(wall.status, ContactStatus::complete);
        EXPECT_TRUE(wall.hit);
        const CastAnswer unloaded =
            cast(shape, straight({104.3, 64.4, 4.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(unloaded.status, ContactStatus::not_resident);
        EXPECT_FALSE(unloaded.hit);
        EXPECT_GT(unloaded.fraction, 0.15);
        EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 130.0);
    }
}

}  // namespace
}  // namespace terrane
