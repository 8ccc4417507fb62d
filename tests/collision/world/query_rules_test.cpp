// SPDX-License-Identifier: MIT
//
// Rules of queries: filters, ties, refused arguments, absent ground.
#include "collision/world/body_cases.h"
#include "collision/world/world_cases.h"

#include <gtest/gtest.h>

namespace terrane::query_rules_test {

using namespace test;
using internal::BodyTree;
using internal::QueryBody;
using internal::QueryScene;

/// Balls of radius 0.5 at given positions, optionally with ground.
class Balls {
public:
    explicit Balls(const std::vector<WorldPos>& places, const Ground* ground = nullptr)
        : ground_(ground) {
        std::vector<Aabb> bounds;
        for (const WorldPos& place : places) {
            QueryBody body;
            body.shape = &ball();
            body.world_from_shape.translation = place;
            body.id = {static_cast<std::uint32_t>(bodies.size()), 7};
            bodies.push_back(body);
            bounds.push_back(internal::compute_aabb(ball(), body.world_from_shape));
        }
        tree_.build(bounds);
    }

    RayQueryAnswer ray(const WorldPos& from, const WorldPos& to, const QueryFilter& filter = {}) {
        return query_ray(scene(), from, to, filter);
    }
    CastQueryAnswer cast(const Motion& motion, const QueryFilter& filter = {}) {
        return query_cast(scene(), ball(), motion, filter);
    }
    NearestQueryAnswer nearest(const Pose& pose, double most, const QueryFilter& filter = {}) {
        return query_nearest(scene(), ball(), pose, most, filter);
    }
    OverlapQueryAnswer overlaps(const Pose& pose, const QueryFilter& filter = {}) {
        return query_overlaps(scene(), ball(), pose, filter, touched);
    }
    QueryScene scene() const { return {bodies, &tree_, ground_}; }

    std::vector<QueryBody> bodies;
    std::array<BodyId, 8> touched{};

private:
    static const Shape& ball() {
        static const Shape shape = Sphere{0.5};
        return shape;
    }

    BodyTree tree_;
    const Ground* ground_;
};

TEST(QueryRules, AFilterHidesLayersSensorsAndOneBody) {
    Balls balls({{2, 0, 0}, {4, 0, 0}, {6, 0, 0}});
    balls.bodies[0].filter.layers = 4;
    balls.bodies[1].is_sensor = true;
    QueryFilter filter;
    const auto first = [&] { return balls.ray({0, 0, 0}, {9, 0, 0}, filter).body.index; };
    EXPECT_EQ(first(), 0u);
    filter.layers = 3;
    EXPECT_EQ(first(), 2u);
    filter.include_sensors = true;
    EXPECT_EQ(first(), 1u);
    filter.except = balls.bodies[1].id;
    EXPECT_EQ(first(), 2u);
    filter.except.generation = 8;  // of another body that had the same slot
    EXPECT_EQ(first(), 1u);
    // Queries ignore CollisionFilter::collides_with.
    balls.bodies[1].filter.collides_with = 0;
    EXPECT_EQ(first(), 1u);
}

TEST(QueryRules, TheLowerIndexIsBeforeTheHigherAndABodyBeforeTheGround) {
    const Ground flat = make_test_ground([](double, double) { return 0.0; }, 1.0, 1);
    // Both balls and the ground are hit at exactly the same height.
    Balls balls({{70, 64, -0.5}, {64, 64, -0.5}, {64, 64, -0.5}, {64, 64, 40}}, &flat);
    const RayQueryAnswer ray = balls.ray({64, 64, 4}, {64, 64, -4});
    EXPECT_EQ(ray.fraction, 0.5);
    EXPECT_EQ(ray.body, balls.bodies[1].id);
    const NearestQueryAnswer nearest = balls.nearest(pose_at(64, 64, 2.5), 10.0);
    EXPECT_EQ(nearest.distance, 2.0);
    EXPECT_EQ(nearest.body, balls.bodies[1].id);
    const Motion down = straight({64, 64, 2.5}, {0, 0, -4});
    const CastQueryAnswer cast = balls.cast(down);
    ASSERT_TRUE(cast.hit);
    QueryFilter only_ground{.layers = 0};
    const CastQueryAnswer on_ground = balls.cast(down, only_ground);
    ASSERT_TRUE(on_ground.hits_ground());
    if (cast.fraction == on_ground.fraction) {
        EXPECT_EQ(cast.body, balls.bodies[1].id);
    }
    only_ground.include_ground = false;
    EXPECT_FALSE(balls.cast(down, only_ground).hit);
    EXPECT_FALSE(balls.ray({64, 64, 4}, {64, 64, -4}, only_ground).hit);
    EXPECT_FALSE(balls.nearest(pose_at(64, 64, 2.5), 10.0, only_ground).is_found);
}

TEST(QueryRules, AnIdenticalBodyWithALowerIndexIsTheAnswerOfEveryQuery) {
    const std::vector<WorldPos> same(8, {3, 0, 0});
    Balls balls(same);
    for (std::size_t hidden = 0; hidden < same.size(); ++hidden) {
        const BodyId lowest = balls.bodies[hidden].id;
        EXPECT_EQ(balls.ray({0, 0, 0}, {9, 0, 0}).body, lowest);
        EXPECT_EQ(balls.cast(straight({0, 0, 0}, {9, 0, 0})).body, lowest);
        EXPECT_EQ(balls.nearest(Pose{}, 9.0).body, lowest);
        EXPECT_EQ(balls.overlaps(pose_at(3, 0, 0)).touching_count, same.size() - hidden);
        EXPECT_EQ(balls.touched[0], lowest);
        balls.bodies[hidden].shape = nullptr;
    }
    EXPECT_FALSE(balls.nearest(Pose{}, kInfinity).is_found);
}

TEST(QueryRules, NanAndSizesOutOfRangeAreInvalidInAnyWorld) {
    const Ground& ground = rough_grounds().near;
    const auto expect_invalid = [](const auto& answer) {
        EXPECT_EQ(answer.status, QueryStatus::invalid);
    };
    for (Balls balls : {Balls({}), Balls({{1, 0, 0}}), Balls({{1, 0, 0}}, &ground)}) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const double bad : {kNan, kInfinity, -kInfinity}) {
                WorldPos broken(1, 2, 3);
                broken[axis] = bad;
                expect_invalid(balls.ray(broken, {0, 0, 0}));
                expect_invalid(balls.ray({0, 0, 0}, broken));
                expect_invalid(balls.cast(straight({0, 0, 0}, broken)));
                expect_invalid(balls.cast(straight(broken, {0, 0, 1})));
                expect_invalid(balls.cast({.start = {}, .rotation_vector = broken}));
                Pose broken_rotation;
                broken_rotation.rotation(axis, 0) = bad;
                for (const Pose& pose : {Pose{.translation = broken}, broken_rotation}) {
                    expect_invalid(balls.overlaps(pose));
                    expect_invalid(balls.nearest(pose, 1.0));
                }
            }
        }
        expect_invalid(balls.nearest(Pose{}, kNan));
        expect_invalid(balls.nearest(Pose{}, -1e-9));
        expect_invalid(query_overlaps(balls.scene(), Sphere{-1.0}, Pose{}, {}, balls.touched));
        expect_invalid(query_nearest(balls.scene(), Sphere{kNan}, Pose{}, 1.0, {}));
        expect_invalid(query_cast(balls.scene(), Sphere{2e5}, Motion{}, {}));
        // The ends are finite, but their difference is not.
        expect_invalid(balls.ray({-1.5e308, 0, 0}, {1.5e308, 0, 0}));
    }
}

