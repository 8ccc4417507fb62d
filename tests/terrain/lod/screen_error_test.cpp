// SPDX-License-Identifier: MIT
#include "lod/screen_error.h"

#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::internal {
namespace screen_error_test {

constexpr std::uint64_t kSeed = 23;

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create(
               {.seed = 3, .octave_count = 10, .amplitude = 120.0, .wavelength_log2 = 10})
        .value();
}

std::shared_ptr<const HeightSource> flat_ground() {
    return FractalHeights::create({.amplitude = 0.0}).value();
}

WorldPos anywhere(test::Random& random, double size) {
    return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}

Result<View> any_view(test::Random& random) {
    const WorldPos eye = anywhere(random, 50.0);
    return look_at(eye, eye + anywhere(random, 1.0), 0.8, 640, 480);
}

ScreenError::Triangle any_triangle(test::Random& random, const WorldPos& around) {
    return {around + anywhere(random, 30.0), around + anywhere(random, 30.0),
            around + anywhere(random, 30.0)};
}

// Largest error of a deviation up or down by `bound` at a point, if the deviated point is in view.
double error_at(const WorldPos& point, double deviation, const View& view, const Frustum& frustum) {
    const Eigen::Vector3d from_eye = point + WorldPos(0.0, 0.0, deviation) - view.eye_world;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        if (normal.dot(from_eye) < 0.0) return 0.0;
    }
    return std::abs(deviation) * view.pixels_per_radian() /
           std::max(view.near_distance, from_eye.norm());
}

TEST(ScreenError, OfATriangleIsAboveThatOfEveryPointInView) {
    test::Random random(kSeed);
    const auto source = flat_ground();
    int seen = 0;
    for (int i = 0; i < 2000; ++i) {
        const Result<View> view = any_view(random);
        if (!view) continue;
        const Frustum frustum = make_frustum(*view);
        const ScreenError::Triangle triangle = any_triangle(random, view->eye_world);
        const double bound = random.between(0.0, 8.0);
        double most = 0.0;
        for (int k = 0; k < 200; ++k) {
            double u = random.between(0.0, 1.0), v = random.between(0.0, 1.0);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            const WorldPos point =
                triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
            most = std::max(most, error_at(point, random.between(-bound, bound), *view, frustum));
        }
        const ScreenError screen(*view, *source, 0.0);
        ASSERT_GE(screen.error_in_view(triangle, bound), most)
            << "triangle " << i << ", seed " << kSeed;
        seen += most > 0.0 ? 1 : 0;
    }
    EXPECT_GT(seen, 100);
}

TEST(ScreenError, OfATriangleIsNotAboveThatOfTheBoxAroundIt) {
    test::Random random(kSeed);
    const auto source = flat_ground();
    int smaller = 0;
    for (int i = 0; i < 2000; ++i) {
        const Result<View> view = any_view(random);
        if (!view) continue;
        const ScreenError::Triangle triangle = any_triangle(random, view->eye_world);
        const double bound = random.between(0.0, 8.0);
        const ScreenError screen(*view, *source, 0.0);
        const WorldPos up(0.0, 0.0, bound);
        const ScreenError::WorldBox box{
            triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]) - up,
            triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]) + up};
        const double of_triangle = screen.error_in_view(triangle, bound);
        const double of_box = screen.error_in_view(box, bound);
        ASSERT_LE(of_triangle, of_box * (1.0 + 1e-6)) << i << ", seed " << kSeed;
        smaller += of_triangle < 0.9 * of_box ? 1 : 0;
    }
    EXPECT_GT(smaller, 100);
}

// Number of eyes over a ground with a clearance that is not small.
int check_clearances(const HeightSource& source, double most_over) {
    test::Random random(kSeed);
    int useful = 0;
    for (int i = 0; i < 50; ++i) {
        const double x = random.between(-500.0, 500.0), y = random.between(-500.0, 500.0);
        const WorldPos eye(x, y, source.height(x, y) + random.between(-5.0, most_over));
        const double clearance = clearance_of(source, eye);
        double distance = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 4000; ++k) {
            const double reach = std::ldexp(256.0, -random.below(10));
            const double to_x = x + random.between(-reach, reach);
            const double to_y = y + random.between(-reach, reach);
            const WorldPos ground(to_x, to_y, source.height(to_x, to_y));
            distance = std::min(distance, (ground - eye).norm());
        }
        EXPECT_LE(clearance, distance) << "eye " << i << ", seed " << kSeed;
        useful += clearance > 0.2 * distance ? 1 : 0;
    }
    return useful;
}

TEST(Clearance, IsBelowTheDistanceToEveryPointOfTheGround) {
    EXPECT_GT(check_clearances(*hills(), 200.0), 25);
    // walls beside the eye are nearer than the ground below
    const auto walls = FractalHeights::create(
                           {.seed = 4, .octave_count = 4, .amplitude = 300.0, .wavelength_log2 = 6})
                           .value();
    check_clearances(*walls, 100.0);
}

TEST(Clearance, IsZeroBelowTheGround) {
    const auto source = hills();
    EXPECT_EQ(clearance_of(*source, {10.0, 20.0, source->height(10.0, 20.0)}), 0.0);
    EXPECT_GE(clearance_of(*source, {10.0, 20.0, -1e7}), 0.0);
}

}  // namespace screen_error_test
}  // namespace terrane::internal
