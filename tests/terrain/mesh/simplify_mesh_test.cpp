// SPDX-License-Identifier: MIT
//
// simplify_mesh(): every method is within its certified distance, which is close to the distance between samples, for
// meshes of any topology; positions and attributes are where the quadrics are least.
#include "mesh/surface_distance.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/simplify_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

namespace terrane {

// for the names of parametrised tests
void PrintTo(SimplifyMethod method, std::ostream* stream) {
    constexpr std::array kNames = {"quadric", "decimation", "clustering"};
    *stream << kNames[static_cast<std::size_t>(method)];
}

namespace simplify_mesh_test {

using namespace test;

TriangleMesh mesh_of(const ShapeMesh& shape) {
    TriangleMesh mesh;
    mesh.positions = shape.vertices;
    mesh.triangles = shape.triangles;
    return mesh;
}

TriangleMesh rough_terrain(std::uint64_t seed, int side) {
    Random random(seed);
    return mesh_of(make_grid(side, side, [&](int x, int y) {
        return Eigen::Vector3d(x, y, 2.0 * std::sin(0.3 * x) + random.between(-0.3, 0.3));
    }));
}

// Random triangles over few vertices: non-manifold edges, duplicates, triangles without area.
TriangleMesh random_soup(std::uint64_t seed) {
    Random random(seed);
    TriangleMesh mesh;
    const int vertices = 3 + random.below(30);
    for (int i = 0; i < vertices; ++i) {
        if (i > 0 && random.below(4) == 0) {
            mesh.positions.push_back(mesh.positions[static_cast<std::size_t>(random.below(i))]);
        } else {
            mesh.positions.push_back(random.between(0.5, 5.0) * random.direction());
        }
        mesh.normals.push_back(random.direction().cast<float>());
        mesh.colours.push_back({static_cast<std::uint8_t>(random.below(256)), 0, 0, 255});
    }
    const auto any = [&] { return static_cast<std::uint32_t>(random.below(vertices)); };
    for (int i = random.below(60); i > 0; --i) mesh.triangles.push_back({any(), any(), any()});
    return mesh;
}

// The triangles with corners at three positions.
TriangleMesh without_dropped(const TriangleMesh& mesh) {
    TriangleMesh result = mesh;
    std::erase_if(result.triangles, [&](const TriangleMesh::Triangle& t) {
        const auto& p = mesh.positions;
        return p[t[0]] == p[t[1]] || p[t[1]] == p[t[2]] || p[t[2]] == p[t[0]];
    });
    return result;
}

// Sampled distance between two meshes of different vertices, against all triangles.
double measured(const TriangleMesh& a, const TriangleMesh& b, int per_edge) {
    std::vector<Eigen::Vector3d> vertices = a.positions;
    vertices.insert(vertices.end(), b.positions.begin(), b.positions.end());
    MeshTriangles of_b = b.triangles;
    for (auto& t : of_b) {
        for (std::uint32_t& v : t) v += static_cast<std::uint32_t>(a.positions.size());
    }
    return measured_distance(vertices, a.triangles, of_b, per_edge);
}

SimplifiedCopy simplified(const TriangleMesh& mesh, const SimplifyMeshSettings& settings) {
    return simplify_mesh(mesh, settings).value();
}

double certified_by_surfaces(const TriangleMesh& a, const TriangleMesh& b) {
    return internal::bound_surface_distance({a.positions, a.triangles}, {b.positions, b.triangles});
}

TEST(SurfaceDistance, IsNotBelowTheSampledDistanceAndAtMostAHundredthAboveAFineOne) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        const TriangleMesh a = without_dropped(random_soup(seed)),
                           b = without_dropped(random_soup(seed + 1000));
        if (a.triangles.empty() || b.triangles.empty()) continue;
        const double bound = certified_by_surfaces(a, b);
        const double sampled = measured(a, b, 12);
        ASSERT_GE(bound, sampled);
        // a triangle's point is within 10 m / 12 of a sample
        ASSERT_LE(bound, 1.01 * (sampled + 10.0 / 12.0));
        ASSERT_EQ(bound, certified_by_surfaces(a, b));
    }
}