TEST(QueryRules, ARayWithoutLengthMeetsWhatItIsIn) {
    Balls balls({{0, 0, 0}, {0.2, 0, 0}, {5, 0, 0}});
    const RayQueryAnswer within = balls.ray({0.1, 0, 0}, {0.1, 0, 0});
    ASSERT_TRUE(within.hit);
    EXPECT_EQ(within.fraction, 0.0);
    EXPECT_EQ(within.body.index, 0u);
    EXPECT_EQ(within.point_world, WorldPos(0.1, 0, 0));
    const RayQueryAnswer beside = balls.ray({2, 0, 0}, {2, 0, 0});
    EXPECT_EQ(beside.status, QueryStatus::ok);
    EXPECT_FALSE(beside.hit);
    EXPECT_EQ(beside.fraction, 1.0);
}

TEST(QueryRules, AMovingShapeLeavesWhatItTouchesButDoesNotEnterIt) {
    Balls balls({{1, 0, 0}, {9, 0, 0}});
    EXPECT_EQ(balls.cast(straight({0, 0, 0}, {5, 0, 0})).fraction, 0.0);
    EXPECT_FALSE(balls.cast(straight({0, 0, 0}, {-5, 0, 0})).hit);
    EXPECT_FALSE(balls.cast(straight({0, 0, 0}, {0, 5, 0})).hit);
    // From an overlap towards the other body.
    const CastQueryAnswer out = balls.cast(straight({1.5, 0, 0}, {10, 0, 0}));
    ASSERT_TRUE(out.hit);
    EXPECT_EQ(out.body.index, 1u);
    EXPECT_NEAR(out.fraction, 0.65, 1e-4);
}

TEST(QueryRules, AGrazingMotionMeetsTheBodyAndAPassOutsideTheToleranceDoesNot) {
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d along = 10.0 * Eigen::Vector3d::Unit(axis);
        for (const double side : {-1.0, 1.0}) {
            const Eigen::Vector3d beside = side * Eigen::Vector3d::Unit((axis + 1) % 3);
            Balls balls({0.5 * along + beside});
            EXPECT_TRUE(balls.cast(straight(1e-6 * beside, along)).hit);
            EXPECT_FALSE(balls.cast(straight(-1e-3 * beside, along)).hit);
            EXPECT_TRUE(balls.ray(0.500001 * beside, along + 0.500001 * beside).hit);
            EXPECT_FALSE(balls.ray(0.499999 * beside, along + 0.499999 * beside).hit);
        }
    }
}

