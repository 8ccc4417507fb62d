// SPDX-License-Identifier: MIT
#include "collision/ground/ground_cases.h"
#include "ground/heightfield/heightfield_queries.h"

#include <gtest/gtest.h>

#include <limits>

namespace terrane::ground_cast_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260202;

class ShapeCasts : public EveryShape {};
INSTANTIATE_TEST_SUITE_P(All, ShapeCasts, testing::ValuesIn(make_named_shapes()), shape_name);

TEST_P(ShapeCasts, ReportTheContactWhereTheyStop) {
    SeededRandom random(kSeed);
    long cases = 0, hits = 0;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        long apart = 0;
        for (int i = 0; i < 24; ++i) {
            const Motion motion = random_motion(random, ground, i);
            if (compute_lift(shape(), motion.start, ground).lift >= 0.0) continue;
            ++apart;
            const CastAnswer answer = cast(shape(), motion, ground);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            EXPECT_FALSE(answer.started_in_contact);
            if (!answer.hit) continue;
            ++hits;
            const Pose there = motion.at(answer.fraction);
            const double gap = signed_distance(shape(), there, ground, 1.0).distance;
            EXPECT_GE(gap, -1e-9);
            EXPECT_LE(gap, 1e-4);
            EXPECT_GT(answer.contact.normal.z(), 0.0);
            EXPECT_NEAR(answer.contact.depth, 0.0, 1e-4 + 1e-9);
        }
        EXPECT_GT(apart, 1);
        cases += apart;
    }
    EXPECT_GT(hits, cases / 20);
    EXPECT_LT(hits, cases);
}

// The wall is at x = 64. The shape's origin stops up to 5 m before it, or just behind it if the shape is off its
// origin.
TEST_P(ShapeCasts, HitAThinWallAtAnySpeed) {
    const Ground ground =
        make_test_ground([](double x, double) { return x == 64.0 ? 50.0 : 0.0; }, 1.0, 1);
    for (const double distance : {100.0, 300.0, 1e6}) {
        for (const double spin : {0.0, 2.0, 40.0}) {
            Motion motion = straight({10.0, 60.3, 20.0}, {distance, 0.0, 0.0});
            motion.rotation_vector = {0.3 * spin, spin, 0.1 * spin};
            const CastAnswer answer = cast(shape(), motion, ground);
            ASSERT_TRUE(answer.hit);
            const Pose met = motion.at(answer.fraction);
            EXPECT_GT(met.translation.x(), 59.0);
            EXPECT_LT(met.translation.x(), 64.5);
            EXPECT_LE(compute_lift(shape(), met, ground).lift, 1e-9);
        }
    }
}

TEST_P(ShapeCasts, ReportNotResidentWhereUnloadedGroundComesFirst) {
    TableGroundSettings settings{.roots = 2,
                                 .is_resident = [](int column, int) { return column == 0; }};
    const Ground ground =
        make_test_ground([](double x, double) { return x == 100.0 ? 9.0 : 0.0; }, settings);
    const auto along_x = [&](double from, double distance) {
        return cast(shape(), straight({from, 64.4, 4.0}, {distance, 0.0, 0.0}), ground);
    };
    const CastAnswer wall = along_x(64.3, 100.0);
    EXPECT_EQ(wall.status, QueryStatus::ok);
    EXPECT_TRUE(wall.hit);
    const CastAnswer unloaded = along_x(104.3, 100.0);
    EXPECT_EQ(unloaded.status, QueryStatus::not_resident);
    EXPECT_FALSE(unloaded.hit);
    EXPECT_GT(unloaded.fraction, 0.15);
    EXPECT_LT(104.3 + 100.0 * unloaded.fraction, 130.0);
    EXPECT_EQ(along_x(140.3, 1.0).status, QueryStatus::not_resident);
}

