// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "world/solver/pair_manifolds.h"

#include <terrane/collision/shape_pairs.h>

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace terrane::internal {
namespace separated_pairs_test {

TEST(SeparatedPairs, AreFartherApartThanTheReachWhileTheyAreClear) {
    constexpr std::uint64_t kSeed = 8;
    constexpr std::uint32_t kCount = 12;
    test::Random random(kSeed);
    const std::array<Shape, 3> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{0.6, 1.0, 0.3}}};
    std::vector<RigidBody> bodies(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        bodies[i].shape = &shapes[i % shapes.size()];
        bodies[i].radius = bounding_radius(shapes[i % shapes.size()]);
        bodies[i].pose.translation = 3.0 * random.direction();
        bodies[i].pose.rotation = random.rotation();
    }
    SeparatedPairs separated;
    int clear_count = 0, asked_count = 0;
    for (int step = 0; step < 200; ++step) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", step " + std::to_string(step));
        separated.begin(bodies);
        for (std::uint32_t a = 0; a < kCount; ++a) {
            for (std::uint32_t b = a + 1; b < kCount; ++b) {
                const double distance = signed_distance(*bodies[a].shape, bodies[a].pose,
                                                        *bodies[b].shape, bodies[b].pose)
                                            .distance;
                const double reach = random.between(0.0, 0.3);
                ++asked_count;
                if (separated.is_clear({a, b}, reach)) {
                    ++clear_count;
                    EXPECT_GT(distance, reach) << a << ", " << b;
                } else if (distance > reach) {
                    separated.add({a, b}, distance);
                }
            }
        }
        separated.end();
        for (RigidBody& body : bodies) {
            const bool is_placed = random.below(50) == 0;
            const double size = is_placed ? 3.0 : 0.01;
            const Motion motion{body.pose, size * random.direction(), 0.01 * random.direction()};
            body.pose = motion.at(1.0);
        }
    }
    EXPECT_GT(2 * clear_count, asked_count);
}

}  // namespace separated_pairs_test
}  // namespace terrane::internal
