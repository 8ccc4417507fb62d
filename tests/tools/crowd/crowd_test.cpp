// SPDX-License-Identifier: MIT
#include "lab/crowd.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace crowd_test {

CrowdLayout layout_of(std::size_t count, CrowdScheme scheme) {
    CrowdLayout layout;
    layout.count = count;
    layout.scheme = scheme;
    return layout;
}

TEST(Crowd, EveryBroadphaseFindsTheSameTouchingPairs) {
    for (const double deviation : {0.0, 3.0}) {
        CrowdLayout layout = layout_of(300, CrowdScheme::brute);
        layout.share = 0.1;
        layout.detail_deviation = deviation;
        Crowd expected(layout);
        layout.scheme = CrowdScheme::sap;
        Crowd sap(layout);
        layout.scheme = CrowdScheme::grid;
        Crowd grid(layout);
        layout.scheme = CrowdScheme::two_scene;
        Crowd two_scene(layout);
        layout.scheme = CrowdScheme::hashed;
        Crowd hashed(layout);
        layout.scheme = CrowdScheme::dense;
        Crowd dense(layout);
        std::size_t touching = 0;
        for (int step = 0; step < 40; ++step) {
            const CrowdQuery brute = expected.query();
            EXPECT_EQ(brute.candidates, 300u * 299u / 2u);
            touching += brute.touching;
            for (Crowd* crowd : {&sap, &grid, &two_scene, &hashed, &dense}) {
                const CrowdQuery query = crowd->query();
                ASSERT_EQ(query.pairs, brute.pairs) << step;
                ASSERT_EQ(query.touching, brute.touching) << step;
                ASSERT_LT(query.candidates, brute.candidates / 4);
                crowd->move(0.3);
            }
            expected.move(0.3);
        }
        EXPECT_GT(touching, 1000u);
    }
}

TEST(Crowd, EverySchemeFindsTheSamePairsOfAnySizeAndAspect) {
    using Sizes = std::pair<double, double>;  // spread and power
    for (const auto& [spread, power] : {Sizes(1.0, 0.0), Sizes(100.0, 0.0), Sizes(100.0, 2.5)}) {
        for (const double aspect : {1.0, 100.0}) {
            CrowdLayout layout = layout_of(200, CrowdScheme::brute);
            layout.share = 0.2;
            layout.size_spread = spread;
            layout.size_power = power;
            layout.aspect = aspect;
            Crowd expected(layout);
            std::vector<Crowd> crowds;
            for (const CrowdScheme scheme :
                 {CrowdScheme::sap, CrowdScheme::grid, CrowdScheme::two_scene, CrowdScheme::hashed,
                  CrowdScheme::dense}) {
                layout.scheme = scheme;
                crowds.emplace_back(layout);
            }
            std::size_t pairs = 0;
            for (int step = 0; step < 10; ++step) {
                const CrowdQuery brute = expected.query();
                pairs += brute.pairs;
                for (Crowd& crowd : crowds) {
                    const CrowdQuery query = crowd.query();
                    ASSERT_EQ(query.pairs, brute.pairs)
                        << spread << " " << power << " " << aspect << " " << step;
                    ASSERT_EQ(query.touching, brute.touching)
                        << spread << " " << power << " " << aspect << " " << step;
                    crowd.move(0.3);
                }
                expected.move(0.3);
            }
            EXPECT_GT(pairs, 100u);
        }
    }
}

TEST(Crowd, TwoScenesComputeBoxesOfPairsOfCubesOnly) {
    CrowdLayout layout = layout_of(20, CrowdScheme::two_scene);
    layout.room = 80.0;
    Crowd crowd(layout);
    std::size_t boxes = 0;
    for (int step = 0; step < 100; ++step) {
        const CrowdQuery query = crowd.query();
        EXPECT_LE(query.pairs, query.boxes);
        boxes += query.boxes;
        crowd.move(1.0);
    }
    EXPECT_GT(boxes, 0u);
    EXPECT_LT(boxes, 100u * 20u / 4u);
}