// All shapes have a half extent of 0.5 m in z and at most 1 m in x and y.
TEST(Cast, SkipsSeparatingContactsUntilTheyCloseAgain) {
    const Ground ground =
        make_test_ground([](double x, double) { return x > 70.0 ? x - 70.0 : 0.0; }, 1.0, 1);
    const std::vector<CompoundPart> parts{
        {make_hull(box_corners({0.5, 1.0, 0.5})), pose_at(-0.5, 0.0, 0.0)},
        {Box{{0.5, 1.0, 0.5}}, pose_at(0.5, 0.0, 0.0)}};
    for (const Shape& shape :
         {Shape(Sphere{0.5}), Shape(Capsule{0.25, 0.25}), Shape(Box{{1.0, 1.0, 0.5}}),
          Shape(make_hull(box_corners({1.0, 1.0, 0.5}))), Shape(Compound::create(parts).value())}) {
        for (const double depth : {0.0, 0.01}) {
            const auto skip = [&](const Eigen::Vector3d& translation) {
                return cast(shape, straight({60.3, 64.4, 0.5 - depth}, translation), ground,
                            {.skip_separating = true});
            };
            EXPECT_FALSE(skip({0.0, 0.0, 1.0}).hit);
            EXPECT_FALSE(skip({3.0, 2.0, 0.0}).hit);
            const CastAnswer closing = skip({0.0, 0.0, -1.0});
            EXPECT_TRUE(closing.started_in_contact);
            EXPECT_EQ(closing.fraction, 0.0);
            const CastAnswer slope = skip({30.0, 0.0, 0.0});
            EXPECT_TRUE(slope.hit);
            EXPECT_GT(slope.fraction, 0.25);
            EXPECT_LT(slope.fraction, 0.35);
        }
    }
}

TEST(Cast, DoesNotHitWhenTurningAwayFromAContact) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // Starts a quarter of the tolerance above the ground and tips away from it.
    Motion motion{.start = {.translation = {64.3, 64.4, 0.5 + 0.25e-4}},
                  .translation = {0.0, 0.0, 0.5},
                  .rotation_vector = {0.2, 0.0, 0.0}};
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
    // From far above and far beside; each cast must take only milliseconds.
    constexpr double kDistance = 1e9;
    const CastAnswer down = cast_far({64.3, 64.4, 0.5 * kDistance}, {0.0, 0.0, -kDistance});
    EXPECT_TRUE(down.hit);
    EXPECT_NEAR(down.fraction, 0.5, 1e-8);
    EXPECT_FALSE(cast_far({64.3, 64.4, 9.0}, {kDistance, 0.0, 0.0}).hit);
    EXPECT_FALSE(cast_far({-1e6, 64.4, 9.0}, {-kDistance, kDistance, 0.0}).hit);
    // At larger distances doubles do not resolve the tolerance.
    for (const double distance : {1e15, 1e100}) {
        EXPECT_EQ(cast_far({64.3, 64.4, 0.5 * distance}, {0.0, 0.0, -distance}).status,
                  QueryStatus::invalid);
    }
}

TEST(Cast, TurnsAboutTheBodysOriginAndNotAboutItsCentre) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // A needle 3 m to the east swings down a quarter circle, past the ground 1.5 m below the origin.
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

}  // namespace terrane::ground_cast_test