TEST(SurfaceDistance, IsThatOfShapesWithAKnownDistance) {
    const TriangleMesh fine =
        mesh_of(make_grid(40, 40, [](int x, int y) { return Eigen::Vector3d(x, y, 0.0); }));
    TriangleMesh coarse = mesh_of(make_grid(
        3, 3, [](int x, int y) { return Eigen::Vector3d(40.0 * x / 3.0, 40.0 * y / 3.0, 0.0); }));
    EXPECT_LE(certified_by_surfaces(fine, coarse), 1e-8) << "one plane";
    for (Eigen::Vector3d& p : coarse.positions) p.z() += 0.25;
    EXPECT_NEAR(certified_by_surfaces(fine, coarse), 0.25, 0.0026);
    for (Eigen::Vector3d& p : coarse.positions) p.x() *= 0.5;
    EXPECT_NEAR(certified_by_surfaces(fine, coarse), std::hypot(20.0, 0.25), 0.21);
    EXPECT_EQ(certified_by_surfaces({}, {}), 0.0);
    EXPECT_EQ(certified_by_surfaces(fine, {}), std::numeric_limits<double>::infinity());
}

class SimplifyMesh : public testing::TestWithParam<SimplifyMethod> {};

TEST_P(SimplifyMesh, ErrorIsNotBelowTheMeasuredDistance) {
    std::vector<TriangleMesh> meshes = {make_rock(2, 5), make_tree(7),
                                        mesh_of(make_torus(5.0, 2.0, 20, 9)), rough_terrain(10, 9)};
    long compared = 0;
    for (const TriangleMesh& input : meshes) {
        for (std::size_t count = input.triangles.size(); count > 0; count = count * 2 / 3) {
            const SimplifiedCopy made =
                simplified(input, {.method = GetParam(), .triangles = count});
            ASSERT_FALSE(made.mesh.triangles.empty());
            ASSERT_TRUE(made.mesh.validate()) << count;
            ASSERT_LE(measured(input, made.mesh, 3), made.error_m + 1e-12) << count;
            if (made.stop == SimplifyStop::triangle_count) {
                ASSERT_LE(made.mesh.triangles.size(), count);
                ++compared;
            }
        }
    }
    EXPECT_GT(compared, 20);
}

TEST_P(SimplifyMesh, HoldsForTrianglesOfAnyTopology) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        SCOPED_TRACE(seed);
        const TriangleMesh input = random_soup(seed);
        const TriangleMesh used = without_dropped(input);
        for (const std::size_t count : {std::size_t{20}, std::size_t{5}, std::size_t{0}}) {
            const SimplifiedCopy made =
                simplified(input, {.method = GetParam(), .triangles = count});
            ASSERT_TRUE(made.mesh.validate());
            ASSERT_EQ(made.mesh.triangles.empty(), used.triangles.empty());
            if (used.triangles.empty()) continue;
            ASSERT_EQ(made.mesh.normals.size(), made.mesh.positions.size());
            ASSERT_EQ(made.mesh.colours.size(), made.mesh.positions.size());
            ASSERT_LE(measured(used, made.mesh, 3), made.error_m + 1e-12);
        }
    }
}

TEST_P(SimplifyMesh, StaysWithinALimitOfTheError) {
    for (const TriangleMesh& input : {make_rock(2, 5), rough_terrain(3, 14)}) {
        std::size_t before = input.triangles.size();
        for (const double limit : {0.0, 0.02, 0.1, 0.8}) {
            const SimplifiedCopy made = simplified(input, {.method = GetParam(), .error_m = limit});
            EXPECT_LE(made.error_m, limit);
            EXPECT_LE(measured(input, made.mesh, 3), limit + 1e-12);
            EXPECT_LE(made.mesh.triangles.size(), before);
            before = made.mesh.triangles.size();
        }
        EXPECT_LT(before, input.triangles.size() / 2) << "the largest limit";
    }
}

