// SPDX-License-Identifier: MIT
//
// Levels of a ProgressiveMesh do not depend on the level they are reached from and are within their certified distance,
// for meshes of any topology.
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <thread>
#include <vector>

namespace terrane::progressive_mesh_test {

using namespace test;
using Triangles = std::vector<TriangleMesh::Triangle>;

TriangleMesh mesh_of(const ShapeMesh& shape) {
    TriangleMesh mesh;
    mesh.positions = shape.vertices;
    mesh.triangles = shape.triangles;
    return mesh;
}

ProgressiveMesh make(const TriangleMesh& mesh, const ProgressiveSettings& settings = {}) {
    return ProgressiveMesh::create(mesh, settings).value();
}

Triangles triangles_of(const ProgressiveMesh& mesh) {
    return {mesh.triangles().begin(), mesh.triangles().end()};
}

TriangleMesh rough_terrain(std::uint64_t seed, int side) {
    Random random(seed);
    return mesh_of(make_grid(side, side, [&](int x, int y) {
        return Eigen::Vector3d(x, y, 2.0 * std::sin(0.3 * x) + random.between(-0.3, 0.3));
    }));
}

// Random triangles over few vertices: non-manifold edges, duplicate triangles and vertices, degenerate triangles.
TriangleMesh random_soup(Random& random) {
    TriangleMesh mesh;
    const int vertices = 3 + random.below(30);
    for (int i = 0; i < vertices; ++i) {
        if (i > 0 && random.below(4) == 0) {
            mesh.positions.push_back(
                mesh.positions[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
        } else {
            mesh.positions.push_back(random.between(0.5, 5.0) * random.direction());
        }
        mesh.colours.push_back({static_cast<std::uint8_t>(random.below(256)), 0, 0, 255});
    }
    const auto any = [&] { return static_cast<std::uint32_t>(random.below(vertices)); };
    for (int i = random.below(60); i > 0; --i) mesh.triangles.push_back({any(), any(), any()});
    return mesh;
}

// Sampled distance between a level and the input without the triangles that create() drops.
double measured(const ProgressiveMesh& mesh, int per_edge) {
    return measured_distance(mesh.finest().positions, mesh.finest().triangles, triangles_of(mesh),
                             per_edge);
}

TEST(ProgressiveMesh, GivesTheSameTrianglesFromAnyOtherLevel) {
    const TriangleMesh input = rough_terrain(1, 24);
    ProgressiveMesh mesh = make(input);
    EXPECT_LT(mesh.least_triangle_count(), input.triangles.size() / 50);
    std::map<std::size_t, Triangles> by_count;
    for (std::size_t count = input.triangles.size(); count + 1 > 0; --count) {
        mesh.set_triangle_count(count);
        by_count[count] = triangles_of(mesh);
    }
    Random random(2);
    for (int i = 0; i < 500; ++i) {
        const auto count =
            static_cast<std::size_t>(random.below(static_cast<int>(input.triangles.size()) + 1));
        mesh.set_triangle_count(count);
        ASSERT_EQ(triangles_of(mesh), by_count[count]) << count;
        if (i % 50 != 0) continue;
        ProgressiveMesh fresh = make(input);
        fresh.set_triangle_count(count);
        ASSERT_EQ(triangles_of(fresh), by_count[count]) << count;
    }
    mesh.set_triangle_count(input.triangles.size());
    EXPECT_EQ(triangles_of(mesh), mesh.finest().triangles);
}

TEST(ProgressiveMesh, HasTheFinestLevelWithNoMoreTriangles) {
    const TriangleMesh input = rough_terrain(3, 16);
    ProgressiveMesh mesh = make(input);
    EXPECT_EQ(mesh.triangles().size(), input.triangles.size());
    std::size_t before = input.triangles.size();
    double error = 0.0;
    for (std::size_t count = before; count + 1 > 0; --count) {
        mesh.set_triangle_count(count);
        const std::size_t has = mesh.triangles().size();
        if (count >= mesh.least_triangle_count()) {
            EXPECT_LE(has, count);
            EXPECT_GE(has + 1, count);  // a contraction removes up to two triangles
        } else {
            EXPECT_EQ(has, mesh.least_triangle_count());
        }
        EXPECT_LE(has, before);
        EXPECT_GE(mesh.error_m(), error);
        error = mesh.error_m();
        before = has;
        std::uint32_t largest = 0;
        for (const auto& t : mesh.triangles()) largest = std::max({largest, t[0], t[1], t[2]});
        ASSERT_EQ(mesh.vertex_count(), largest + 1u);
    }
}

TEST(ProgressiveMesh, SetErrorGivesTheCoarsestLevelWithinIt) {
    ProgressiveMesh mesh = make(rough_terrain(4, 20));
    long compared = 0;
    for (const double error : {0.0, 0.01, 0.2, 1.0, 3.0}) {
        mesh.set_error(error);
        EXPECT_LE(mesh.error_m(), error);
        const std::size_t count = mesh.triangles().size();
        if (count == mesh.least_triangle_count()) continue;
        ++compared;
        mesh.set_triangle_count(count - 1);
        EXPECT_GT(mesh.error_m(), error);
    }
    EXPECT_GT(compared, 0);
    mesh.set_error(std::numeric_limits<double>::infinity());
    EXPECT_EQ(mesh.triangles().size(), mesh.least_triangle_count());
    mesh.set_error(-1.0);
    EXPECT_EQ(triangles_of(mesh), mesh.finest().triangles);
    mesh.set_triangle_count(0);
    mesh.set_error(std::numeric_limits<double>::quiet_NaN());
    EXPECT_EQ(triangles_of(mesh), mesh.finest().triangles);
}

TEST(ProgressiveMesh, ErrorIsNotBelowTheMeasuredDistance) {
    std::vector<TriangleMesh> meshes = {make_rock(2, 5), make_tree(7),
                                        mesh_of(make_torus(5.0, 2.0, 20, 9))};
    for (std::uint64_t seed = 10; seed < 16; ++seed) meshes.push_back(rough_terrain(seed, 9));
    for (const TriangleMesh& input : meshes) {
        ProgressiveMesh mesh = make(input);
        EXPECT_LT(mesh.least_triangle_count(), input.triangles.size() / 2);
        std::size_t count = input.triangles.size();
        while (true) {
            mesh.set_triangle_count(count);
            ASSERT_LE(measured(mesh, 5), mesh.error_m() + 1e-12) << count;
            if (mesh.triangles().size() == mesh.least_triangle_count()) break;
            count = std::min(count - 1, count * 9 / 10);
        }
    }
}

TEST(ProgressiveMesh, HoldsForTrianglesOfAnyTopology) {
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const TriangleMesh input = random_soup(random);
        ProgressiveMesh mesh = make(input);
        const std::size_t most = mesh.triangles().size();
        EXPECT_LE(most, input.triangles.size());
        for (std::size_t count = most; count + 1 > 0; --count) {
            mesh.set_triangle_count(count);
            for (const auto& t : mesh.triangles()) {
                ASSERT_LT(std::max({t[0], t[1], t[2]}), mesh.vertex_count());
                for (std::size_t k = 0; k < 3; ++k)
                    ASSERT_NE(mesh.finest().positions[t[k]],
                              mesh.finest().positions[t[(k + 1) % 3]]);
            }
            ASSERT_EQ(mesh.triangles().empty(), most == 0);
            ASSERT_LE(measured(mesh, 3), mesh.error_m() + 1e-12);
        }
    }
}

// Two boards 40 m apart and a small box on the lower one. All but one triangle of the largest body can be removed.
TEST(ProgressiveMesh, LeavesSheetsOfThinBodiesAndThenNothingOfSmallOnes) {
    TriangleMesh input;
    const auto add_box = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& size) {
        const auto first = static_cast<std::uint32_t>(input.positions.size());
        for (int i = 0; i < 8; ++i)
            input.positions.push_back(
                low + size.cwiseProduct(Eigen::Vector3d(i & 1, (i >> 1) & 1, (i >> 2) & 1)));
        for (const TriangleMesh::Triangle& t : test::kBoxTriangles)
            input.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    };
    add_box({0, 0, 0}, {100, 100, 1});
    add_box({0, 0, 40}, {100, 100, 1});
    add_box({20, 20, 1}, {0.5, 0.5, 0.5});
    ProgressiveMesh mesh = make(input);
    EXPECT_EQ(mesh.least_triangle_count(), 1u);
    mesh.set_error(4.0);
    EXPECT_LE(mesh.triangles().size(), 8u);  // two thin bodies, or the sheets that they became
    for (std::size_t count = input.triangles.size(); count > 0; --count) {
        mesh.set_triangle_count(count);
        ASSERT_LE(mesh.triangles().size(), count);
        ASSERT_LE(measured(mesh, 8), mesh.error_m() + 1e-9) << count;
    }
}

TEST(ProgressiveMesh, ChangesNothingOfLockedVertices) {
    const TriangleMesh input = rough_terrain(6, 10);
    ProgressiveSettings settings;
    settings.locked.assign(input.positions.size(), 1);
    ProgressiveMesh all = make(input, settings);
    all.set_triangle_count(0);
    EXPECT_EQ(all.triangles().size(), input.triangles.size());
    Random random(7);
    for (std::uint8_t& locked : settings.locked) locked = random.below(4) == 0 ? 1 : 0;
    ProgressiveMesh some = make(input, settings);
    some.set_triangle_count(0);
    EXPECT_LT(some.triangles().size(), input.triangles.size());
    std::vector<std::uint8_t> left(input.positions.size(), 0);
    for (const auto& t : some.triangles()) {
        for (const std::uint32_t v : t) left[some.input_vertices()[v]] = 1;
    }
    for (std::size_t v = 0; v < left.size(); ++v) EXPECT_LE(settings.locked[v], left[v]) << v;
}

TEST(ProgressiveMesh, EndsWhereItsSettingsSay) {
    const TriangleMesh input = rough_terrain(12, 20);
    ProgressiveMesh all = make(input), some = make(input, {.least_triangle_count = 100});
    EXPECT_LE(some.least_triangle_count(), 100u);
    EXPECT_GE(some.least_triangle_count(), 99u);
    all.set_triangle_count(100);
    some.set_triangle_count(0);
    const auto as_input = [](const ProgressiveMesh& mesh) {
        std::map<std::uint32_t, TriangleMesh::Triangle> triangles;
        for (std::size_t i = 0; i < mesh.triangles().size(); ++i) {
            TriangleMesh::Triangle t = mesh.triangles()[i];
            for (std::uint32_t& v : t) v = mesh.input_vertices()[v];
            triangles[mesh.input_triangles()[i]] = t;
        }
        return triangles;
    };
    EXPECT_EQ(as_input(all), as_input(some));
    all.set_triangle_count(input.triangles.size());
    std::size_t i = 0;
    for (const auto& [number, triangle] : as_input(all)) {
        EXPECT_EQ(number, i);
        EXPECT_EQ(triangle, input.triangles[i++]);
    }
}

TEST(ProgressiveMesh, ExistsForTheSmallestMeshes) {
    ProgressiveMesh none = make({});
    none.set_triangle_count(7);
    none.set_error(1.0);
    EXPECT_EQ(none.triangles().size() + none.vertex_count() + none.least_triangle_count(), 0u);
    EXPECT_EQ(none.error_m(), 0.0);
    EXPECT_TRUE(none.geomorph_targets(0).empty());
    TriangleMesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}};
    one.triangles = {{2, 0, 1}};
    EXPECT_EQ(make(one).vertex_count(), 3u);  // the last vertex is unused
    EXPECT_EQ(make(one).least_triangle_count(), 1u);
    TriangleMesh point = one;
    for (Eigen::Vector3d& p : point.positions) p.setZero();
    EXPECT_EQ(make(point).triangles().size(), 0u);
    one.triangles.push_back({2, 1, 0});
    EXPECT_GE(make(one).least_triangle_count(), 1u);
}

