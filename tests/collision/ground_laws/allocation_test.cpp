// SPDX-License-Identifier: MIT
// No query allocates memory.
#include "law_cases.h"
#include "support/allocation_counter.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

namespace terrane {
namespace allocation_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260309;

TEST(LawsOfMemory, NoQueryAllocates) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    std::array<Contact, 256> contacts;
    for (const LawScene& scene : law_scenes()) {
        for (const LawShape& shape : law_shapes()) {
            for (int i = 0; i < 20; ++i) {
                const Pose pose = random_pose(random, scene, shape, random.between(-2.0, 2.0));
                Motion motion;
                motion.start = pose;
                motion.translation = 50.0 * random.direction();
                motion.rotation_vector = random.direction();
                CastSettings skipping;
                skipping.skip_separating = true;
                const AllocationCounter counter;
                static_cast<void>(compute_lift(shape.shape, pose, scene.ground));
                static_cast<void>(test_contact(shape.shape, pose, scene.ground));
                static_cast<void>(pseudodistance(shape.shape, pose, scene.ground));
                static_cast<void>(signed_distance(shape.shape, pose, scene.ground, 3.0));
                static_cast<void>(find_contacts(shape.shape, pose, scene.ground, 0.1, contacts));
                static_cast<void>(cast(shape.shape, motion, scene.ground));
                static_cast<void>(cast(shape.shape, motion, scene.ground, skipping));
                ASSERT_EQ(counter.count(), 0u) << describe(scene, shape, pose);
            }
        }
    }
}

TEST(LawsOfMemory, TheCounterCounts) {
    if (!AllocationCounter::kCounts) GTEST_SKIP() << "this sanitizer replaces operator new";
    const AllocationCounter counter;
    const std::vector<double> some(3, 1.0);
    EXPECT_EQ(counter.count(), 1u) << some[0];
}

}  // namespace allocation_test
}  // namespace terrane
