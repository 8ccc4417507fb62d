// SPDX-License-Identifier: MIT
//
// Traces with deliberate faults, to test that the judge finds them.
#include "judge.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <sstream>

namespace judge {
namespace judge_test {

Surface make_surface(double (*height)(double, double)) {
    Surface surface;
    surface.west = surface.south = -16.0;
    for (std::int64_t row = 0; row <= 32; ++row) {
        for (std::int64_t column = 0; column <= 32; ++column) {
            surface.set_point(
                column, row,
                height(static_cast<double>(column) - 16.0, static_cast<double>(row) - 16.0));
        }
    }
    return surface;
}

double flat(double, double) { return 3.0; }
double ramp(double x, double) { return x; }
double spike(double x, double y) { return x == 0.0 && y == 0.0 ? 5.0 : 0.0; }
double wall(double x, double) { return x >= 0.0 ? 10.0 : 0.0; }

struct Placed {
    double x, y, z;
    double qw = 1.0, qx = 0.0, qy = 0.0, qz = 0.0;
};

Report judge_one(DropShape shape, double (*height)(double, double), const Placed& p) {
    char line[512];
    std::snprintf(line, sizeof line, "0,0,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", p.x, p.y,
                  p.z, p.qw, p.qx, p.qy, p.qz);
    std::istringstream trace(std::string("step,body,x,y,z,qw,qx,qy,qz\n") + line);
    return judge_trace(trace, make_surface(height), {.shape = shape});
}

/// A shape that touches a ground at a pose.
struct Touch {
    DropShape shape;
    double (*height)(double, double);
    Placed at;
};

// After a rotation of 90 degrees about y, x points down: the head of the hammer, the longest corner of the stone.
TEST(Judge, FindsABodyOfEveryShapeThatSankTwoCentimetres) {
    const double half = std::sqrt(0.5);
    const Touch touches[] = {{DropShape::sphere, flat, {0.3, 0.4, 3.5}},
                             {DropShape::capsule, flat, {0.3, 0.4, 4.2}},
                             {DropShape::box, flat, {0.3, 0.4, 3.5}},
                             {DropShape::hull, flat, {0.3, 0.4, 3.6}},
                             {DropShape::compound, flat, {0.3, 0.4, 3.3}},
                             {DropShape::capsule, flat, {0.0, 0.0, 3.4, half, half, 0.0, 0.0}},
                             {DropShape::hull, flat, {0.0, 0.0, 4.2, half, 0.0, half, 0.0}},
                             {DropShape::compound, flat, {0.0, 0.0, 4.3, half, 0.0, half, 0.0}},
                             {DropShape::box, spike, {0.1, 0.2, 5.5}}};
    for (std::size_t i = 0; i < std::size(touches); ++i) {
        SCOPED_TRACE(i);
        const auto sunk_by = [&](double depth) {
            Placed at = touches[i].at;
            at.z -= depth;
            return judge_one(touches[i].shape, touches[i].height, at);
        };
        EXPECT_EQ(sunk_by(0.0).too_deep, 0u);
        EXPECT_EQ(sunk_by(0.009).too_deep, 0u);
        const Report sunk = sunk_by(0.02);
        EXPECT_EQ(sunk.too_deep, 1u);
        EXPECT_NEAR(sunk.max_depth, 0.02, 1e-3);
        // the search of the depth of one far below is slow: once for each shape
        if (i < 5) {
            EXPECT_EQ(sunk_by(50.0).too_deep, 1u);
        }
    }
}

TEST(Judge, FindsASpikeThatPokesIntoASideOfAStone) {
    // above the tip of the spike, the face through three corners is about 3 / 7 m below the centre
    EXPECT_EQ(judge_one(DropShape::hull, spike, {-0.3, -0.3, 5.6}).too_deep, 0u);
    EXPECT_EQ(judge_one(DropShape::hull, spike, {-0.3, -0.3, 5.2}).too_deep, 1u);
}

TEST(Judge, MeasuresDepthAlongTheMinimumTranslationOutOfASlope) {
    // a vertical overlap of 20 cm is a depth of 14 cm along the normal of a 45 degree slope
    const double touch = 0.5 * std::sqrt(2.0);
    const Report report = judge_one(DropShape::sphere, ramp, {0.3, 0.2, 0.3 + touch - 0.2});
    EXPECT_NEAR(report.max_lift, 0.2, 1e-9);
    EXPECT_NEAR(report.max_depth, 0.2 * std::sqrt(0.5), 0.01);
}

TEST(Judge, FindsABodyInAWallThatItsCentreIsOutsideOf) {
    // The wall's foot is at x = -1; the sphere at mid height reaches it from x = -0.5 - 0.5 - small.
    EXPECT_EQ(judge_one(DropShape::sphere, wall, {-1.6, 0.2, 5.0}).too_deep, 0u);
    EXPECT_EQ(judge_one(DropShape::sphere, wall, {-0.9, 0.2, 5.0}).too_deep, 1u);
    EXPECT_EQ(judge_one(DropShape::box, wall, {-1.3, 0.2, 5.0}).too_deep, 1u);
}

TEST(Judge, CutsCellsAsTheParitySays) {
    // one cell with a high north-east corner: split towards it, the centre is at half its height
    Surface surface;
    for (int i = 0; i < 4; ++i) surface.set_point(i & 1, i >> 1, i == 3 ? 2.0 : 0.0);
    Body body;
    body.radius = 1e-6;
    body.centre = {0.5, 0.5, 0.5};
    const std::array parts{body};
    EXPECT_NEAR(compute_lift(parts, surface).value, 0.5, 1e-5);
    surface.parity = 1;
    EXPECT_EQ(compute_lift(parts, surface).value, 0.0);
}

TEST(Judge, SaysWhereGroundIsUnknownAndWhereATraceIsBroken) {
    EXPECT_EQ(judge_one(DropShape::sphere, flat, {40.0, 0.0, 9.0}).unjudged, 1u);
    for (const char* text : {"", "0,0,1,2,3,1,0,0\n", "0,0,nan,2,3,1,0,0,0\n",
                             "0,0,1,2,3,2,0,0,0\n", "0,-1,1,2,3,1,0,0,0\n"}) {
        std::istringstream trace(text);
        EXPECT_FALSE(judge_trace(trace, make_surface(flat), {}).error.empty()) << text;
    }
}

}  // namespace judge_test
}  // namespace judge
