// SPDX-License-Identifier: MIT
#include "crowd/crowd.h"

#include <gtest/gtest.h>

#include <array>

namespace terrane::tools {
namespace crowd_test {

CrowdLayout layout_of(std::size_t count, BroadphaseKind kind) {
    CrowdLayout layout;
    layout.count = count;
    layout.broadphase = kind;
    return layout;
}

TEST(Crowd, EveryBroadphaseFindsTheSameTouchingPairs) {
    for (const double deviation : {0.0, 3.0}) {
        CrowdLayout layout = layout_of(300, BroadphaseKind::brute);
        layout.share = 0.1;
        layout.detail_deviation = deviation;
        Crowd expected(layout);
        layout.broadphase = BroadphaseKind::sap;
        Crowd sap(layout);
        layout.broadphase = BroadphaseKind::grid;
        Crowd grid(layout);
        layout.broadphase = BroadphaseKind::two_scene;
        Crowd two_scene(layout);
        std::size_t touching = 0;
        for (int step = 0; step < 40; ++step) {
            const CrowdQuery brute = expected.query();
            EXPECT_EQ(brute.candidates, 300u * 299u / 2u);
            touching += brute.touching;
            for (Crowd* crowd : {&sap, &grid, &two_scene}) {
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

TEST(Crowd, OneBodyTouchesNothing) {
    Crowd crowd(layout_of(1, BroadphaseKind::grid));
    for (int step = 0; step < 10; ++step) {
        const CrowdQuery query = crowd.query();
        EXPECT_EQ(query.pairs, 0u);
        EXPECT_EQ(query.touching, 0u);
        crowd.move(1e3);
    }
}

TEST(Crowd, HasTheCornerCountOfItsDetail) {
    CrowdLayout layout = layout_of(10, BroadphaseKind::sap);
    layout.detail = 5.0;
    layout.detail_deviation = 0.0;
    EXPECT_EQ(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
    layout.detail_deviation = 2.0;
    EXPECT_NE(Crowd(layout).corner_count(), 10u * (2u * 5u * 5u + 2u));
}

TEST(Crowd, BallsTouchAboutAsOftenAsProbabilitySays) {
    // two spheres of radius r in a volume V overlap with probability 32 / 3 pi r^3 / V; bodies of many corners are
    // nearly spheres
    CrowdLayout layout = layout_of(200, BroadphaseKind::grid);
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