TEST_P(SimplifyMesh, KeepsLockedVertices) {
    // all triangles of a locked vertex may vanish
    if (GetParam() == SimplifyMethod::clustering) return;
    const TriangleMesh input = rough_terrain(5, 16);
    std::vector<std::uint8_t> locked(input.positions.size(), 0);
    Random random(6);
    for (std::uint8_t& is_locked : locked) is_locked = random.below(5) == 0 ? 1 : 0;
    const SimplifiedCopy made =
        simplified(input, {.method = GetParam(), .triangles = 1, .locked = locked});
    EXPECT_LT(made.mesh.triangles.size(), input.triangles.size());
    long compared = 0;
    for (std::size_t v = 0; v < locked.size(); ++v) {
        if (locked[v] == 0) continue;
        ++compared;
        EXPECT_NE(
            std::find(made.mesh.positions.begin(), made.mesh.positions.end(), input.positions[v]),
            made.mesh.positions.end())
            << v;
    }
    EXPECT_GT(compared, 20);
}

// Waves in three stripes side by side, each with vertices and a material of its own.
TEST_P(SimplifyMesh, KeepsTheMaterialsOfTheVerticesThatRemain) {
    TriangleMesh input;
    for (std::uint16_t stripe = 0; stripe < 3; ++stripe) {
        const TriangleMesh part = mesh_of(make_grid(4, 9, [&](int x, int y) {
            const int along = 4 * stripe + x;
            return Eigen::Vector3d(along, y, std::sin(0.9 * y + 0.4 * along));
        }));
        const auto first = static_cast<std::uint32_t>(input.positions.size());
        for (const auto& [a, b, c] : part.triangles)
            input.triangles.push_back({first + a, first + b, first + c});
        input.positions.insert(input.positions.end(), part.positions.begin(), part.positions.end());
        input.materials.resize(input.positions.size(), stripe);
    }
    for (const std::size_t count : {input.triangles.size(), std::size_t{120}, std::size_t{60}}) {
        const TriangleMesh made =
            simplified(input, {.method = GetParam(), .triangles = count}).mesh;
        ASSERT_TRUE(made.validate());
        ASSERT_EQ(made.materials.size(), made.positions.size());
        std::array<int, 3> triangles{};
        for (const auto& [a, b, c] : made.triangles) {
            const std::uint16_t material = made.materials[a];
            EXPECT_EQ(made.materials[b], material);
            EXPECT_EQ(made.materials[c], material);
            const double middle =
                (made.positions[a].x() + made.positions[b].x() + made.positions[c].x()) / 3.0;
            // clusters move seams by less than a cell
            EXPECT_NEAR(middle, 4.0 * material + 2.0, 3.0) << count;
            ++triangles.at(material);
        }
        EXPECT_GT(*std::min_element(triangles.begin(), triangles.end()), 0) << count;
    }
}

TEST_P(SimplifyMesh, GivesTheSameBitsAgain) {
    const TriangleMesh input = make_rock(3, 8);
    const SimplifiedCopy first = simplified(input, {.method = GetParam(), .triangles = 300}),
                         second = simplified(input, {.method = GetParam(), .triangles = 300});
    EXPECT_EQ(first.mesh.positions, second.mesh.positions);
    EXPECT_EQ(first.mesh.triangles, second.mesh.triangles);
    EXPECT_EQ(first.error_m, second.error_m);
}

