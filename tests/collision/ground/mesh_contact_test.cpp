// SPDX-License-Identifier: MIT
//
// Queries of shapes in a closed chamber below the ground, against closed forms.
#include "collision/ground/cave_scene.h"
#include "collision/world/body_cases.h"
#include "support/allocation_counter.h"
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace terrane::mesh_contact_test {

using namespace test;

const Eigen::Vector3d kLow(40.0, 40.0, 10.0), kHigh(60.0, 60.0, 20.0);  // corners of the chamber

/// Gaps of a shape from the six walls of the chamber; wall 2 i is the lower one along axis i.
std::array<double, 6> wall_gaps(const Shape& shape, const Pose& pose, double shift) {
    std::array<double, 6> gaps{};
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d axis = pose.rotation.transpose() * Eigen::Vector3d::Unit(i);
        const double at = pose.translation[i] - (i < 2 ? shift : 0.0);
        gaps[static_cast<std::size_t>(2 * i)] = at - support_distance(shape, -axis) - kLow[i];
        gaps[static_cast<std::size_t>(2 * i + 1)] = kHigh[i] - at - support_distance(shape, axis);
    }
    return gaps;
}

/// A random pose in the chamber whose smallest gap from a wall is about `gap`.
Pose pose_near_walls(Random& random, const Shape& shape, double gap, double shift) {
    Pose pose{.rotation = random.rotation()};
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d axis = pose.rotation.transpose() * Eigen::Vector3d::Unit(i);
        const double low = kLow[i] + support_distance(shape, -axis) + gap;
        const double high = kHigh[i] - support_distance(shape, axis) - gap;
        const int where = random.below(4);
        const double at = random.between(low, high);
        pose.translation[i] = (where == 0 ? low : where == 1 ? high : at) + (i < 2 ? shift : 0.0);
    }
    return pose;
}

/// In a closed chamber whose shift from the origin is the parameter.
class MeshQueries : public ::testing::TestWithParam<double> {
protected:
    const double shift = GetParam();
    const CaveScene scene = make_cave(shift, true);
};

