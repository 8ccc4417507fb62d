// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/simplify.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <set>

namespace terrane::internal::triangle_distance_test {

using test::Random;
using Vector = Eigen::Matrix<long double, 3, 1>;

// The least distance to the edges, or to the plane if the foot point is inside the triangle, in long double.
long double oracle(const Eigen::Vector3d& point, const Corners& corners) {
    const Vector p = point.cast<long double>();
    const std::array<Vector, 3> c = {corners[0].cast<long double>(), corners[1].cast<long double>(),
                                     corners[2].cast<long double>()};
    long double least = std::numeric_limits<long double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector edge = c[(i + 1) % 3] - c[i];
        const long double square = edge.dot(edge);
        const long double t =
            square > 0 ? std::clamp<long double>((p - c[i]).dot(edge) / square, 0, 1) : 0;
        least = std::min(least, (p - c[i] - t * edge).norm());
    }
    const Vector normal = (c[1] - c[0]).cross(c[2] - c[0]);
    if (!(normal.norm() > 0)) return least;
    for (std::size_t i = 0; i < 3; ++i) {
        if (normal.dot((c[(i + 1) % 3] - c[i]).cross(p - c[i])) < 0) return least;
    }
    return std::min(least, std::abs(normal.dot(p - c[0])) / normal.norm());
}

// Triangles from equilateral shape to needles whose area is only rounding.
TEST(TriangleDistance, IsNotBelowTheDistanceAndNearIt) {
    Random random(31);
    for (int i = 0; i < 200'000; ++i) {
        const Eigen::Vector3d a = 10.0 * random.direction();
        const Eigen::Vector3d b = 10.0 * random.direction();
        const double share = random.between(-1.0, 2.0);
        const double shape = std::exp2(random.between(-60.0, 0.0));
        const Eigen::Vector3d c = a + share * (b - a) + 10.0 * shape * random.direction();
        const Corners triangle = {a, b, c};
        Eigen::Vector3d p = a + random.between(-3.0, 3.0) * (b - a);
        const double aside = random.between(0.0, 10.0) * std::exp2(random.between(-40.0, 0.0));
        p += aside * random.direction();
        const auto exact = static_cast<double>(oracle(p, triangle));
        const double answer = distance_to_triangle(p, triangle);
        const double size = std::max({(p - a).norm(), (b - a).norm(), (c - a).norm()});
        ASSERT_GE(answer, exact - 0x1p-48 * size) << i << " shape " << shape;
        // rounding at a ratio of 1e-9, and half the height of a needle that is treated as its edges
        ASSERT_LE(answer, exact + 0x1p-17 * size) << i << " shape " << shape;
    }
}

}  // namespace terrane::internal::triangle_distance_test

// What simplify() preserves and where it stops: topology, locked vertices, counts, degenerate and refused input.

namespace terrane::simplify_test {

using namespace test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SimplifiedMesh simplified(const ShapeMesh& mesh, const SimplifyLevel& level,
                          const std::vector<std::uint8_t>& locked = {}) {
    const auto result = simplify({mesh.vertices, mesh.triangles, locked}, {&level, 1});
    EXPECT_TRUE(result) << result.error().message;
    return result ? result->at(0) : SimplifiedMesh{};
}

std::string message_of(const SimplifyInput& input, const std::vector<SimplifyLevel>& levels) {
    const auto result = simplify(input, levels);
    if (result) return "no error";
    EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
    return result.error().message;
}

ShapeMesh plane(int columns, int rows) {
    return make_grid(columns, rows, [](int x, int y) { return Eigen::Vector3d(x, y, 0.0); });
}

std::vector<std::uint8_t> locked_outline(const ShapeMesh& mesh, double width, double height) {
    std::vector<std::uint8_t> locked;
    for (const Eigen::Vector3d& v : mesh.vertices) {
        const bool is_outline = v.x() == 0.0 || v.y() == 0.0 || v.x() == width || v.y() == height;
        locked.push_back(is_outline ? 1 : 0);
    }
    return locked;
}

double area(const ShapeMesh& mesh, const MeshTriangles& triangles) {
    double sum = 0.0;
    for (const auto& t : triangles) {
        const Eigen::Vector3d a = mesh.vertices[t[0]];
        sum += 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
    }
    return sum;
}

// Noisy grids with random locked vertices; half of them are rolled into a tube with two borders.
ShapeMesh rough_mesh(Random& random, bool is_tube) {
    const int columns = 6 + random.below(20), rows = 6 + random.below(20);
    const double noise = random.between(0.0, 0.4);
    ShapeMesh mesh = make_grid(columns, rows, [&](int x, int y) -> Eigen::Vector3d {
        const Eigen::Vector3d direction = random.direction();
        const Eigen::Vector3d shake = noise * direction;
        if (!is_tube) return Eigen::Vector3d(x, y, 2.0 * std::sin(0.4 * x)) + shake;
        const double angle = 2.0 * std::numbers::pi * (x % columns) / columns;
        const double r = columns / 5.0;
        return Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), y) + shake;
    });
    if (is_tube) {
        for (auto& t : mesh.triangles) {
            for (std::uint32_t& v : t) {
                const auto c = static_cast<std::uint32_t>(columns);
                if (v % (c + 1) == c) v -= c;
            }
        }
    }
    return mesh;
}