TEST(QueryRules, ATurningShapeMeetsWhatItsBoxAtTheStartDoesNotReach) {
    Balls balls({{0, 2.5, 0}, {0, -3.3, 0}});  // the other ball is hit later
    Motion quarter_turn{.start = {}, .rotation_vector = {0, 0, 1.5}};
    const Shape bar = Box{{3.0, 0.1, 0.1}};
    const CastQueryAnswer met = query_cast(balls.scene(), bar, quarter_turn, {});
    ASSERT_TRUE(met.hit);
    EXPECT_EQ(met.body.index, 0u);
    EXPECT_GT(met.fraction, 0.5);
    quarter_turn.rotation_vector = {0, 0, 1.0};
    EXPECT_FALSE(query_cast(balls.scene(), bar, quarter_turn, {}).hit);
}

TEST(QueryRules, NearestStopsAtTheLargestDistance) {
    Balls balls({{3, 0, 0}});
    EXPECT_FALSE(balls.nearest(Pose{}, 1.999).is_found);
    EXPECT_TRUE(balls.nearest(Pose{}, 2.0).is_found);
    const NearestQueryAnswer answer = balls.nearest(Pose{}, kInfinity);
    EXPECT_EQ(answer.distance, 2.0);
    EXPECT_EQ(answer.point_world, WorldPos(0.5, 0, 0));
    EXPECT_EQ(answer.point_other_world, WorldPos(2.5, 0, 0));
    EXPECT_EQ(answer.normal, WorldPos(-1, 0, 0));
    // An overlap is nearer than any gap, whatever the largest distance.
    EXPECT_EQ(balls.nearest(pose_at(2.5, 0, 0), 0.0).distance, -0.5);
}

TEST(QueryRules, AbsentGroundMattersOnlyBeforeTheFirstBody) {
    // Four by four root squares of 32 m, the eastern half not resident.
    const Ground ground = make_test_ground(
        [](double, double) { return 0.0; },
        {.spacing = 0.25, .roots = 4, .is_resident = [](int column, int) { return column < 2; }});
    Balls balls({{40, 20, 1}, {90, 20, 1}}, &ground);
    QueryFilter second{.except = balls.bodies[0].id};
    const WorldPos from(10, 20, 1), to(100, 20, 1);

    const auto expect_known = [&](const auto& answer, std::size_t body) {
        EXPECT_EQ(answer.status, QueryStatus::ok);
        EXPECT_EQ(answer.body, balls.bodies[body].id);
    };
    expect_known(balls.ray(from, to), 0);
    const RayQueryAnswer ray = balls.ray(from, to, second);
    EXPECT_EQ(ray.status, QueryStatus::not_resident);
    EXPECT_FALSE(ray.hit);
    EXPECT_EQ(ray.fraction, 0.0);
    // From inside a body over absent ground: nothing can be hit before the body.
    expect_known(balls.ray({90, 20, 1}, {95, 20, -1}), 1);

    expect_known(balls.cast(straight(from, {80, 0, 0})), 0);
    const CastQueryAnswer cast = balls.cast(straight(from, {80, 0, 0}), second);
    EXPECT_EQ(cast.status, QueryStatus::not_resident);
    EXPECT_FALSE(cast.hit);
    EXPECT_NEAR(cast.fraction, (64.0 - 10.0 - 0.5) / 80.0, 0.01);

    const OverlapQueryAnswer over_absent = balls.overlaps(pose_at(90, 20, 0.2));
    EXPECT_EQ(over_absent.status, QueryStatus::not_resident);
    EXPECT_EQ(over_absent.count, 1u);
    EXPECT_EQ(balls.touched[0], balls.bodies[1].id);
    const OverlapQueryAnswer over_resident = balls.overlaps(pose_at(40, 20, 0.2));
    EXPECT_EQ(over_resident.status, QueryStatus::ok);
    EXPECT_TRUE(over_resident.touches_ground);

    // Ground is tested only if it could be nearer than the nearest body.
    expect_known(balls.nearest(pose_at(40, 20, 3.5), 60.0), 0);
    const NearestQueryAnswer nearest = balls.nearest(pose_at(90, 20, 3.5), 60.0);
    EXPECT_EQ(nearest.status, QueryStatus::not_resident);
    EXPECT_EQ(nearest.body, balls.bodies[1].id);
    EXPECT_EQ(balls.nearest(pose_at(80, 20, 2.0), 8.0).status, QueryStatus::not_resident);
}

}  // namespace terrane::query_rules_test