TEST_P(MeshQueries, DistancesApartAreThoseOfTheNearestWall) {
    SeededRandom random(11);
    for (const Shape& shape : all_shapes()) {
        for (int i = 0; i < 200; ++i) {
            const double gap = std::pow(10.0, random.between(-6.0, 0.0));
            const Pose pose = pose_near_walls(random, shape, gap, shift);
            const auto gaps = wall_gaps(shape, pose, shift);
            const auto least = std::min_element(gaps.begin(), gaps.end());
            const DistanceAnswer answer = signed_distance(shape, pose, scene.ground, 100.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_TRUE(answer.has_ground);
            ASSERT_NEAR(answer.distance, *least, 1e-9 + 1e-15 * shift) << name_of(shape) << i;
            auto sorted = gaps;
            std::ranges::sort(sorted);
            if (sorted[1] - sorted[0] < 1e-6) continue;
            const auto wall = least - gaps.begin();
            Eigen::Vector3d n = Eigen::Vector3d::Unit(wall / 2);
            if (wall % 2 == 1) n = -n;
            ASSERT_NEAR(answer.normal.dot(n), 1.0, 1e-6) << name_of(shape) << i;
            ASSERT_FALSE(test_contact(shape, pose, scene.ground).is_touching);
        }
    }
}

TEST_P(MeshQueries, ContactsAreThoseOfTheWallsWithinTheMargin) {
    SeededRandom random(12);
    constexpr double kMargin = 0.05;
    for (const Shape& shape : all_shapes()) {
        long compared = 0;
        for (int i = 0; i < 200; ++i) {
            const double gap = random.between(-0.04, 0.04);
            const Pose pose = pose_near_walls(random, shape, gap, shift);
            const auto gaps = wall_gaps(shape, pose, shift);
            std::array<Contact, 64> contacts;
            const ContactAnswer answer =
                find_contacts(shape, pose, scene.ground, kMargin, contacts);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            std::array<double, 6> deepest;
            deepest.fill(-std::numeric_limits<double>::infinity());
            for (std::size_t k = 0; k < answer.count; ++k) {
                int axis = 0;
                ASSERT_NEAR(contacts[k].normal.cwiseAbs().maxCoeff(&axis), 1.0, 1e-6)
                    << name_of(shape) << i << ": " << contacts[k].normal.transpose();
                const auto wall =
                    static_cast<std::size_t>(2 * axis + (contacts[k].normal[axis] < 0.0 ? 1 : 0));
                deepest[wall] = std::max(deepest[wall], contacts[k].depth);
            }
            for (std::size_t wall = 0; wall < 6; ++wall) {
                if (gaps[wall] > kMargin - 1e-6) continue;
                ++compared;
                ASSERT_NEAR(deepest[wall], -gaps[wall], 1e-6) << name_of(shape) << i << ' ' << wall;
            }
        }
        EXPECT_GT(compared, 50) << name_of(shape);
    }
}

TEST_P(MeshQueries, OverlapsAreResolvedByTheSumOfTheWalls) {
    SeededRandom random(13);
    for (const Shape& shape : simple_shapes()) {
        long overlapping = 0;
        for (int i = 0; i < 100; ++i) {
            const Pose pose = pose_near_walls(random, shape, -random.between(1e-3, 0.3), shift);
            const auto gaps = wall_gaps(shape, pose, shift);
            double square = 0.0;
            for (const double gap : gaps) square += std::min(gap, 0.0) * std::min(gap, 0.0);
            if (square == 0.0) continue;
            ++overlapping;
            const DistanceAnswer answer = signed_distance(shape, pose, scene.ground, 0.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_NEAR(answer.distance, -std::sqrt(square), 1e-6 * std::sqrt(square) + 1e-8)
                << name_of(shape) << i;
            Pose after = pose;
            after.translation -= answer.distance * answer.normal;
            const auto left = wall_gaps(shape, after, shift);
            ASSERT_GT(*std::min_element(left.begin(), left.end()), -1e-8);
            ASSERT_TRUE(test_contact(shape, pose, scene.ground).is_touching);
        }
        EXPECT_GT(overlapping, 5) << name_of(shape);
    }
}

TEST_P(MeshQueries, CastsStopWithinTheToleranceAndNeverLate) {
    SeededRandom random(14);
    constexpr double kTolerance = 1e-4;
    for (const Shape& shape : all_shapes()) {
        long hits = 0;
        for (int i = 0; i < 60; ++i) {
            Motion motion{.start = pose_near_walls(random, shape, random.between(0.01, 3.0), shift),
                          .translation = random.between(0.0, 40.0) * random.direction()};
            if (i % 2 == 0) motion.rotation_vector = random.between(0.0, 3.0) * random.direction();
            const CastAnswer answer = cast(shape, motion, scene.ground, {.tolerance = kTolerance});
            ASSERT_EQ(answer.status, QueryStatus::ok);
            constexpr int kSamples = 200;
            for (int k = 0; k <= kSamples; ++k) {
                const double t = answer.fraction * k / kSamples;
                const auto gaps = wall_gaps(shape, motion.at(t), shift);
                ASSERT_GT(*std::min_element(gaps.begin(), gaps.end()), -1e-9 - 1e-15 * shift)
                    << name_of(shape) << i << " at " << t << " of " << answer.fraction;
            }
            if (!answer.hit) continue;
            ++hits;
            const auto gaps = wall_gaps(shape, motion.at(answer.fraction), shift);
            ASSERT_LT(*std::min_element(gaps.begin(), gaps.end()), kTolerance + 1e-9);
        }
        EXPECT_GT(hits, 3) << name_of(shape);
        EXPECT_LT(hits, 60) << name_of(shape);
    }
}

TEST(MeshContact, AShapeInTheSolidComesOutTheShortWay) {
    const CaveScene scene = make_cave(0.0, true);
    for (const Shape& shape : all_shapes(0.5)) {
        for (const double depth : {3.0, 1.7}) {
            Pose pose;
            pose.translation = {50.0, 50.0, 10.0 - depth};  // below the floor
            const DistanceAnswer answer = signed_distance(shape, pose, scene.ground, 0.0);
            ASSERT_EQ(answer.status, QueryStatus::ok);
            ASSERT_LT(answer.distance, 0.0) << name_of(shape);
            EXPECT_GT(answer.distance, -depth - 2.0) << name_of(shape);
            pose.translation -= answer.distance * answer.normal;
            EXPECT_LT(scene.depth(shape, pose), 1e-6) << name_of(shape);
        }
        // Between the chamber and the surface, nearer to the surface.
        Pose pose{.translation = {50.0, 50.0, 36.0}};
        const DistanceAnswer answer = signed_distance(shape, pose, scene.ground, 0.0);
        ASSERT_LT(answer.distance, 0.0);
        pose.translation -= answer.distance * answer.normal;
        EXPECT_LT(scene.depth(shape, pose), 1e-6) << name_of(shape);
        EXPECT_GT(pose.translation.z(), 40.0) << name_of(shape);
    }
}

TEST(MeshContact, AShapeAroundTheWholeRoomGoesUp) {
    const CaveScene scene = make_cave(0.0, true);
    for (const Shape& shape :
         {Shape{Sphere{18.0}}, Shape{Capsule{16.0, 4.0}}, Shape{Box{{16.0, 15.0, 12.0}}}}) {
        Pose pose{.translation = {50.0, 50.0, 15.0}};
        ASSERT_TRUE(test_contact(shape, pose, scene.ground).is_touching) << name_of(shape);
        ASSERT_GT(compute_lift(shape, pose, scene.ground).lift, 0.0) << name_of(shape);
        const DistanceAnswer answer = signed_distance(shape, pose, scene.ground, 0.0);
        ASSERT_EQ(answer.status, QueryStatus::ok);
        ASSERT_LT(answer.distance, 0.0) << name_of(shape);
        pose.translation -= answer.distance * answer.normal;
        EXPECT_FALSE(signed_distance(shape, pose, scene.ground, 0.0).distance < 0.0)
            << name_of(shape);
        EXPECT_GT(pose.translation.z(), 40.0) << name_of(shape);
    }
}

TEST(MeshContact, TouchingIsADistanceOfZeroAndACastWithoutMotionStays) {
    const CaveScene scene = make_cave(0.0, true);
    Pose pose{.translation = {50.3, 47.1, 10.5}};
    for (const Shape& shape : {Shape{Sphere{0.5}}, Shape{Box{{0.7, 0.4, 0.5}}}}) {
        EXPECT_NEAR(signed_distance(shape, pose, scene.ground, 1.0).distance, 0.0, 1e-8);
        EXPECT_TRUE(test_contact(shape, pose, scene.ground).is_touching);
        EXPECT_TRUE(cast(shape, {pose}, scene.ground).started_in_contact);
        EXPECT_EQ(cast(shape, {pose}, scene.ground).fraction, 0.0);
        Pose apart = pose;
        apart.translation.z() += 0.01;
        const CastAnswer still = cast(shape, {apart}, scene.ground);
        EXPECT_EQ(still.status, QueryStatus::ok);
        EXPECT_FALSE(still.hit);
        EXPECT_EQ(still.fraction, 1.0);
        // Away from the contact.
        Motion away{pose, {0.0, 0.0, 3.0}};
        const CastAnswer leaves = cast(shape, away, scene.ground, {.skip_separating = true});
        EXPECT_FALSE(leaves.hit) << name_of(shape);
        // Along the contact.
        away.translation = {3.0, 1.0, 0.0};
        EXPECT_FALSE(cast(shape, away, scene.ground, {.skip_separating = true}).hit)
            << name_of(shape);
    }
}

TEST(MeshContact, RefusesWhatIsNotFinite) {
    const CaveScene scene = make_cave();
    Pose pose{.translation = {50.0, 50.0, std::nan("")}};
    std::array<Contact, 4> contacts;
    for (const Shape& shape : all_shapes()) {
        EXPECT_EQ(find_contacts(shape, pose, scene.ground, 0.1, contacts).status,
                  QueryStatus::invalid);
        EXPECT_EQ(signed_distance(shape, pose, scene.ground, 0.1).status, QueryStatus::invalid);
        EXPECT_EQ(cast(shape, {pose}, scene.ground).status, QueryStatus::invalid);
        EXPECT_EQ(compute_lift(shape, pose, scene.ground).status, QueryStatus::invalid);
        EXPECT_EQ(test_contact(shape, pose, scene.ground).status, QueryStatus::invalid);
    }
}

TEST(MeshContact, OnTheGroundAboveARoomIsAsWithoutIt) {
    const CaveScene scene = make_cave(0.0, true);
    const Ground plain = make_test_ground([](double, double) { return CaveScene::kTop; }, 1.0, 1);
    Random random(15);
    for (const Shape& shape : all_shapes()) {
        Pose pose{random.rotation(), {50.3, 49.2, 40.3}};
        std::array<Contact, 64> with, without;
        const ContactAnswer a = find_contacts(shape, pose, scene.ground, 0.1, with);
        const ContactAnswer b = find_contacts(shape, pose, plain, 0.1, without);
        ASSERT_EQ(a.count, b.count);
        ASSERT_EQ(a.lift, b.lift);
        for (std::size_t i = 0; i < a.count; ++i) {
            EXPECT_EQ(with[i].point_world, without[i].point_world);
            EXPECT_EQ(with[i].normal, without[i].normal);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(NearAndFar, MeshQueries, ::testing::Values(0.0, 1048576.0));

}  // namespace terrane::mesh_contact_test

// Bodies in a shaft and a cavern: closed forms check at every step that no body is deeper than its tolerance.

namespace terrane::mesh_bodies_test {

using namespace test;

/// Number of bodies of each shape: TERRANE_CAVE_BODIES, or a few.
int body_count() { return number_from("TERRANE_CAVE_BODIES", 12); }

struct Fall {
    double speed, dt;
    friend void PrintTo(const Fall& fall, std::ostream* out) {
        *out << fall.speed << " m/s, " << fall.dt << " s";
    }
};

class BodiesInACave : public ::testing::TestWithParam<Fall> {};

TEST_P(BodiesInACave, NeverGetDeeperThanTheirTolerance) {
    const auto [speed, dt] = GetParam();
    const CaveScene scene = make_cave();
    SeededRandom random(21);
    constexpr double kSeconds = 4.0;
    for (const Shape& shape : all_shapes(0.6)) {
        WorldSettings settings{.collide_bodies = false};
        World world = make_world(settings);
        std::vector<BodyId> bodies;
        for (int i = 0; i < body_count(); ++i) {
            BodyState state;
            // Above the mouth and its rim, or in the cavern in any direction.
            if (i % 2 == 0) {
                state.pose.translation = {random.between(45.0, 53.0), random.between(45.0, 53.0),
                                          43.0};
                state.velocity = {0.05 * speed * random.between(-1.0, 1.0),
                                  0.05 * speed * random.between(-1.0, 1.0), -speed};
            } else {
                state.pose.translation = {random.between(43.0, 57.0), random.between(43.0, 57.0),
                                          random.between(13.0, 17.0)};
                state.velocity = speed * random.direction();
            }
            state.pose.rotation = random.rotation();
            state.angular_velocity = 10.0 * random.direction();
            bodies.push_back(add(world, {.shape = shape}, state));
        }
        const double tolerance = default_contact_tolerance(shape);
        int in_cavern = 0;
        for (double time = 0.0; time < kSeconds; time += dt) {
            const StepReport report = world.step(scene.ground, dt);
            ASSERT_EQ(report.too_deep, 0u) << name_of(shape) << " at " << time;
            ASSERT_EQ(report.parked, 0u);
            for (const BodyId body : bodies) {
                const Pose& pose = world.state(body).pose;
                if ((pose.translation.head<2>() - Eigen::Vector2d(64.0, 64.0))
                        .cwiseAbs()
                        .maxCoeff() > 60.0) {
                    continue;  // it flew beyond the world's border
                }
                ASSERT_LT(scene.depth(world.settings(body).shape, pose), tolerance + 1e-9)
                    << name_of(shape) << ' ' << body.index << " at " << time << ": "
                    << pose.translation.transpose();
            }
        }
        for (const BodyId body : bodies) {
            const WorldPos& p = world.state(body).pose.translation;
            if (p.z() < 20.0) ++in_cavern;
        }
        EXPECT_GE(in_cavern, body_count() / 2) << name_of(shape);
    }
}

INSTANTIATE_TEST_SUITE_P(Falls, BodiesInACave,
                         ::testing::Values(Fall{0.0, 1.0 / 60.0}, Fall{300.0, 1.0 / 60.0},
                                           Fall{0.0, 0.1}, Fall{300.0, 0.1}));

TEST(BodiesOnAMesh, ComeToRestOnTheFloor) {
    const CaveScene scene = make_cave();
    for (const Shape& shape : all_shapes(0.6)) {
        World world = make_world();
        const BodyId body =
            add(world, {.shape = shape, .restitution = 0.0}, at({55.3, 43.2, 12.0}));
        for (int i = 0; i < 1200; ++i) world.step(scene.ground, 1.0 / 60.0);
        EXPECT_EQ(world.state(body).condition, BodyCondition::asleep) << name_of(shape);
        EXPECT_LT(std::abs(scene.depth(world.settings(body).shape, world.state(body).pose)),
                  default_contact_tolerance(shape))
            << name_of(shape);
    }
}

TEST(BodiesOnAMesh, ABoxSlidesOverInnerEdgesWithoutTurning) {
    const CaveScene scene = make_cave();
    World world = make_world();
    const Box box{{0.5, 0.4, 0.3}};
    const BodyId body = add(world, {.shape = box, .friction = 0.0, .restitution = 0.0},
                            at({42.0, 55.1, 10.3}, {3.0, 0.37, 0.0}));
    for (int i = 0; i < 240; ++i) {
        world.step(scene.ground, 1.0 / 60.0);
        const BodyState& state = world.state(body);
        ASSERT_LT(state.angular_velocity.norm(), 1e-6) << i;
        ASSERT_NEAR(state.velocity.x(), 3.0, 1e-6) << i;
        ASSERT_NEAR(state.velocity.y(), 0.37, 1e-6) << i;
        ASSERT_NEAR(state.pose.translation.z(), 10.3, 0.01) << i;
    }
}

TEST(BodiesOnAMesh, ASphereRollsOverTheRimAndFalls) {
    const CaveScene scene = make_cave();
    World world = make_world();
    const BodyId body = add(world, {.shape = Sphere{0.5}},
                            at({43.0, 49.2, 40.5}, {2.0, 0.0, 0.0}, {0.0, 4.0, 0.0}));
    for (int i = 0; i < 600; ++i) {
        ASSERT_EQ(world.step(scene.ground, 1.0 / 60.0).too_deep, 0u);
        const Pose& pose = world.state(body).pose;
        ASSERT_LT(scene.depth(Sphere{0.5}, pose), 0.01) << i;
        // It hits nothing before the rim.
        if (pose.translation.x() < 45.9) {
            ASSERT_NEAR(pose.translation.z(), 40.5, 0.01) << i;
            ASSERT_GT(world.state(body).velocity.x(), 1.9) << i;
        }
    }
    EXPECT_LT(world.state(body).pose.translation.z(), 11.0);
}

TEST(BodiesOnAMesh, PlacedInTheSolidComeOut) {
    const CaveScene scene = make_cave();
    for (const Shape& shape : all_shapes(0.5)) {
        World world = make_world();
        const BodyId body = add(world, {.shape = shape}, at({55.0, 43.0, 8.0}));
        double deepest = scene.depth(world.settings(body).shape, world.state(body).pose);
        for (int i = 0; i < 400; ++i) {
            world.step(scene.ground, 1.0 / 60.0);
            const double depth = scene.depth(world.settings(body).shape, world.state(body).pose);
            ASSERT_LT(depth, std::max(deepest, default_contact_tolerance(shape)) + 1e-6)
                << name_of(shape) << i;
            deepest = std::min(deepest, depth);
        }
        EXPECT_LT(deepest, default_contact_tolerance(shape)) << name_of(shape);
        EXPECT_GT(world.state(body).pose.translation.z(), 10.0) << name_of(shape);
    }
}

/// Adds bodies of all shapes in the cavern, moving in any direction.
void add_random_bodies(World& world, std::uint64_t seed, int count, double speed, bool turned) {
    Random random(seed);
    const std::vector<Shape> shapes = all_shapes(0.4);
    for (int i = 0; i < count; ++i) {
        BodyState state = at(
            {random.between(42.0, 58.0), random.between(42.0, 58.0), random.between(12.0, 18.0)});
        if (turned) state.pose.rotation = random.rotation();
        state.velocity = speed * random.direction();
        add(world, {.shape = shapes[static_cast<std::size_t>(i) % shapes.size()]}, state);
    }
}

TEST(BodiesOnAMesh, GiveTheSameBitsWithAnyNumberOfWorkers) {
    const CaveScene scene = make_cave();
    const auto run = [&](int workers) {
        World world = make_world({.worker_count = workers});
        add_random_bodies(world, 22, 40, 20.0, true);
        for (int i = 0; i < 120; ++i) world.step(scene.ground, 1.0 / 60.0);
        std::vector<double> numbers;
        for (const BodyState& state : world.states()) {
            for (int k = 0; k < 3; ++k) numbers.push_back(state.pose.translation[k]);
            for (int k = 0; k < 9; ++k) numbers.push_back(state.pose.rotation.data()[k]);
        }
        return numbers;
    };
    const std::vector<double> one = run(1);
    EXPECT_EQ(one, run(1));
    EXPECT_EQ(one, run(4));
}

TEST(BodiesOnAMesh, AStepAllocatesNothing) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer replaces operator new";
    const CaveScene scene = make_cave();
    World world = make_world(WorldSettings{.allow_sleep = false});
    add_random_bodies(world, 23, 20, 5.0, false);
    for (int i = 0; i < 300; ++i) world.step(scene.ground, 1.0 / 60.0);
    const AllocationCounter counter;
    for (int i = 0; i < 100; ++i) world.step(scene.ground, 1.0 / 60.0);
    EXPECT_EQ(counter.count(), 0u);
}

TEST(BodiesOnAMesh, ParkBesideGroundThatIsNotResident) {
    // A chamber that ends at the chunk's border, beyond which the ground is not resident.
    SolidTriangles solid;
    add_rectangle(solid, {100.0, 60.0, 5.0}, {28.0, 0.0, 0.0}, {0.0, 8.0, 0.0}, 1);
    add_rectangle(solid, {100.0, 60.0, 9.0}, {0.0, 8.0, 0.0}, {28.0, 0.0, 0.0}, 1);
    TableGroundSettings settings{
        .roots = 2,
        .is_resident = [](int column, int) { return column == 0; },
        .solid = [&](const Chunk& chunk) -> std::shared_ptr<const SolidSurface> {
            if (chunk.key.x != 0 || chunk.key.y != 0) return nullptr;
            return std::make_shared<const SolidSurface>(solid);
        }};
    const Ground ground = make_test_ground([](double, double) { return 20.0; }, settings);
    for (const Shape& shape : all_shapes(0.5)) {
        World world = make_world();
        const BodyId body =
            add(world, {.shape = shape, .friction = 0.0}, at({110.0, 64.0, 6.5}, {20.0, 0.0, 0.0}));
        bool is_parked = false;
        for (int i = 0; i < 120; ++i) {
            is_parked = world.step(ground, 1.0 / 60.0).parked > 0;
            ASSERT_LT(world.state(body).pose.translation.x(), 128.0) << name_of(shape);
        }
        EXPECT_TRUE(is_parked) << name_of(shape);
        EXPECT_GT(world.state(body).pose.translation.x(), 120.0) << name_of(shape);
    }
}

}  // namespace terrane::mesh_bodies_test
