// SPDX-License-Identifier: MIT
//
// Levels of meshes with texture coordinates and materials: no triangle joins two materials, and the displacement of the
// texture is that of a search over many points.
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/texture_shift.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::texture_shift_test {

using Triangles = std::vector<TriangleMesh::Triangle>;

/// A cube of 2 m with rough sides, each a grid with a chart and a material of its own.
TriangleMesh rough_cube(int cells, std::uint64_t seed) {
    const test::ShapeMesh grid = test::make_grid(cells, cells, [&](int i, int j) {
        return Eigen::Vector3d(2.0 * i / cells - 1.0, 2.0 * j / cells - 1.0, 1.0);
    });
    TriangleMesh mesh;
    for (std::uint16_t side = 0; side < 6; ++side) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        const double sign = side % 2 == 0 ? 1.0 : -1.0;
        const int axis = side / 2;
        for (const Eigen::Vector3d& p : grid.vertices) {
            Eigen::Vector3d q;
            q[axis] = sign;
            q[(axis + 1) % 3] = sign * p.x();
            q[(axis + 2) % 3] = p.y();
            // dents that depend on the place alone, so that the sides meet
            test::Random dent(seed + static_cast<std::uint64_t>(std::llround(
                                         1e3 * (q.x() + 7.0 * q.y() + 49.0 * q.z()) + 1e6)));
            mesh.positions.push_back((1.0 + dent.between(0.0, 0.02)) * q);
            mesh.texture_coordinates.emplace_back(static_cast<float>(0.5 * p.x() + 0.5),
                                                  static_cast<float>(0.5 * p.y() + 0.5));
            mesh.materials.push_back(side);
        }
        for (const auto& t : grid.triangles)
            mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    return mesh;
}

TEST(TexturedLevels, HaveNoTriangleOfTwoMaterialsWhereSeamsAreKept) {
    const TriangleMesh mesh = rough_cube(8, 5);
    const auto has_mixed = [](const ProgressiveMesh& progressive) {
        const std::vector<std::uint16_t>& materials = progressive.finest().materials;
        return std::ranges::any_of(progressive.triangles(), [&](const TriangleMesh::Triangle& t) {
            return materials[t[0]] != materials[t[1]] || materials[t[1]] != materials[t[2]];
        });
    };
    ProgressiveMesh kept =
        ProgressiveMesh::create(mesh, {.texture_coordinate_weight = 0.5, .keeps_seams = true})
            .value();
    const std::size_t count = mesh.triangles.size();
    for (std::size_t wanted = count; wanted >= 100; wanted -= 1 + wanted / 8) {
        kept.set_triangle_count(wanted);
        EXPECT_FALSE(has_mixed(kept)) << wanted;
        const test::EdgeCounts edges = test::count_edges([&] {
            // by place: seams have two vertices
            test::MeshTriangles places;
            const auto& p = kept.finest().positions;
            for (const TriangleMesh::Triangle& t : kept.triangles()) {
                auto& made = places.emplace_back();
                for (std::size_t i = 0; i < 3; ++i)
                    made[i] = static_cast<std::uint32_t>(std::ranges::find(p, p[t[i]]) - p.begin());
            }
            return places;
        }());
        EXPECT_EQ(edges.border + edges.other, 0u) << wanted;
    }
    EXPECT_GT(std::ranges::count(kept.finest().materials, std::uint16_t{3}), 60);

    for (std::size_t wanted = 40; wanted > 0; --wanted) {
        kept.set_triangle_count(wanted);
        EXPECT_FALSE(has_mixed(kept)) << wanted;
    }
}

TEST(TextureShift, IsTheLargestDistanceInSpaceAndTexture) {
    test::Random random(9);
    const test::ShapeMesh grid = test::make_grid(
        9, 7, [&](int i, int j) { return Eigen::Vector3d(i, j, random.between(-0.3, 0.3)); });
    TriangleMesh mesh;
    mesh.positions = grid.vertices;
    mesh.triangles = grid.triangles;
    for (const Eigen::Vector3d& p : mesh.positions)
        mesh.texture_coordinates.emplace_back(
            static_cast<float>(0.1 * p.x() + 0.01 * p.x() * p.x()),
            static_cast<float>(0.2 * p.y()));
    const double scale = metres_per_texture_coordinate(mesh);
    EXPECT_GT(scale, 4.0);
    EXPECT_LT(scale, 12.0);
    ProgressiveMesh progressive = ProgressiveMesh::create(mesh, {.keeps_seams = true}).value();
    const TriangleMesh& finest = progressive.finest();
    EXPECT_EQ(texture_shift_m(finest, progressive.triangles()), 0.0);
    EXPECT_EQ(texture_shift_m(finest, {}), std::numeric_limits<double>::infinity());
    for (const std::size_t count : {60u, 20u}) {
        progressive.set_triangle_count(count);
        // the nearest of many points of the level, in five dimensions
        double largest = 0.0;
        constexpr int kSteps = 40;
        for (std::size_t v = 0; v < finest.positions.size(); ++v) {
            double least = std::numeric_limits<double>::infinity();
            for (const TriangleMesh::Triangle& t : progressive.triangles()) {
                for (int i = 0; i <= kSteps; ++i) {
                    for (int j = 0; i + j <= kSteps; ++j) {
                        const double a = 1.0 * i / kSteps, b = 1.0 * j / kSteps, c = 1.0 - a - b;
                        const Eigen::Vector3d p = a * finest.positions[t[0]] +
                                                  b * finest.positions[t[1]] +
                                                  c * finest.positions[t[2]];
                        const auto coordinate = [&](std::size_t k) -> Eigen::Vector2d {
                            return finest.texture_coordinates[t[k]].cast<double>();
                        };
                        const Eigen::Vector2d at =
                            a * coordinate(0) + b * coordinate(1) + c * coordinate(2);
                        least = std::min(least,
                                         (p - finest.positions[v]).squaredNorm() +
                                             scale * scale *
                                                 (at - finest.texture_coordinates[v].cast<double>())
                                                     .squaredNorm());
                    }
                }
            }
            largest = std::max(largest, std::sqrt(least));
        }
        const double shift = texture_shift_m(finest, progressive.triangles());
        EXPECT_LE(shift, largest + 1e-9) << count;
        EXPECT_GE(shift, largest - 0.05) << count;
    }
}

TEST(TextureShift, OfAnotherMaterialIsInfinite) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.texture_coordinates = {{0, 0}, {1, 0}, {0, 1}};
    mesh.triangles = {{0, 1, 2}};
    EXPECT_EQ(texture_shift_m(mesh, mesh.triangles), 0.0);
    mesh.materials = {0, 1, 0};
    EXPECT_EQ(texture_shift_m(mesh, mesh.triangles), std::numeric_limits<double>::infinity());
    EXPECT_EQ(metres_per_texture_coordinate({}), 0.0);
    EXPECT_EQ(texture_shift_m({}, {}), 0.0);
}

TEST(Materials, OfAMeshAreNoneOrOneAVertex) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.materials = {0, 1};
    EXPECT_EQ(mesh.validate().error().message,
              "materials must be none or one a vertex, got 2 of 3");
}

}  // namespace terrane::texture_shift_test