TEST(ProgressiveMesh, RefusesInvalidInputWithOneMessage) {
    const auto message = [](const TriangleMesh& mesh, const ProgressiveSettings& settings) {
        const auto made = ProgressiveMesh::create(mesh, settings);
        return made ? std::string("no error") : made.error().message;
    };
    TriangleMesh mesh = rough_terrain(8, 2);
    EXPECT_EQ(message(mesh, {.normal_weight = -1.0}),
              "normal_weight must be from 0 to 1000, got -1");
    EXPECT_EQ(message(mesh, {.colour_weight = std::numeric_limits<double>::quiet_NaN()}),
              "colour_weight must be from 0 to 1000, got nan");
    EXPECT_EQ(message(mesh, {.texture_coordinate_weight = 2e3}),
              "texture_coordinate_weight must be from 0 to 1000, got 2000");
    EXPECT_EQ(message(mesh, {.locked = {1, 0}}),
              "locked must have a value for each of 9 vertices, got 2");
    mesh.triangles[3][1] = 9;
    EXPECT_EQ(message(mesh, {}), "triangle 3 names vertex 9 of 9");
    mesh.positions[5].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message(mesh, {}), "coordinates must be within 1e+06 m, got nan at vertex 5");
}

}  // namespace terrane::progressive_mesh_test