TEST(Simplify, KeepsClosedSurfacesClosedAndTheirGenus) {
    for (const ShapeMesh& mesh : {make_sphere(10.0, 3), make_torus(10.0, 3.0, 40, 12)}) {
        const EdgeCounts before = count_edges(mesh.triangles);
        ASSERT_EQ(before.border + before.other, 0u);
        const auto euler = [](const EdgeCounts& counts, std::size_t triangles) {
            return static_cast<int>(counts.vertices + triangles) - static_cast<int>(counts.inner);
        };
        std::size_t last = mesh.triangles.size();
        for (const double error_m : {0.15, 0.3, 1.0, 5.0, kInfinity}) {
            const SimplifiedMesh result = simplified(mesh, {.error_m = error_m});
            const EdgeCounts counts = count_edges(result.triangles);
            EXPECT_EQ(counts.border + counts.other, 0u) << error_m;
            EXPECT_EQ(euler(counts, result.triangles.size()), euler(before, mesh.triangles.size()));
            EXPECT_LT(result.triangles.size(), last) << error_m;
            EXPECT_LE(result.error_m, error_m);
            last = result.triangles.size();
        }
    }
}

TEST(Simplify, KeepsLockedVerticesAndManifoldEdgesOfRoughMeshes) {
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const ShapeMesh mesh = rough_mesh(random, seed % 2 == 1);
        std::vector<std::uint8_t> locked(mesh.vertices.size());
        for (std::uint8_t& is : locked) is = random.below(5) == 0 ? 1 : 0;
        std::set<std::uint32_t> used;
        for (const auto& t : mesh.triangles) used.insert(t.begin(), t.end());
        const SimplifiedMesh result =
            simplified(mesh, {.error_m = random.between(0.1, 3.0)}, locked);
        std::set<std::uint32_t> left;
        for (const auto& t : result.triangles) left.insert(t.begin(), t.end());
        for (const std::uint32_t v : used) {
            EXPECT_TRUE(locked[v] == 0 || left.contains(v)) << v;
        }
        EXPECT_LT(result.triangles.size(), mesh.triangles.size());
        EXPECT_EQ(count_edges(result.triangles).other, 0u);
    }
}

TEST(Simplify, LeavesTheLockedBorderOfAPlaneAloneWithNearlyAFan) {
    for (const int size : {5, 20, 40}) {
        const ShapeMesh mesh = plane(size, size);
        const auto border = static_cast<std::size_t>(4 * size);
        const SimplifiedMesh result =
            simplified(mesh, {.error_m = 1e-3}, locked_outline(mesh, size, size));
        // A polygon without inner vertices has two triangles fewer than corners; each inner vertex adds two.
        EXPECT_GE(result.triangles.size(), border - 2);
        EXPECT_LE(result.triangles.size(), border - 2 + border / 10);
        EXPECT_EQ(count_edges(result.triangles).border, border);
        EXPECT_EQ(result.stop, SimplifyStop::no_contraction);
        EXPECT_NEAR(area(mesh, result.triangles), size * size, 1e-9 * size * size);
    }
}

TEST(Simplify, LeavesTwoTrianglesOfAFreePlane) {
    for (const int size : {2, 7, 32}) {
        const ShapeMesh mesh = plane(size, size);
        const SimplifiedMesh result = simplified(mesh, {.error_m = 1e-3});
        EXPECT_LE(result.triangles.size(), 4u) << size;
        EXPECT_NEAR(area(mesh, result.triangles), size * size, 1e-9 * size * size);
        EXPECT_LE(result.error_m, 1e-6);
    }
}

