// SPDX-License-Identifier: MIT
#include "culling/horizon_rows.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::internal::sectors_test {
namespace {

using test::Random;

TEST(Sectors, AzimuthIncreasesWithTheAngle) {
    double last = -1.0;
    for (int i = 0; i < 100'000; ++i) {
        const double angle = 2.0 * 3.14159265358979 * i / 100'000;
        const double azimuth = azimuth_of(std::cos(angle), std::sin(angle));
        ASSERT_GT(azimuth, last) << i;
        ASSERT_LE(azimuth, kSectors) << i;
        last = azimuth;
    }
    EXPECT_EQ(azimuth_of(2.0, 0.0), 0.0);
    EXPECT_EQ(azimuth_of(0.0, 2.0), kSectors / 4);
    EXPECT_EQ(azimuth_of(-2.0, 0.0), kSectors / 2);
    EXPECT_EQ(azimuth_of(0.0, -2.0), kSectors * 3 / 4);
}

// Whether a ray from the eye crosses a rectangle, by slabs.
bool meets(const EyeRect& rect, double x, double y) {
    double least = 0.0, most = std::numeric_limits<double>::infinity();
    const auto slab = [&](double d, double low, double high) {
        if (d == 0.0) {
            if (low > 0.0 || high < 0.0) most = -1.0;
            return;
        }
        least = std::max(least, std::min(low / d, high / d));
        most = std::min(most, std::max(low / d, high / d));
    };
    slab(x, rect.west, rect.east);
    slab(y, rect.south, rect.north);
    return least <= most;
}

TEST(Sectors, OfARectangleTouchAllOfItsDirectionsAndCoverNoOthers) {
    constexpr std::uint64_t kSeed = 5;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    int covered_count = 0;
    for (int i = 0; i < 3000; ++i) {
        const double size = std::exp2(random.between(-4.0, 6.0));
        EyeRect rect;
        rect.west = random.between(-50.0, 50.0);
        rect.south = random.below(8) == 0 ? 0.0 : random.between(-50.0, 50.0);
        rect.east = rect.west + size;
        rect.north = rect.south + size;
        if (rect.contains_eye()) continue;
        const SectorRange touched = rect.wedge().touched(), covered = rect.wedge().covered();
        covered_count += covered.count;
        ASSERT_LE(covered.count, touched.count);
        std::array<bool, kSectors> is_touched{}, is_covered{};
        touched.visit([&](std::size_t sector) { is_touched[sector] = true; });
        covered.visit([&](std::size_t sector) { is_covered[sector] = true; });
        for (int k = 0; k < 500; ++k) {
            // half of them towards the rectangle
            Eigen::Vector3d to = random.direction();
            if (k % 2 == 0)
                to = {random.between(rect.west, rect.east), random.between(rect.south, rect.north),
                      0.0};
            const auto sector = static_cast<std::size_t>(azimuth_of(to.x(), to.y())) % kSectors;
            const bool is_met = meets(rect, to.x(), to.y());
            ASSERT_TRUE(!is_met || is_touched[sector]) << i;
            ASSERT_TRUE(is_met || !is_covered[sector]) << i;
        }
    }
    EXPECT_GT(covered_count, 10'000);
}

TEST(Sectors, RangesAreDisjointWhereNoSectorIsInBoth) {
    Random random(9);
    for (int i = 0; i < 2000; ++i) {
        const SectorRange a{random.below(kSectors), 1 + random.below(kSectors / 2)};
        const SectorRange b{random.below(kSectors), 1 + random.below(kSectors)};
        std::array<bool, kSectors> in_a{};
        a.visit([&](std::size_t sector) { in_a[sector] = true; });
        bool is_disjoint = true;
        b.visit([&](std::size_t sector) { is_disjoint = is_disjoint && !in_a[sector]; });
        ASSERT_EQ(a.is_disjoint(b), is_disjoint) << i;
        ASSERT_EQ(b.is_disjoint(a), is_disjoint) << i;
    }
}

TEST(Sectors, RingsIncreaseWithTheDistanceAndBeginAtTheirBoundaries) {
    EXPECT_EQ(ring_of(0.0), 0);
    EXPECT_EQ(ring_of(std::nextafter(2.0, 0.0)), 0);
    EXPECT_EQ(ring_of(2.0), 1);
    EXPECT_EQ(ring_of(4.0), 1 + kRingsPerOctave);
    EXPECT_EQ(ring_of(std::nextafter(4.0, 0.0)), kRingsPerOctave);
    EXPECT_EQ(ring_of(131072.0), kRings - 1);
    EXPECT_EQ(ring_of(std::nextafter(131072.0, 0.0)), kRings - 2);
    EXPECT_EQ(ring_of(std::numeric_limits<double>::infinity()), kRings - 1);
    int last = 0;
    for (double distance = 0.5; distance < 1e6; distance *= 1.001) {
        ASSERT_GE(ring_of(distance), last);
        last = ring_of(distance);
    }
}

}  // namespace
}  // namespace terrane::internal::sectors_test
