// SPDX-License-Identifier: MIT
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/scene/mesh_clusters.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>

namespace terrane::test::scene {
namespace mesh_clusters_test {

using Triangle = TriangleMesh::Triangle;
using Integers = std::array<std::int64_t, 3>;

// Coordinates are whole numbers of this many metres, so that 64-bit integers decide facing exactly.
constexpr double kUnit = 0x1p-16;

Eigen::Vector3d metres(const Integers& p) {
    return kUnit * Eigen::Vector3d(static_cast<double>(p[0]), static_cast<double>(p[1]),
                                   static_cast<double>(p[2]));
}
Integers units(const Eigen::Vector3d& p) {
    return {std::llround(p[0] / kUnit), std::llround(p[1] / kUnit), std::llround(p[2] / kUnit)};
}
Integers minus(const Integers& a, const Integers& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

// Whether the eye is in front of a triangle, or behind it where the mesh is mirrored. Exact where differences are below
// 2^19 and, to the eye, 2^22 units.
bool is_front_facing(const Integers& a, const Integers& b, const Integers& c, const Integers& eye,
                     bool is_mirrored) {
    const Integers u = minus(b, a), v = minus(c, a), e = minus(eye, a);
    const std::int64_t height = (u[1] * v[2] - u[2] * v[1]) * e[0] +
                                (u[2] * v[0] - u[0] * v[2]) * e[1] +
                                (u[0] * v[1] - u[1] * v[0]) * e[2];
    return is_mirrored ? height < 0 : height > 0;
}

struct IntegerMesh {
    std::vector<Integers> points;
    std::vector<Triangle> triangles;

    std::vector<Eigen::Vector3d> positions() const {
        std::vector<Eigen::Vector3d> made;
        for (const Integers& p : points) made.push_back(metres(p));
        return made;
    }
};

// A rock, a rock with holes, or loose triangles; some needles and triangles without area among them.
IntegerMesh random_mesh(Random& random) {
    IntegerMesh mesh;
    const int kind = random.below(3);
    if (kind < 2) {
        const TriangleMesh rock = make_rock(1 + random.below(3), random.bits());
        for (const Eigen::Vector3d& p : rock.positions) mesh.points.push_back(units(p));
        for (const Triangle& t : rock.triangles) {
            if (kind == 0 || random.below(4) > 0) mesh.triangles.push_back(t);
        }
    } else {
        const double size = std::ldexp(1.0, -random.below(12));
        for (std::uint32_t i = 0; i < 300; ++i) {
            const Eigen::Vector3d place = random.direction();
            for (int corner = 0; corner < 3; ++corner)
                mesh.points.push_back(units(place + size * random.direction()));
            mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
        }
    }
    for (int i = random.below(4); i > 0; --i) {
        Triangle& t = mesh.triangles[static_cast<std::size_t>(
            random.below(static_cast<int>(mesh.triangles.size())))];
        if (random.below(2) == 0) {
            t[1] = t[0];
        } else {  // a needle
            Integers middle = mesh.points[t[0]];
            for (std::size_t axis = 0; axis < 3; ++axis)
                middle[axis] = (middle[axis] + mesh.points[t[1]][axis]) / 2;
            t[2] = static_cast<std::uint32_t>(mesh.points.size());
            mesh.points.push_back(middle);
        }
    }
    return mesh;
}

// Far, near, inside, or on the plane of a triangle and a unit beside it.
Integers random_eye(const IntegerMesh& mesh, Random& random) {
    if (random.below(3) > 0)
        return units(std::ldexp(1.0, random.below(8) - 3) * random.between(0.5, 1.0) *
                     random.direction());
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(
        random.below(static_cast<int>(mesh.triangles.size())))];
    Integers eye = mesh.points[t[0]];
    for (const std::uint32_t corner : {t[1], t[2]}) {
        const int times = random.below(9) - 4;
        for (std::size_t axis = 0; axis < 3; ++axis)
            eye[axis] += times * (mesh.points[corner][axis] - mesh.points[t[0]][axis]);
    }
    for (std::int64_t& coordinate : eye) coordinate += random.below(3) - 1;
    return eye;
}

std::vector<bool> kept_triangles(const MeshClusters& clusters, const FacingView& view) {
    std::vector<bool> kept(clusters.order().size(), false);
    std::vector<TriangleRun> runs;
    clusters.find_front_facing(view, runs);
    std::uint32_t end = 0;
    for (const auto& [first, count] : runs) {
        EXPECT_TRUE(count > 0 && (first > end || (first == 0 && end == 0)));
        end = first + count;
        for (const std::uint32_t i : clusters.order().subspan(first, count)) kept[i] = true;
    }
    return kept;
}

TEST(MeshClusters, NeverLeaveOutATriangleThatFacesTheEyeWhereItsVerticesMoveWithinTheErrors) {
    constexpr std::uint64_t kSeed = 22;
    Random random(kSeed);
    std::size_t culled = 0, turned = 0;
    std::size_t exact_culled = 0, exact_back = 0;  // where the errors are 0
    for (int round = 0; round < 300; ++round) {
        const IntegerMesh mesh = random_mesh(random);
        const std::uint32_t size = 1 + static_cast<std::uint32_t>(random.below(64));
        const MeshClusters clusters =
            MeshClusters::create(mesh.positions(), mesh.triangles, size).value();
        for (int i = 0; i < 20; ++i) {
            const Integers eye = random_eye(mesh, random);
            const FacingView view = {
                .eye_mesh = metres(eye),
                .vertex_error = std::ldexp(random.below(2), -3 - random.below(12)),
                .angle_error = std::ldexp(random.below(2), -4 - random.below(10)),
                .is_mirrored = random.below(2) == 0};
            const std::vector<bool> kept = kept_triangles(clusters, view);
            // Moves a corner, half of the times to where the triangle turns most towards the eye.
            const auto moved = [&](const Integers& p, const Integers& next, const Integers& last) {
                // less than the errors by the rounding to units
                const double most = view.vertex_error +
                                    view.angle_error * (metres(p) - view.eye_mesh).norm() - kUnit;
                if (!(most > 0.0)) return p;
                const Eigen::Vector3d turning =
                    (view.is_mirrored ? -1.0 : 1.0) *
                    metres(minus(last, eye)).cross(metres(minus(next, eye)));
                const bool is_worst = random.below(2) == 0 && turning.norm() > 0.0;
                return units(metres(p) +
                             most * (is_worst ? turning.normalized() : random.direction()));
            };
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                const auto [a, b, c] = mesh.triangles[t];
                const Integers &pa = mesh.points[a], &pb = mesh.points[b], &pc = mesh.points[c];
                if (a == b || pa == pb || pb == pc || pc == pa) continue;  // never drawn
                const bool was_front = is_front_facing(pa, pb, pc, eye, view.is_mirrored);
                const bool is_front = is_front_facing(moved(pa, pb, pc), moved(pb, pc, pa),
                                                      moved(pc, pa, pb), eye, view.is_mirrored);
                ASSERT_TRUE(kept[t] || !is_front)
                    << "triangle " << t << ", round " << round << "." << i << ", seed " << kSeed;
                turned += is_front && !was_front ? 1u : 0u;
                culled += kept[t] ? 0u : 1u;
                if (view.vertex_error > 0.0 || view.angle_error > 0.0) continue;
                exact_culled += kept[t] ? 0u : 1u;
                exact_back += was_front ? 0u : 1u;
            }
        }
    }
    EXPECT_GT(culled, 50'000u);
    EXPECT_GT(turned, 50'000u);
    EXPECT_GT(exact_culled, exact_back / 4);
}

TEST(MeshClusters, AreAPartitionWithBoundsOfPlacesAndNormals) {
    Random random(23);
    int in_cones = 0;
    for (int round = 0; round < 100; ++round) {
        const IntegerMesh mesh = random_mesh(random);
        const std::vector<Eigen::Vector3d> positions = mesh.positions();
        const std::uint32_t size = 1 + static_cast<std::uint32_t>(random.below(100));
        const MeshClusters made = MeshClusters::create(positions, mesh.triangles, size).value();
        std::vector<std::uint32_t> sorted(made.order().begin(), made.order().end());
        std::sort(sorted.begin(), sorted.end());
        std::vector<std::uint32_t> all(mesh.triangles.size());
        std::iota(all.begin(), all.end(), 0u);
        ASSERT_EQ(sorted, all);
        std::uint32_t end = 0;
        for (const MeshCluster& cluster : made.clusters()) {
            const auto& [first, count] = cluster.triangles;
            ASSERT_EQ(first, end);
            ASSERT_TRUE(count >= 1 && count <= size);
            end += count;
            const auto triangles = made.order().subspan(first, count);
            ASSERT_TRUE(std::is_sorted(triangles.begin(), triangles.end()));
            for (const std::uint32_t t : triangles) {
                const auto [a, b, c] = mesh.triangles[t];
                for (const std::uint32_t corner : {a, b, c})
                    ASSERT_LE((positions[corner] - cluster.bounds.centre).norm(),
                              cluster.bounds.radius);
                if (cluster.cosine == 0.0) continue;
                ++in_cones;
                const Eigen::Vector3d normal =
                    (positions[b] - positions[a]).cross(positions[c] - positions[a]).normalized();
                ASSERT_GE(normal.dot(cluster.axis), cluster.cosine);
            }
        }
        ASSERT_EQ(end, mesh.triangles.size());
    }
    EXPECT_GT(in_cones, 1000);
}

TEST(MeshClusters, KeepTheOrderOfTrianglesAtOnePlace) {
    const std::vector<Eigen::Vector3d> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Triangle> triangles(500, Triangle{0, 1, 2});
    const MeshClusters made = MeshClusters::create(positions, triangles, 64).value();
    EXPECT_TRUE(std::is_sorted(made.order().begin(), made.order().end()));
    EXPECT_EQ(made.clusters().size(), 8u);
    std::vector<TriangleRun> runs;
    made.find_front_facing({.eye_mesh = {0, 0, -1}}, runs);
    EXPECT_TRUE(runs.empty());
    made.find_front_facing({.eye_mesh = {0, 0, 1}}, runs);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_EQ(runs[0].count, 500u);
}

TEST(MeshClusters, LeaveOutALargeShareOfAClosedMesh) {
    const TriangleMesh rock = make_rock(4, 5);
    const MeshClusters clusters = MeshClusters::create(rock.positions, rock.triangles).value();
    Random random(24);
    std::size_t kept = 0;
    std::vector<TriangleRun> runs;
    for (int i = 0; i < 100; ++i) {
        clusters.find_front_facing({.eye_mesh = 4.0 * random.direction()}, runs);
        for (const TriangleRun& run : runs) kept += run.count;
    }
    EXPECT_LT(kept, 55 * rock.triangles.size());  // of 100 views; 42 % face the eye
}

TEST(MeshClusters, KeepEverythingForNumbersThatAreNotFiniteAndNegativeErrors) {
    const TriangleMesh rock = make_rock(3, 5);
    const MeshClusters clusters = MeshClusters::create(rock.positions, rock.triangles).value();
    const auto kept = [&](const FacingView& view) {
        std::vector<TriangleRun> runs;
        clusters.find_front_facing(view, runs);
        return runs.size() == 1 && runs[0].count == rock.triangles.size();
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(kept({.eye_mesh = {5, 0, 0}}));
    EXPECT_FALSE(kept({.eye_mesh = {1e100, 0, 0}}));
    for (const double bad : {nan, infinity, -infinity}) {
        EXPECT_TRUE(kept({.eye_mesh = {5, bad, 0}}));
        EXPECT_TRUE(kept({.eye_mesh = {5, bad, 0}, .is_mirrored = true}));
    }
    for (const double bad : {nan, infinity, -1.0, -1e-300}) {
        EXPECT_TRUE(kept({.eye_mesh = {5, 0, 0}, .vertex_error = bad}));
        EXPECT_TRUE(kept({.eye_mesh = {5, 0, 0}, .angle_error = bad}));
    }
}

TEST(MeshClusters, RefuseWhatTheyCannotSplitByItsName) {
    const std::vector<Eigen::Vector3d> corner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Triangle> one = {{0, 1, 2}};
    const auto message = [&](const std::vector<Eigen::Vector3d>& positions,
                             const std::vector<Triangle>& triangles, std::uint32_t size) {
        const Result<MeshClusters> made = MeshClusters::create(positions, triangles, size);
        return made ? std::string() : made.error().message;
    };
    EXPECT_EQ(message(corner, one, 1), "");
    EXPECT_EQ(message({}, {}, 64), "");
    EXPECT_EQ(message(corner, one, 0), "cluster_size must be at least 1, got 0");
    EXPECT_EQ(message(corner, {{0, 1, 3}}, 64), "triangle 0 names vertex 3 of 3");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message({{0, 0, 0}, {1, nan, 0}, {0, 1, 0}}, one, 64),
              "coordinates must be within 1e+06 m, got nan at vertex 1");
    EXPECT_EQ(message({{0, 0, 0}, {1, 0, -2e6}, {0, 1, 0}}, one, 64),
              "coordinates must be within 1e+06 m, got -2e+06 at vertex 1");
    // as small and as large as coordinates can be
    for (const double size : {5e-324, 1e-160, 1e-80, 1e6}) {
        const std::vector<Eigen::Vector3d> scaled = {size * corner[0], size * corner[1],
                                                     size * corner[2]};
        const MeshClusters made = MeshClusters::create(scaled, one).value();
        EXPECT_TRUE(can_face(made.clusters()[0], {.eye_mesh = {0, 0, 1}})) << size;
    }
}

}  // namespace mesh_clusters_test
}  // namespace terrane::test::scene
