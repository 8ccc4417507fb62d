// SPDX-License-Identifier: MIT
// find() allocates only when it needs more memory than before: bodies on a closed path cause no allocation.
#include "paging/demand/contact_needs.h"
#include "support/allocation_counter.h"
#include "support/heights/wave_heights.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace terrane::internal {
namespace contact_needs_allocation_test {

TEST(Allocation, NeverHappensInContactNeedsOnARepeatedTrajectory) {
    constexpr std::uint64_t kSeed = 3;
    constexpr int kFramesARound = 120, kRounds = 4;
    test::Random random(kSeed);
    const test::WaveHeights source(test::small_world(6, 1.0), 10.0, 700.0);
    std::vector<BodyNeed> bodies(100);
    for (BodyNeed& body : bodies) {
        body.centre_world = {random.between(-3e3, 3e3), random.between(-3e3, 3e3), 5.0};
        body.velocity = {random.between(-200.0, 200.0), random.between(-200.0, 200.0), 0.0};
    }
    const RegionNeed region{{100.0, 100.0, 900.0, 900.0}, 3.0};
    ContactNeeds needs(source, source.lattice().finest_level);
    std::uint64_t count = 0;
    for (int frame = 0; frame < kRounds * kFramesARound; ++frame) {
        if (frame % (kFramesARound / 2) == 0) {
            for (BodyNeed& body : bodies) body.velocity = -body.velocity;
        }
        for (BodyNeed& body : bodies) body.centre_world += body.velocity / 60.0;
        const test::AllocationCounter counter;
        needs.find(bodies, {&region, 1}, frame / 60.0, 4.0);
        if (frame >= kFramesARound) count += counter.count();
        ASSERT_GT(needs.entries().size(), 500u);
    }
    EXPECT_EQ(count, 0u) << "seed " << kSeed;
}

}  // namespace contact_needs_allocation_test
}  // namespace terrane::internal
