// SPDX-License-Identifier: MIT
#include "cast_checks.h"
#include "hull_cases.h"

#include <terrane/collision/ground_cast.h>

#include <gtest/gtest.h>

namespace terrane {
namespace hull_cast_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261103;

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
            for (int i = 0; i < 24; ++i) {
                const Motion motion = random_motion(random, ground, i);
                if (compute_lift(shapes[s], motion.start, ground).lift >= 0.0) continue;
                expect_stops_at_the_ground(shapes[s], motion, ground);
            }
        }
    }
}

TEST(HullCast, MeetsAThinWallAtAnySpeed) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (const Shape& shape : make_cast_shapes(random)) {
        expect_meets_a_thin_wall_at_any_speed(shape, 59.0, 64.5);
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
    for (const Shape& shape : make_cast_shapes(random)) {
        expect_slides_over_flat_seams(random, shape, 20);
    }
}

TEST(HullCast, ReportsTouchAndOverlapAtTheStart) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    for (const Shape& shape : make_cast_shapes(random)) {
        const double lift = compute_lift(shape, pose_at(64.3, 64.4, 0.0), ground).lift;
        expect_reports_touch_and_overlap_at_the_start(shape, lift);
    }
}

TEST(HullCast, PassesOverSeparatingContactsUntilTheyCloseAgain) {
    const ConvexHull hull = make_hull(box_corners({1.0, 1.0, 0.5}));
    const std::vector<CompoundPart> parts{
        {make_hull(box_corners({0.5, 1.0, 0.5})), pose_at(-0.5, 0.0, 0.0)},
        {Box{{0.5, 1.0, 0.5}}, pose_at(0.5, 0.0, 0.0)}};
    for (const Shape& shape : {Shape(hull), Shape(Compound::create(parts).value())}) {
        expect_passes_over_separating_contacts(shape);
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
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    TableGroundSettings settings;
    settings.roots = 2;
    settings.is_resident = [](int column, int) { return column == 0; };
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    for (const Shape& shape : make_cast_shapes(random)) {
        const CastAnswer wall = cast(shape, straight({64.3, 64.4, 4.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(wall.status, QueryStatus::complete);
        EXPECT_TRUE(wall.hit);
        const CastAnswer unloaded =
            cast(shape, straight({104.3, 64.4, 4.0}, {100.0, 0.0, 0.0}), ground);
        EXPECT_EQ(unloaded.status, QueryStatus::not_resident);
        EXPECT_FALSE(unloaded.hit);
        EXPECT_GT(unloaded.fraction, 0.15);
        EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 130.0);
    }
}

}  // namespace hull_cast_test
}  // namespace terrane
