// SPDX-License-Identifier: MIT
#include "light/frame_uniforms.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::internal {
namespace eye_frame_test {

TEST(SplitInteger, RecombinesExactlyAndKeepsSmallNumbersInTheLowPart) {
    constexpr std::uint64_t kSeed = 11;
    test::Random random(kSeed);
    for (int i = 0; i < 10'000; ++i) {
        const std::int64_t value = static_cast<std::int64_t>(random.bits()) >> (14 + i % 50);
        const SplitInteger parts = split(value, kIndexBits);
        ASSERT_EQ(std::int64_t{parts.high} * (1 << kIndexBits) + parts.low, value) << kSeed;
        ASSERT_LT(std::abs(parts.low), (1 << (kIndexBits - 1)) + 1);
        if (std::abs(value) < (1 << (kIndexBits - 1))) {
            ASSERT_EQ(parts.high, 0) << value;
        }
    }
}

TEST(EyeFrame, LeavesLessThanAStepAndLosesNothingFarFromTheOrigin) {
    constexpr std::uint64_t kSeed = 12;
    test::Random random(kSeed);
    Lattice lattice;
    lattice.origin_x = -17.25;
    lattice.origin_y = 3.5;
    lattice.spacing = 0.75;
    for (int i = 0; i < 1000; ++i) {
        const WorldPos eye(random.between(-1e7, 1e7), random.between(-1e7, 1e7),
                           random.between(-1e5, 1e5));
        const Result<EyeFrame> frame = make_eye_frame(lattice, eye);
        ASSERT_TRUE(frame);
        EXPECT_LE(std::abs(frame->remainder_x), 0.3751) << kSeed;
        EXPECT_LE(std::abs(frame->remainder_y), 0.3751);
        EXPECT_LE(std::abs(frame->remainder_z), 0.51 * lattice.quantum);
        EXPECT_NEAR(lattice.x(frame->x) + frame->remainder_x, eye.x(), 1e-8);
        EXPECT_NEAR(lattice.y(frame->y) + frame->remainder_y, eye.y(), 1e-8);
    }
}

TEST(EyeFrame, RefusesAnEyeWhoseIntegersDoNotFit) {
    const Lattice lattice;
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double far : {1e300, -1e300, infinity, std::nan("")}) {
        EXPECT_FALSE(make_eye_frame(lattice, {far, 0.0, 0.0}));
        EXPECT_FALSE(make_eye_frame(lattice, {0.0, far, 0.0}));
        EXPECT_FALSE(make_eye_frame(lattice, {0.0, 0.0, far}));
    }
}

}  // namespace eye_frame_test
}  // namespace terrane::internal
