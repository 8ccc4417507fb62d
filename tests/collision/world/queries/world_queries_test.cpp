// SPDX-License-Identifier: MIT
// The queries of many bodies against a query of every body by itself.
#include "query_oracle.h"

#include <gtest/gtest.h>

namespace terrane {
namespace world_queries_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

class WorldQueries : public testing::TestWithParam<SceneCase> {
protected:
    /// Calls check(scene, random) for many queries of a scene, and again after its bodies have moved.
    template <class Check>
    void for_each_query(const Check& check) {
        Random random(kSeed);
        TestScene scene(random, GetParam());
        for (const bool has_moved : {false, true}) {
            if (has_moved) scene.move(random);
            for (int i = 0; i < query_count(GetParam()) && !HasFailure(); ++i) {
                SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", query " << i
                                                << (has_moved ? " after a refit" : ""));
                check(scene, random);
            }
        }
    }
    /// Of few bodies hardly any query finds one.
    void expect_many(int found) const {
        if (GetParam().count >= 50) {
            EXPECT_GT(found, query_count(GetParam()) / 5);
        }
    }
};

INSTANTIATE_TEST_SUITE_P(Scenes, WorldQueries, testing::ValuesIn(scene_cases()),
                         [](const auto& each) { return name_of(each.param); });

TEST_P(WorldQueries, FindWhatARayMeetsFirst) {
    int bodies = 0;
    for_each_query([&](const TestScene& scene, Random& random) {
        const WorldPos from = scene.any_place(random, 4.0);
        const WorldPos to = scene.any_target(random, from);
        const QueryFilter filter = scene.any_filter(random);
        const RayQueryAnswer expected = oracle_ray(scene.scene(), from, to, filter);
        const RayQueryAnswer found = query_ray(scene.scene(), from, to, filter);
        EXPECT_EQ(found.status, expected.status);
        EXPECT_EQ(found.hit, expected.hit);
        EXPECT_EQ(found.fraction, expected.fraction);
        EXPECT_EQ(found.body, expected.body);
        EXPECT_EQ(found.point_world, expected.point_world);
        EXPECT_EQ(found.normal, expected.normal);
        EXPECT_EQ(found.part, expected.part);
        EXPECT_EQ(found.hits_ground(), expected.hit && expected.body == BodyId{});
        bodies += expected.body.is_valid();
    });
    expect_many(bodies);
}

TEST_P(WorldQueries, FindWhatAMovingShapeMeetsFirst) {
    int bodies = 0;
    for_each_query([&](const TestScene& scene, Random& random) {
        const Shape& shape = TestScene::any_shape(random);
        const Motion motion = scene.any_motion(random);
        const QueryFilter filter = scene.any_filter(random);
        const CastQueryAnswer expected = oracle_cast(scene.scene(), shape, motion, filter);
        const CastQueryAnswer found = query_cast(scene.scene(), shape, motion, filter);
        EXPECT_EQ(found.status, expected.status);
        EXPECT_EQ(found.hit, expected.hit);
        EXPECT_EQ(found.fraction, expected.fraction);
        EXPECT_EQ(found.body, expected.body);
        EXPECT_EQ(found.point_world, expected.point_world);
        EXPECT_EQ(found.normal, expected.normal);
        EXPECT_EQ(found.part, expected.part);
        EXPECT_EQ(found.hits_ground(), expected.hit && expected.body == BodyId{});
        bodies += expected.body.is_valid();
    });
    expect_many(bodies);
}

TEST_P(WorldQueries, FindTheBodiesThatAShapeTouchesInAscendingOrder) {
    int bodies = 0;
    for_each_query([&](const TestScene& scene, Random& random) {
        const Shape& shape = TestScene::any_shape(random);
        const Pose pose = scene.any_near_pose(random);
        const QueryFilter filter = scene.any_filter(random);
        const std::vector<BodyId> expected = oracle_overlaps(scene.scene(), shape, pose, filter);
        bodies += !expected.empty();
        for (const std::size_t room :
             {expected.size(), expected.size() + 3, expected.size() / 2, std::size_t{0}}) {
            std::vector<BodyId> written(room);
            const OverlapQueryAnswer found =
                query_overlaps(scene.scene(), shape, pose, filter, written);
            const bool is_whole = room >= expected.size();
            EXPECT_EQ(found.status, is_whole ? QueryStatus::complete : QueryStatus::truncated);
            EXPECT_EQ(found.touching_count, expected.size());
            ASSERT_EQ(found.count, std::min(room, expected.size()));
            EXPECT_TRUE(std::equal(written.begin(),
                                   written.begin() + static_cast<std::ptrdiff_t>(found.count),
                                   expected.begin()));
            EXPECT_EQ(
                found.touches_ground,
                filter.include_ground && test_contact(shape, pose, scene.ground()).is_touching);
        }
    });
    expect_many(bodies);
}

TEST_P(WorldQueries, FindWhatIsNearestToAShape) {
    int bodies = 0;
    for_each_query([&](const TestScene& scene, Random& random) {
        const Shape& shape = TestScene::any_shape(random);
        const Pose pose = scene.any_pose(random, 2.0);
        const QueryFilter filter = scene.any_filter(random);
        const double most = random.below(3) == 0 ? std::numeric_limits<double>::infinity()
                                                 : random.between(0.0, 4.0);
        const NearestQueryAnswer expected =
            oracle_nearest(scene.scene(), shape, pose, most, filter);
        const NearestQueryAnswer found = query_nearest(scene.scene(), shape, pose, most, filter);
        EXPECT_EQ(found.status, expected.status);
        EXPECT_EQ(found.is_found, expected.is_found);
        EXPECT_EQ(found.body, expected.body);
        EXPECT_EQ(found.distance, expected.distance);
        EXPECT_EQ(found.point_world, expected.point_world);
        EXPECT_EQ(found.point_other_world, expected.point_other_world);
        EXPECT_EQ(found.normal, expected.normal);
        EXPECT_EQ(found.part, expected.part);
        EXPECT_EQ(found.is_ground(), expected.is_found && expected.body == BodyId{});
        bodies += expected.body.is_valid();
    });
    expect_many(bodies);
}

}  // namespace world_queries_test
}  // namespace terrane
