// SPDX-License-Identifier: MIT
// No query allocates, and threads that ask at once get the same answers.
#include "support/allocation_counter.h"
#include "world_cases.h"

#include <gtest/gtest.h>

#include <thread>

namespace terrane {
namespace query_memory_test {

using namespace test;
using internal::QueryScene;

constexpr std::uint64_t kSeed = 20261127;

/// The answers of every query that a seed leads to.
class Answers {
public:
    explicit Answers(std::uint64_t seed) : random_(seed) {}

    void ask(const TestScene& scene, int count) {
        const QueryScene read = scene.scene();
        for (int i = 0; i < count; ++i) {
            const Shape& shape = TestScene::any_shape(random_);
            const Pose pose = scene.any_near_pose(random_);
            const Motion motion = scene.any_motion(random_);
            const WorldPos to = scene.any_place(random_, 4.0);
            const QueryFilter filter = scene.any_filter(random_);
            const AllocationCounter counter(AllocationCounter::Of::this_thread);
            add(query_ray(read, pose.translation, to, filter).fraction);
            add(query_cast(read, shape, motion, filter).fraction);
            add(query_nearest(read, shape, pose, 5.0, filter).distance);
            add(static_cast<double>(
                query_overlaps(read, shape, pose, filter, bodies_).touching_count));
            for (const BodyId& body : bodies_) add(static_cast<double>(body.index));
            allocations_ += counter.count();
        }
    }
    double sum() const { return sum_; }
    std::uint64_t allocations() const { return allocations_; }

private:
    void add(double value) { sum_ = 0.75 * sum_ + value; }

    Random random_;
    std::array<BodyId, 4> bodies_{};
    double sum_ = 0.0;
    std::uint64_t allocations_ = 0;
};

TEST(QueryMemory, NoQueryAllocates) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    for (const SceneCase& c : scene_cases()) {
        SCOPED_TRACE(name_of(c));
        Random random(kSeed);
        const TestScene scene(random, c);
        Answers answers(kSeed);
        answers.ask(scene, 10);
        EXPECT_EQ(answers.allocations(), 0u);
    }
}

TEST(QueryMemory, ThreadsThatAskAtOnceGetTheSameAnswers) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    const TestScene scene(random, {Layout::spread, 200});
    Answers alone(kSeed);
    alone.ask(scene, 25);
    std::vector<Answers> together(3, Answers(kSeed));
    std::vector<std::thread> threads;
    for (Answers& answers : together) {
        threads.emplace_back([&scene, &answers] { answers.ask(scene, 25); });
    }
    for (std::thread& thread : threads) thread.join();
    for (const Answers& answers : together) EXPECT_EQ(answers.sum(), alone.sum());
}

}  // namespace query_memory_test
}  // namespace terrane