// ProgressiveMesh::share(): meshes share one record of contractions and have levels of their own.

namespace terrane::shared_levels_test {

using progressive_mesh_test::Triangles;
using progressive_mesh_test::triangles_of;

ProgressiveMesh make_rock(std::uint64_t seed) {
    return ProgressiveMesh::create(test::make_rock(3, seed)).value();
}

TEST(SharedLevels, StepsListTheErrorsAndCountsOfAllLevels) {
    ProgressiveMesh mesh = make_rock(1);
    const std::span<const double> errors = mesh.step_errors_m();
    const std::span<const std::uint32_t> counts = mesh.step_triangle_counts();
    ASSERT_EQ(errors.size(), counts.size());
    EXPECT_EQ(errors[0], 0.0);
    EXPECT_EQ(counts[0], mesh.finest().triangles.size());
    EXPECT_EQ(counts.back(), mesh.least_triangle_count());
    for (std::size_t i = 0; i < counts.size(); ++i) {
        mesh.set_triangle_count(counts[i]);
        ASSERT_EQ(mesh.triangles().size(), counts[i]);
        ASSERT_EQ(mesh.error_m(), errors[i]);
    }
    EXPECT_TRUE(std::is_sorted(errors.begin(), errors.end()));
    const ProgressiveMesh none = ProgressiveMesh::create({}).value();
    EXPECT_EQ(none.step_errors_m().size(), 1u);
    EXPECT_EQ(none.step_triangle_counts()[0], 0u);
}

TEST(SharedLevels, ChangeNoOtherLevelAndAreTheSameAsThoseOfAFreshMesh) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        test::SeededRandom random(seed);
        ProgressiveMesh mesh = make_rock(seed), fresh = make_rock(seed);
        mesh.set_triangle_count(600);
        ProgressiveMesh shared = mesh.share();
        EXPECT_EQ(&shared.finest(), &mesh.finest()) << "one mesh";
        EXPECT_EQ(triangles_of(shared), triangles_of(mesh)) << "begins at the same level";
        for (int i = 0; i < 50; ++i) {
            const Triangles before = triangles_of(mesh);
            shared.set_triangle_count(static_cast<std::size_t>(random.below(1300)));
            ASSERT_EQ(triangles_of(mesh), before);
            fresh.set_triangle_count(shared.triangles().size());
            ASSERT_EQ(triangles_of(shared), triangles_of(fresh));
            if (i % 10 == 0) mesh = shared.share();
        }
    }
}

TEST(SharedLevels, ChangeOnThreadsOfTheirOwnAndOutliveTheFirst) {
    std::vector<ProgressiveMesh> shared;
    {
        const ProgressiveMesh mesh = make_rock(2);
        for (int i = 0; i < 3; ++i) shared.push_back(mesh.share());
    }
    std::vector<std::thread> threads;
    for (ProgressiveMesh& each : shared) {
        threads.emplace_back([&each] {
            for (std::size_t count = 1280; count > 100; count -= 40) each.set_triangle_count(count);
            for (std::size_t count = 100; count < 900; count += 30) each.set_triangle_count(count);
        });
    }
    for (std::thread& thread : threads) thread.join();
    ProgressiveMesh fresh = make_rock(2);
    fresh.set_triangle_count(shared[0].triangles().size());
    for (const ProgressiveMesh& each : shared) EXPECT_EQ(triangles_of(each), triangles_of(fresh));
}

}  // namespace terrane::shared_levels_test
