// SPDX-License-Identifier: MIT
#include "collision/world/world_cases.h"
#include "support/allocation_counter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

namespace terrane::world_queries_test {

using namespace test;

constexpr std::uint64_t kSeed = 20261124;

// Brute-force queries of a scene: each body by itself, then the least answer. All ground must be resident.

/// The hit with the least fraction, the first of several; none: no hit.
template <class Answer>
Answer first_of(const std::vector<Answer>& hits) {
    if (hits.empty()) return Answer{.status = QueryStatus::ok};
    return *std::ranges::min_element(hits, {}, &Answer::fraction);
}

RayQueryAnswer oracle_ray(const internal::QueryScene& scene, const WorldPos& from,
                          const WorldPos& to, const QueryFilter& filter) {
    std::vector<RayQueryAnswer> hits;  // bodies in ascending order, then the ground
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const ShapeRayAnswer ray = cast_ray(*body.shape, body.world_from_shape, from, to);
        if (!ray.hit) continue;
        hits.push_back(
            {QueryStatus::ok, true, ray.fraction, body.id, ray.point_world, ray.normal, ray.part});
    }
    if (filter.include_ground) {
        const RayAnswer ray = scene.ground->ray(from, to);
        if (ray.status == QueryStatus::ok) {
            hits.push_back(
                {QueryStatus::ok, true, ray.fraction, BodyId{}, ray.point_world, ray.normal, 0});
        }
    }
    return first_of(hits);
}

CastQueryAnswer oracle_cast(const internal::QueryScene& scene, const Shape& shape,
                            const Motion& motion, const QueryFilter& filter) {
    CastSettings settings{.skip_separating = true};
    std::vector<CastQueryAnswer> hits;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const PairCastAnswer met =
            cast(shape, motion, *body.shape, Motion{body.world_from_shape}, settings);
        if (!met.hit) continue;
        hits.push_back({QueryStatus::ok, true, met.fraction, body.id, met.contacts[0].point_world,
                        met.contacts[0].normal, met.contacts[0].part_b});
    }
    if (filter.include_ground) {
        const CastAnswer met = cast(shape, motion, *scene.ground, settings);
        if (met.hit) {
            hits.push_back({QueryStatus::ok, true, met.fraction, BodyId{}, met.contact.point_world,
                            met.contact.normal, 0});
        }
    }
    return first_of(hits);
}

std::vector<BodyId> oracle_overlaps(const internal::QueryScene& scene, const Shape& shape,
                                    const Pose& pose, const QueryFilter& filter) {
    std::vector<BodyId> touched;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        if (test_contact(shape, pose, *body.shape, body.world_from_shape).is_touching) {
            touched.push_back(body.id);
        }
    }
    return touched;
}

NearestQueryAnswer oracle_nearest(const internal::QueryScene& scene, const Shape& shape,
                                  const Pose& pose, double max_distance,
                                  const QueryFilter& filter) {
    std::vector<NearestQueryAnswer> found;
    for (const std::uint32_t i : seen_by(filter, scene)) {
        const internal::QueryBody& body = scene.bodies[i];
        const PairDistanceAnswer d =
            signed_distance(shape, pose, *body.shape, body.world_from_shape);
        found.push_back({QueryStatus::ok, true, body.id, d.distance, d.point_a_world,
                         d.point_b_world, d.normal, d.part_b});
    }
    if (filter.include_ground) {
        const DistanceAnswer d = signed_distance(shape, pose, *scene.ground, max_distance);
        if (d.has_ground) {
            found.push_back({QueryStatus::ok, true, BodyId{}, d.distance, d.point_world,
                             d.point_world - d.distance * d.normal, d.normal, 0});
        }
    }
    const auto least = std::ranges::min_element(found, {}, &NearestQueryAnswer::distance);
    if (least == found.end() || least->distance > max_distance) return {.status = QueryStatus::ok};
    return *least;
}

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
    /// Whether the answer of a ray or cast is the oracle's.
    template <class Answer>
    static void expect_same(const Answer& found, const Answer& expected) {
        EXPECT_EQ(found.status, expected.status);
        EXPECT_EQ(found.hit, expected.hit);
        EXPECT_EQ(found.fraction, expected.fraction);
        EXPECT_EQ(found.body, expected.body);
        EXPECT_EQ(found.point_world, expected.point_world);
        EXPECT_EQ(found.normal, expected.normal);
        EXPECT_EQ(found.part, expected.part);
        EXPECT_EQ(found.hits_ground(), expected.hit && expected.body == BodyId{});
    }
    /// With few bodies hardly any query hits one.
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
        expect_same(query_ray(scene.scene(), from, to, filter), expected);
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
        expect_same(query_cast(scene.scene(), shape, motion, filter), expected);
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
            EXPECT_EQ(found.status, is_whole ? QueryStatus::ok : QueryStatus::truncated);
            EXPECT_EQ(found.touching_count, expected.size());
            ASSERT_EQ(found.count, std::min(room, expected.size()));
            EXPECT_TRUE(std::ranges::equal(std::span(written).first(found.count),
                                           std::span(expected).first(found.count)));
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

/// The answers of all queries that follow from the seed.
class Answers {
public:
    void ask(const TestScene& scene, int count) {
        const internal::QueryScene read = scene.scene();
        for (int i = 0; i < count; ++i) {
            const Shape& shape = TestScene::any_shape(random_);
            const Pose pose = scene.any_near_pose(random_);
            const Motion motion = scene.any_motion(random_);
            const WorldPos to = scene.any_place(random_, 4.0);
            const QueryFilter filter = scene.any_filter(random_);
            const AllocationCounter counter(AllocationCounter::Of::this_thread);
            hash_.add(query_ray(read, pose.translation, to, filter).fraction);
            hash_.add(query_cast(read, shape, motion, filter).fraction);
            hash_.add(query_nearest(read, shape, pose, 5.0, filter).distance);
            hash_.add(query_overlaps(read, shape, pose, filter, bodies_).touching_count);
            for (const BodyId& body : bodies_) hash_.add(body.index);
            allocations_ += counter.count();
        }
    }
    std::uint64_t hash() const { return hash_.value(); }
    std::uint64_t allocations() const { return allocations_; }

private:
    Random random_{kSeed};
    std::array<BodyId, 4> bodies_{};
    Hash hash_;
    std::uint64_t allocations_ = 0;
};

TEST(QueryMemory, NoQueryAllocates) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    for (const SceneCase& c : scene_cases()) {
        SCOPED_TRACE(name_of(c));
        Random random(kSeed);
        const TestScene scene(random, c);
        Answers answers;
        answers.ask(scene, 10);
        EXPECT_EQ(answers.allocations(), 0u);
    }
}

TEST(QueryMemory, ThreadsThatAskAtOnceGetTheSameAnswers) {
    SeededRandom random(kSeed + 1);
    const TestScene scene(random, {Layout::spread, 200});
    Answers alone;
    alone.ask(scene, 25);
    std::vector<Answers> together(3);
    std::vector<std::thread> threads;
    for (Answers& answers : together) {
        threads.emplace_back([&scene, &answers] { answers.ask(scene, 25); });
    }
    for (std::thread& thread : threads) thread.join();
    for (const Answers& answers : together) EXPECT_EQ(answers.hash(), alone.hash());
}

}  // namespace terrane::world_queries_test