TEST(Simplify, FollowsTheLawOfChordsOnASphere) {
    const double radius = 10.0;
    const ShapeMesh mesh = make_sphere(radius, 5);
    for (const double error_m : {0.05, 0.1, 0.2, 0.4}) {
        const SimplifiedMesh result = simplified(mesh, {.error_m = error_m});
        // For equilateral triangles with corners on the sphere, error = edge^2 / (6 radius).
        const double law = 16.0 * std::numbers::pi * radius / (6.0 * std::numbers::sqrt3 * error_m);
        EXPECT_GE(static_cast<double>(result.triangles.size()), 0.7 * law) << error_m;
        EXPECT_LE(static_cast<double>(result.triangles.size()), 3.5 * law) << error_m;
    }
}

TEST(Simplify, EndsEachLevelAtItsOwnLimitAndTheNextBeginsThere) {
    const ShapeMesh mesh = make_torus(10.0, 3.0, 60, 24);
    const std::vector<SimplifyLevel> levels = {
        {.triangles = 2000}, {.triangles = 1000}, {.triangles = 0, .error_m = kInfinity}};
    const auto result = simplify({mesh.vertices, mesh.triangles, {}}, levels).value();
    ASSERT_EQ(result.size(), 3u);
    // A contraction in the interior removes two triangles.
    EXPECT_EQ(result[0].triangles.size(), 2000u);
    EXPECT_EQ(result[1].triangles.size(), 1000u);
    EXPECT_EQ(result[0].stop, SimplifyStop::triangle_count);
    EXPECT_EQ(result[2].stop, SimplifyStop::no_contraction);
    EXPECT_LT(result[0].error_m, result[1].error_m);
    EXPECT_LT(result[1].error_m, result[2].error_m);

    const std::vector<SimplifyLevel> errors = {
        {.error_m = 0.0}, {.error_m = 0.1}, {.error_m = 0.5}};
    const auto by_error = simplify({mesh.vertices, mesh.triangles, {}}, errors).value();
    EXPECT_EQ(by_error[0].triangles, mesh.triangles);
    EXPECT_EQ(by_error[0].error_m, 0.0);
    for (const SimplifiedMesh& level : by_error) EXPECT_EQ(level.stop, SimplifyStop::error_limit);
    EXPECT_LE(by_error[1].error_m, 0.1);
    EXPECT_LE(by_error[2].error_m, 0.5);
    EXPECT_GT(by_error[1].triangles.size(), by_error[2].triangles.size());
    // The first of two levels equals that level on its own.
    EXPECT_EQ(by_error[1].triangles, simplified(mesh, errors[1]).triangles);
}

TEST(Simplify, KeepsDegenerateMeshesAsTheyAre) {
    EXPECT_TRUE(simplified({}, {}).triangles.empty());
    const ShapeMesh triangle = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
    EXPECT_EQ(simplified(triangle, {}).triangles, triangle.triangles);
    ShapeMesh point = triangle;
    for (Eigen::Vector3d& v : point.vertices) v.setZero();
    EXPECT_EQ(simplified(point, {}).triangles, point.triangles);
    const ShapeMesh tetrahedron = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                   {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
    EXPECT_EQ(simplified(tetrahedron, {}).triangles, tetrahedron.triangles);
    // Three triangles at an edge, two that share only a corner, and a duplicate triangle.
    const ShapeMesh fans = {
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {-1, 0, 0}, {-1, 1, 0}},
        {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 5, 6}, {0, 5, 6}}};
    EXPECT_EQ(simplified(fans, {}).triangles, fans.triangles);
}