namespace terrane::sweep_clear_test {

using namespace test;
using internal::is_sweep_clear;

constexpr std::uint64_t kSeed = 20261123;
constexpr double kMargin = 1e-3;
constexpr int kSamples = 48;  // samples per motion

/// Hulls and compounds are off their origins, so that rotation also translates them.
std::vector<Shape> make_shapes() {
    std::vector<Shape> shapes{Sphere{0.5},          Capsule{0.4, 0.8},     Capsule{0.1, 0.0},
                              Box{{1.0, 2.0, 0.5}}, Box{{0.3, 0.2, 0.01}}, Box{{2.0, 0.0, 0.0}}};
    const std::vector<Eigen::Vector3d> wedge{{0.2, -0.6, -0.3}, {1.2, -0.7, -0.4}, {0.8, 0.9, -0.3},
                                             {0.1, 0.8, -0.4},  {0.3, 0.1, 0.9},   {0.6, 0.4, 0.7}};
    shapes.push_back(ConvexHull::create(wedge).value());
    Random random(kSeed + 1);
    std::vector<Eigen::Vector3d> stone;
    for (int i = 0; i < 80; ++i) stone.push_back(0.7 * random.direction());
    shapes.push_back(ConvexHull::create(stone).value());
    std::vector<CompoundPart> parts{{Box{{0.3, 0.8, 0.3}}, {}},
                                    {Capsule{0.25, 0.7}, {}},
                                    {Sphere{0.4}, {}},
                                    {std::get<ConvexHull>(shapes[6]), {}}};
    for (CompoundPart& part : parts) {
        part.body_from_part = {random.rotation(), 1.2 * random.direction()};
    }
    shapes.push_back(Compound::create(parts).value());
    return shapes;
}

/// A short motion that starts just above the ground, like that of a body in a substep.
Motion random_short_motion(Random& random, const Shape& shape, const Ground& ground) {
    Motion motion{.start = random_pose(random, ground, 0.0, 1.0)};
    const double above = random.below(2) == 0 ? 2.5e-3 : random.between(0.0, 0.3);
    motion.start.translation.z() += compute_lift(shape, motion.start, ground).lift + above;
    const double distance = std::exp(random.between(std::log(1e-4), std::log(0.3)));
    const double turn = std::exp(random.between(std::log(1e-4), std::log(0.5)));
    motion.translation = distance * random.direction();
    motion.rotation_vector = turn * random.direction();
    return motion;
}

/// Least distance to the ground over sampled poses of a motion, at most `most`.
double least_distance(const Shape& shape, const Motion& motion, const Ground& ground, double most) {
    double least = most;
    for (int i = 0; i <= kSamples; ++i) {
        const Pose pose = motion.at(static_cast<double>(i) / kSamples);
        least = std::min(least, signed_distance(shape, pose, ground, most).distance);
    }
    return least;
}

TEST(SweepClear, ProvedMotionsKeepTheMarginAndAreHitByNoCast) {
    SeededRandom random(kSeed);
    const int count = few_or_many(75, 1000);
    int clear = 0, proved = 0, met = 0, hits = 0;
    for (const auto& [name, ground] : scenes()) {
        SCOPED_TRACE(name);
        for (const Shape& shape : make_shapes()) {
            for (int i = 0; i < count; ++i) {
                const Motion motion = random_short_motion(random, shape, ground);
                const double least = least_distance(shape, motion, ground, 2.0 * kMargin);
                const bool is_hit = cast(shape, motion, ground, {.tolerance = kMargin}).hit;
                if (is_sweep_clear(shape, motion, ground, kMargin)) {
                    EXPECT_GE(least, kMargin - 1e-9) << "motion " << i;
                    EXPECT_FALSE(is_hit) << "motion " << i;
                    ++proved;
                }
                ++(least < kMargin ? met : clear);
                hits += is_hit;
            }
        }
    }
    // Both outcomes occur often enough.
    EXPECT_GT(met, few_or_many(250, 3300));
    EXPECT_GT(clear, few_or_many(250, 3300));
    EXPECT_GT(hits, few_or_many(100, 1300));
    EXPECT_GT(proved, clear / 2) << "of " << clear;
}

TEST(SweepClear, ProvesAFallThatEndsAboveOrBesideTheGround) {
    const Ground ground = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    const Box box{{1.0, 2.0, 0.5}};
    const std::vector<CompoundPart> parts{{Sphere{0.5}, {}}, {box, {}}};
    const auto is_clear = [&](const Shape& shape, const Eigen::Vector3d& from, double fall) {
        return is_sweep_clear(shape, straight(from, {0.3, 0.0, -fall}), ground, kMargin);
    };
    for (const Shape& shape : {Shape(box), Shape(Compound::create(parts).value())}) {
        EXPECT_TRUE(is_clear(shape, {64.0, 64.0, 2.0}, 1.4));
        EXPECT_FALSE(is_clear(shape, {64.0, 64.0, 2.0}, 1.5));
        EXPECT_TRUE(is_clear(shape, {-50.0, 64.0, -2.0}, 1.4));
    }
}

TEST(SweepClear, ProvesNothingForLargeTurnsInvalidInputOrMissingGround) {
    const Ground flat = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    Motion high = straight({64.0, 64.0, 1000.0}, {0.1, 0.0, 0.0});
    ASSERT_TRUE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = 0.6;
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));
    high.rotation_vector.z() = 0.0;
    high.translation.x() = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(is_sweep_clear(Box{{1.0, 1.0, 1.0}}, high, flat, kMargin));

    TableGroundSettings settings{
        .roots = 2, .bound = 100.0f, .is_resident = [](int column, int) { return column == 0; }};
    const Ground half = make_test_ground([](double, double) { return 0.0; }, settings);
    const Eigen::Vector3d up(0.0, 0.0, 0.1);
    EXPECT_TRUE(is_sweep_clear(Sphere{1.0}, straight({120.0, 64.0, 2.0}, up), half, kMargin));
    EXPECT_FALSE(is_sweep_clear(Sphere{1.0}, straight({127.5, 64.0, 2.0}, up), half, kMargin));
}

}  // namespace terrane::sweep_clear_test
