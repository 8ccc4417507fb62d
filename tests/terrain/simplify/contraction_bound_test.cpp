// SPDX-License-Identifier: MIT
//
// The certified distance against dense samples of both surfaces and all triangles.
#include "support/meshes/shapes.h"
#include "support/random.h"

#include <terrane/terrain/simplify.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace terrane {
namespace contraction_bound_test {

using namespace test;

// Rounding of a measurement, of the size of the mesh.
constexpr double kMeasured = 1e-13;

double size_of(const ShapeMesh& mesh) {
    double size = 0.0;
    for (const Eigen::Vector3d& v : mesh.vertices) size = std::max(size, v.norm());
    return size;
}

// Measures every level of a mesh; returns the largest ratio of bound to distance among levels that changed it.
double expect_bounds(const ShapeMesh& mesh, const std::vector<std::uint8_t>& locked,
                     const std::vector<double>& errors, int per_edge) {
    std::vector<SimplifyLevel> levels;
    for (const double error_m : errors) levels.push_back({.error_m = error_m});
    const auto result = simplify({mesh.vertices, mesh.triangles, locked}, levels);
    EXPECT_TRUE(result) << result.error().message;
    double ratio = 0.0;
    for (std::size_t i = 0; result && i < levels.size(); ++i) {
        const SimplifiedMesh& level = result->at(i);
        const double measured =
            measured_distance(mesh.vertices, mesh.triangles, level.triangles, per_edge);
        EXPECT_LE(measured, level.error_m + kMeasured * size_of(mesh)) << "level " << i;
        EXPECT_LE(level.error_m, errors[i]) << "level " << i;
        if (measured > 1e-6) ratio = std::max(ratio, level.error_m / measured);
    }
    return ratio;
}

TEST(Simplify, BoundIsNotBelowTheMeasuredDistance) {
    double worst = 0.0;
    for (std::uint64_t seed = 100; seed < 160; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const int columns = 4 + random.below(10), rows = 4 + random.below(10);
        const double noise = random.between(0.0, 0.7), slope = random.between(0.0, 3.0);
        // Cells up to ten times as long as wide.
        const double stretch = random.between(1.0, 10.0);
        const Eigen::Matrix3d turn = random.rotation();
        const ShapeMesh mesh = make_grid(columns, rows, [&](int x, int y) -> Eigen::Vector3d {
            const double bend = slope * std::abs(x - columns / 2.0) + 0.1 * y * y;
            return turn * (Eigen::Vector3d(x, stretch * y, bend) + noise * random.direction());
        });
        std::vector<std::uint8_t> locked(mesh.vertices.size());
        if (seed % 3 == 0) {
            for (std::uint8_t& is : locked) is = random.below(4) == 0 ? 1 : 0;
        }
        worst = std::max(worst, expect_bounds(mesh, locked, {0.1, 0.3, 1.0, 3.0}, 6));
    }
    std::printf("bound over measured distance: at most %.2f\n", worst);
}

TEST(Simplify, BoundHoldsOnClosedSurfacesAndFarFromTheOrigin) {
    ShapeMesh mesh = make_sphere(10.0, 2);
    expect_bounds(mesh, {}, {0.1, 0.5, 2.0, 8.0}, 6);
    // Exact in doubles there, so that the distances are the same.
    for (Eigen::Vector3d& v : mesh.vertices) v = (v * 1024.0).array().round() / 1024.0;
    const SimplifyLevel level = {.error_m = 0.5};
    const auto near = simplify({mesh.vertices, mesh.triangles, {}}, {&level, 1}).value();
    ShapeMesh far = mesh;
    for (Eigen::Vector3d& v : far.vertices) v += Eigen::Vector3d(0x1p24, -0x1p25, 0x1p23);
    const auto moved = simplify({far.vertices, far.triangles, {}}, {&level, 1}).value();
    EXPECT_EQ(near[0].triangles, moved[0].triangles);
    EXPECT_EQ(near[0].error_m, moved[0].error_m);
}

TEST(Simplify, BoundHoldsForSliversAndFolds) {
    // Vertices of a fine grid pushed towards each other, as contours of volumes have them.
    for (std::uint64_t seed = 200; seed < 230; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const ShapeMesh mesh = make_grid(14, 14, [&](int x, int y) {
            const double dx = random.below(3) == 0 ? 0.999 : random.between(0.0, 0.5);
            const double dy = random.below(3) == 0 ? 0.999 : random.between(0.0, 0.5);
            return Eigen::Vector3d(x + dx, y + dy,
                                   std::sin(0.5 * (x + dx)) + 0.5 * std::cos(y + dy));
        });
        expect_bounds(mesh, {}, {0.05, 0.2, 1.0}, 6);
    }
}

}  // namespace contraction_bound_test
}  // namespace terrane