TEST(Crowd, StaysInARoomOfTheWidthAskedFor) {
    CrowdLayout layout = layout_of(5, CrowdScheme::sap);
    layout.room = 80.0;
    EXPECT_EQ(Crowd(layout).width(), 80.0);
    // no narrower than its largest body
    layout.room = 1.0;
    EXPECT_EQ(Crowd(layout).width(), 2.0);
}

TEST(Crowd, HasSizesOfItsPower) {
    // the room's volume is that of all spheres over the share: compares the mean cube of the radii
    for (const double power : {0.0, 1.0, 2.5}) {
        CrowdLayout layout = layout_of(20'000, CrowdScheme::hashed);
        layout.size_spread = 9.0;
        layout.size_power = power;
        double weights = 0.0, cubes = 0.0;
        for (int size = 0; size < 100; ++size) {
            const double radius = std::pow(9.0, size / 99.0 - 0.5);
            weights += std::pow(radius, -power);
            cubes += std::pow(radius, 3.0 - power);
        }
        const double volume =
            4.0 / 3.0 * std::numbers::pi * 20'000.0 * cubes / weights / layout.share;
        EXPECT_NEAR(std::pow(Crowd(layout).width(), 3.0) / volume, 1.0, 0.05) << power;
    }
}

TEST(Crowd, DentedBodiesTouchLessOftenThanConvexOnes) {
    CrowdLayout layout = layout_of(60, CrowdScheme::hashed);
    layout.share = 0.2;
    layout.detail = 4.0;
    layout.detail_deviation = 0.0;
    Crowd convex(layout);
    layout.is_dented = true;
    Crowd dented(layout);
    EXPECT_EQ(dented.corner_count(), convex.corner_count());
    std::size_t of_convex = 0, of_dented = 0;
    for (int step = 0; step < 20; ++step) {
        of_convex += convex.query().touching;
        of_dented += dented.query().touching;
        convex.move(0.5);
        dented.move(0.5);
    }
    EXPECT_GT(of_dented, 0u);
    EXPECT_LT(of_dented, of_convex);
}

TEST(Crowd, OneBodyTouchesNothing) {
    Crowd crowd(layout_of(1, CrowdScheme::grid));
    for (int step = 0; step < 10; ++step) {
        const CrowdQuery query = crowd.query();
        EXPECT_EQ(query.pairs, 0u);
        EXPECT_EQ(query.touching, 0u);
        crowd.move(1e3);
    }
}

TEST(Crowd, HasTheCornerCountOfItsDetail) {
    CrowdLayout layout = layout_of(10, CrowdScheme::sap);
    layout.detail = 5.0;
    layout.detail_deviation = 0.0;
    EXPECT_EQ(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
    layout.detail_deviation = 2.0;
    EXPECT_NE(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
}

TEST(Crowd, BallsTouchAboutAsOftenAsProbabilitySays) {
    // two spheres of radius r in a volume V overlap with probability 32 / 3 pi r^3 / V; bodies of many corners are
    // nearly spheres
    CrowdLayout layout = layout_of(200, CrowdScheme::grid);
    layout.detail = 20.0;
    layout.detail_deviation = 0.0;
    Crowd crowd(layout);
    double touching = 0.0;
    constexpr int kSteps = 60;
    for (int step = 0; step < kSteps; ++step) {
        touching += static_cast<double>(crowd.query().touching);
        crowd.move(5.0);
    }
    // n^2 / 2 pairs times 8 times the share of a sphere, share / n
    const double expected = 4.0 * 200.0 * layout.share;
    // the walls confine centres to less than the room
    EXPECT_GT(touching / kSteps, expected);
    EXPECT_LT(touching / kSteps, 2.0 * expected);
}

}  // namespace crowd_test
}  // namespace terrane::tools