TEST(Simplify, RemovesDuplicateVerticesAndTrianglesWithoutArea) {
    // Each column of vertices is duplicated at the same position, so that half of the triangles have no area.
    const ShapeMesh mesh = make_grid(
        20, 10, [](int x, int y) { return Eigen::Vector3d(x / 2, y, 0.3 * (x / 2) * (x / 2)); });
    const SimplifiedMesh result = simplified(mesh, {.error_m = 1e-3});
    for (const auto& t : result.triangles) {
        const Eigen::Vector3d a = mesh.vertices[t[0]];
        EXPECT_GT((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm(), 0.0);
    }
    EXPECT_LT(result.triangles.size(), mesh.triangles.size() / 4);
    EXPECT_LE(measured_distance(mesh.vertices, mesh.triangles, result.triangles, 4),
              result.error_m);
}

TEST(Simplify, KeepsEdgesOfThreeTrianglesAndSimplifiesBesideThem) {
    ShapeMesh mesh = plane(20, 20);
    // A fin along the middle row.
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int x = 0; x <= 20; ++x) mesh.vertices.emplace_back(x, 10.0, 1.0);
    for (std::uint32_t x = 0; x < 20; ++x) {
        const std::uint32_t a = 10 * 21 + x;
        mesh.triangles.push_back({a, a + 1, first + x});
        mesh.triangles.push_back({a + 1, first + x + 1, first + x});
    }
    const SimplifiedMesh result = simplified(mesh, {.error_m = 1e-3});
    std::set<std::uint32_t> left;
    for (const auto& t : result.triangles) left.insert(t.begin(), t.end());
    for (std::uint32_t x = 0; x <= 20; ++x) EXPECT_TRUE(left.contains(10 * 21 + x)) << x;
    EXPECT_LT(result.triangles.size(), mesh.triangles.size() / 5);
    EXPECT_EQ(count_edges(result.triangles).other, 20u);
}

TEST(Simplify, GivesTheSameBitsForTheSameMeshWithEveryCompiler) {
    // Uses no functions of the C library. An intended change of the algorithm changes the hash: copy the printed one
    // and add an entry to CHANGELOG.md.
    Random random(5);
    const ShapeMesh mesh = make_grid(60, 60, [&](int x, int y) {
        return Eigen::Vector3d(x, y, 0.002 * x * y + random.between(-0.3, 0.3));
    });
    const std::vector<SimplifyLevel> levels = {
        {.error_m = 0.2}, {.error_m = 0.6}, {.triangles = 100}};
    Hash hash;
    const auto result = simplify({mesh.vertices, mesh.triangles, {}}, levels).value();
    for (const SimplifiedMesh& level : result) {
        hash.add(level.error_m);
        hash.add_all(std::span<const std::array<std::uint32_t, 3>>(level.triangles));
    }
    EXPECT_EQ(hash.value(), 0xe2ffe58f8b02f641u) << std::hex << hash.value();
}

TEST(Simplify, RefusesInvalidInputWithOneMessage) {
    ShapeMesh mesh = plane(2, 2);
    const std::vector<SimplifyLevel> any = {{}};
    const auto input = [&]() -> SimplifyInput { return {mesh.vertices, mesh.triangles, {}}; };
    mesh.vertices[5].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message_of(input(), any), "coordinates must be within 2^38 m, got nan at vertex 5");
    mesh.vertices[5].y() = 1e300;
    EXPECT_EQ(message_of(input(), any),
              "coordinates must be within 2^38 m, got 1e+300 at vertex 5");
    mesh = plane(2, 2);
    mesh.triangles[3][1] = 9;
    EXPECT_EQ(message_of(input(), any), "triangle 3 names vertex 9 of 9");
    mesh.triangles[3] = {4, 2, 4};
    EXPECT_EQ(message_of(input(), any), "triangle 3 names vertex 4 twice");
    mesh = plane(2, 2);
    const std::vector<std::uint8_t> locked(3);
    EXPECT_EQ(message_of({mesh.vertices, mesh.triangles, locked}, any),
              "locked must have a value for each of 9 vertices, got 3");
    EXPECT_EQ(message_of(input(), {{.error_m = -1.0}}),
              "error_m must be at least 0, got -1 in level 0");
    EXPECT_EQ(message_of(input(), {{.error_m = std::numeric_limits<double>::quiet_NaN()}}),
              "error_m must be at least 0, got nan in level 0");
    EXPECT_EQ(message_of(input(), {{.error_m = 2.0}, {.error_m = 1.0}}),
              "error_m must not decrease, got 1 in level 1 after 2");
}

}  // namespace terrane::simplify_test

// The certified distance against dense samples of both surfaces, by brute force over all triangles.

namespace terrane::contraction_bound_test {

using namespace test;

// Rounding of a measurement relative to the size of the mesh.
constexpr double kMeasured = 1e-13;

double size_of(const ShapeMesh& mesh) {
    double size = 0.0;
    for (const Eigen::Vector3d& v : mesh.vertices) size = std::max(size, v.norm());
    return size;
}

// Checks the bound of every level; returns the largest ratio of bound to measured distance among changed levels.
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
        // Cells with an aspect ratio of up to ten.
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
    // Rounded so that the shifted coordinates are exact and the distances the same.
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
    // Vertices of a fine grid are pushed towards each other, as in contours of volumes.
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

}  // namespace terrane::contraction_bound_test