TEST_P(SimplifyMesh, ExistsForTheSmallestMeshes) {
    const SimplifyMeshSettings settings = {.method = GetParam()};
    EXPECT_TRUE(simplified({}, settings).mesh.triangles.empty());
    TriangleMesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}};
    one.triangles = {{2, 0, 1}};
    const SimplifiedCopy kept = simplified(one, settings);
    EXPECT_EQ(kept.mesh.triangles.size(), 1u);
    EXPECT_EQ(kept.mesh.positions.size(), 3u);
    EXPECT_EQ(kept.error_m, 0.0);
    EXPECT_EQ(kept.stop, SimplifyStop::no_contraction);
    one.triangles.push_back({2, 1, 0});
    EXPECT_FALSE(simplified(one, settings).mesh.triangles.empty());
    const TriangleMesh rock = make_rock(1, 2);
    const SimplifiedCopy whole =
        simplified(rock, {.method = GetParam(), .triangles = 10 * rock.triangles.size()});
    EXPECT_EQ(whole.mesh.positions, rock.positions);
    EXPECT_EQ(whole.mesh.triangles, rock.triangles);
    EXPECT_EQ(whole.error_m, 0.0);
}

TEST_P(SimplifyMesh, IsTheSameFarFromTheOriginExceptForRounding) {
    TriangleMesh near = rough_terrain(7, 12), far = near;
    const Eigen::Vector3d step(9e5, -9e5, 8e5);
    for (Eigen::Vector3d& p : far.positions) p += step;
    for (std::size_t i = 0; i < far.positions.size(); ++i)
        near.positions[i] = far.positions[i] - step;
    const SimplifiedCopy a = simplified(near, {.method = GetParam(), .triangles = 80}),
                         b = simplified(far, {.method = GetParam(), .triangles = 80});
    EXPECT_NEAR(a.error_m, b.error_m, 0.5 * a.error_m);
    EXPECT_LE(measured(far, b.mesh, 4), b.error_m + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Methods, SimplifyMesh,
                         testing::Values(SimplifyMethod::quadric, SimplifyMethod::decimation,
                                         SimplifyMethod::clustering),
                         testing::PrintToStringParamName());

// Vertices of fewer triangles about a sphere are outside of it: so the triangles are nearer on the whole.
TEST(SimplifyMeshPlacement, PutsVerticesOutsideOfARoundSurface) {
    const TriangleMesh input = mesh_of(make_sphere(10.0, 4));
    for (const SimplifyMethod method : {SimplifyMethod::quadric, SimplifyMethod::decimation}) {
        const SimplifiedCopy made = simplified(input, {.method = method, .triangles = 200});
        double sum = 0.0;
        for (const Eigen::Vector3d& p : made.mesh.positions) sum += p.norm();
        const double mean = sum / static_cast<double>(made.mesh.positions.size());
        if (method == SimplifyMethod::quadric) {
            EXPECT_GT(mean, 10.05);
            EXPECT_LT(mean, 10.5);
        } else {
            EXPECT_NEAR(mean, 10.0, 1e-9) << "vertices of the input";
        }
    }
}

TEST(SimplifyMeshPlacement, IsAtMostAsFarAsHalfEdgeContractionsAtTheSameNumber) {
    // at a tenth of the torus's triangles the optimal placement alone is farther
    const std::pair<TriangleMesh, std::vector<double>> cases[] = {
        {mesh_of(make_sphere(10.0, 4)), {0.5, 0.1, 0.02}},
        {mesh_of(make_torus(5.0, 2.0, 60, 30)), {0.5, 0.1, 0.02}}};
    for (const auto& [input, shares] : cases) {
        ProgressiveMesh half_edge = ProgressiveMesh::create(input).value();
        for (const double share : shares) {
            const auto count =
                static_cast<std::size_t>(share * static_cast<double>(input.triangles.size()));
            half_edge.set_triangle_count(count);
            TriangleMesh level = half_edge.finest();
            level.triangles.assign(half_edge.triangles().begin(), half_edge.triangles().end());
            const SimplifiedCopy made = simplified(input, {.triangles = count});
            EXPECT_LE(made.mesh.triangles.size(), count);
            EXPECT_LE(made.error_m, certified_by_surfaces(input, level))
                << share << " of " << input.triangles.size() << " triangles";
        }
    }
}

// Normals of a sphere: those of few new vertices are the directions from the centre, to less than a degree or two.
TEST(SimplifyMeshPlacement, GivesNewVerticesTheNormalsOfTheirPlaces) {
    TriangleMesh input = mesh_of(make_sphere(10.0, 4));
    for (const Eigen::Vector3d& p : input.positions)
        input.normals.push_back(p.normalized().cast<float>());
    for (const SimplifyMethod method : {SimplifyMethod::quadric, SimplifyMethod::clustering}) {
        const SimplifiedCopy made = simplified(input, {.method = method, .triangles = 400});
        ASSERT_EQ(made.mesh.normals.size(), made.mesh.positions.size());
        double worst = 1.0;
        for (std::size_t v = 0; v < made.mesh.positions.size(); ++v) {
            const Eigen::Vector3d normal = made.mesh.normals[v].cast<double>();
            EXPECT_NEAR(normal.norm(), 1.0, 1e-6);
            worst = std::min(worst, normal.dot(made.mesh.positions[v].normalized()));
        }
        EXPECT_GT(worst, std::cos(0.1));
    }
}

// Normals that turn at x = 10 on a plane: only their weight keeps vertices there.
TEST(SimplifyMeshPlacement, AWeightOfNormalsKeepsWhatTheShapeDoesNotShow) {
    TriangleMesh input =
        mesh_of(make_grid(20, 20, [](int x, int y) { return Eigen::Vector3d(x, y, 0.0); }));
    for (const Eigen::Vector3d& p : input.positions)
        input.normals.push_back(
            Eigen::Vector3f(std::abs(p.x() - 10.0) < 3.5 ? 1.0f : 0.0f, 0.0f, 1.0f).normalized());
    const auto error_of = [&](double weight) {
        const SimplifiedCopy made = simplified(input, {.triangles = 60, .normal_weight = weight});
        // of the vertices of the input, against the nearest vertex of the result
        double sum = 0.0;
        for (std::size_t v = 0; v < input.positions.size(); ++v) {
            std::size_t nearest = 0;
            for (std::size_t i = 1; i < made.mesh.positions.size(); ++i) {
                if ((made.mesh.positions[i] - input.positions[v]).squaredNorm() <
                    (made.mesh.positions[nearest] - input.positions[v]).squaredNorm())
                    nearest = i;
            }
            sum += double{(made.mesh.normals[nearest] - input.normals[v]).squaredNorm()};
        }
        return sum;
    };
    EXPECT_LT(error_of(0.1), 0.8 * error_of(0.0));
}

TEST(SimplifyMeshSettings, OutOfRangeAreRefusedWithOneMessage) {
    const auto message = [](const TriangleMesh& mesh, const SimplifyMeshSettings& settings) {
        const auto made = simplify_mesh(mesh, settings);
        return made ? std::string("no error") : made.error().message;
    };
    TriangleMesh mesh = rough_terrain(8, 2);
    EXPECT_EQ(message(mesh, {.error_m = -1.0}), "error_m must be at least 0, got -1");
    EXPECT_EQ(message(mesh, {.error_m = std::numeric_limits<double>::quiet_NaN()}),
              "error_m must be at least 0, got nan");
    EXPECT_EQ(message(mesh, {.normal_weight = -1.0}),
              "normal_weight must be from 0 to 1000, got -1");
    EXPECT_EQ(message(mesh, {.locked = {1, 0}}),
              "locked must have a value for each of 9 vertices, got 2");
    mesh.positions[5].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(message(mesh, {}), "coordinates must be within 1e+06 m, got nan at vertex 5");
}

}  // namespace simplify_mesh_test
}  // namespace terrane
