// SPDX-License-Identifier: MIT
//
// Attributes, seams and geomorphs of a ProgressiveMesh.
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

namespace terrane::progressive_attributes_test {

using namespace test;

ProgressiveMesh make(const TriangleMesh& mesh, const ProgressiveSettings& settings = {}) {
    return ProgressiveMesh::create(mesh, settings).value();
}

// A sphere by longitude and latitude with a seam of texture coordinates from pole to pole. At the poles every triangle
// has its own vertex.
TriangleMesh make_globe(int around, int across) {
    TriangleMesh mesh;
    const auto point = [&](int i, int j) {
        const double a = 2.0 * std::numbers::pi * (i % around) / around;
        const double b = std::numbers::pi * j / across;
        const double ring = j == 0 || j == across ? 0.0 : std::sin(b);
        return Eigen::Vector3d(ring * std::cos(a), ring * std::sin(a), std::cos(b));
    };
    for (int j = 0; j <= across; ++j) {
        for (int i = 0; i <= around; ++i) {
            mesh.positions.push_back(point(i, j));
            mesh.normals.push_back(mesh.positions.back().cast<float>());
            mesh.texture_coordinates.emplace_back(
                static_cast<float>(i) / static_cast<float>(around),
                static_cast<float>(j) / static_cast<float>(across));
        }
    }
    const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (around + 1) + i); };
    for (int j = 0; j < across; ++j) {
        for (int i = 0; i < around; ++i) {
            if (j + 1 < across)
                mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
            if (j > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
        }
    }
    return mesh;
}

// Appends the positions and triangles of a shape.
void append(const ShapeMesh& shape, TriangleMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), shape.vertices.begin(), shape.vertices.end());
    for (const auto& [a, b, c] : shape.triangles)
        mesh.triangles.push_back({first + a, first + b, first + c});
}

// A box of cells whose vertices carry the normal of their side: seams along all edges, three vertices at each corner.
TriangleMesh make_box(int cells) {
    TriangleMesh mesh;
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const bool is_high = side % 2 == 1;
        const ShapeMesh grid = make_grid(cells, cells, [&](int x, int y) {
            Eigen::Vector3d p;
            p[axis] = is_high ? cells : 0.0;
            p[is_high ? u : v] = x;
            p[is_high ? v : u] = y;
            return p;
        });
        append(grid, mesh);
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        normal[axis] = is_high ? 1.0f : -1.0f;
        mesh.normals.resize(mesh.positions.size(), normal);
    }
    return mesh;
}

// Triangles over positions: vertices at one position are identified with the first of them.
MeshTriangles welded(const ProgressiveMesh& mesh) {
    std::map<std::array<double, 3>, std::uint32_t> places;
    MeshTriangles triangles;
    for (auto t : mesh.triangles()) {
        for (std::uint32_t& v : t) {
            const Eigen::Vector3d& p = mesh.finest().positions[v];
            v = places.try_emplace({p.x(), p.y(), p.z()}, v).first->second;
        }
        triangles.push_back(t);
    }
    return triangles;
}

TEST(ProgressiveAttributes, SeamsOfClosedMeshesStayClosedAtEveryLevel) {
    for (const TriangleMesh& input : {make_globe(18, 11), make_box(5)}) {
        ProgressiveMesh mesh = make(input);
        // With 16 triangles or fewer a body may become a sheet.
        for (std::size_t count = input.triangles.size(); count > 16; --count) {
            mesh.set_triangle_count(count);
            const EdgeCounts edges = count_edges(welded(mesh));
            ASSERT_EQ(edges.border + edges.other, 0u) << count;
            ASSERT_LE(mesh.triangles().size(), count);
        }
    }
}

TEST(ProgressiveAttributes, TrianglesOfABoxKeepTheNormalsOfTheirSides) {
    const TriangleMesh input = make_box(8);
    ProgressiveMesh mesh = make(input);
    // Two triangles per side suffice; a few more remain if only corners are available as vertices.
    mesh.set_triangle_count(24);
    EXPECT_LE(mesh.triangles().size(), 24u);
    EXPECT_LE(mesh.error_m(), 1e-9);
    for (const auto& t : mesh.triangles()) {
        const auto& p = mesh.finest().positions;
        const Eigen::Vector3d normal = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).normalized();
        for (const std::uint32_t v : t)
            EXPECT_GT(normal.cast<float>().dot(mesh.finest().normals[v]), 0.99f);
    }
}

// Two charts of a plane, side by side along a wavy line and one above the other in the texture.
TEST(ProgressiveAttributes, TrianglesStayInTheirChart) {
    const int side = 20;
    TriangleMesh mesh;
    std::vector<int> chart;
    for (int half = 0; half < 2; ++half) {
        const ShapeMesh grid = make_grid(side, side, [&](int x, int y) {
            const double edge = 0.6 * std::sin(0.9 * x);
            const double lateral = static_cast<double>(y) / side;
            return Eigen::Vector3d(
                x, half == 0 ? edge - side * (1.0 - lateral) * 0.5 : edge + side * lateral * 0.5,
                0.0);
        });
        append(grid, mesh);
        for (const Eigen::Vector3d& p : grid.vertices) {
            mesh.texture_coordinates.emplace_back(
                static_cast<float>(p.x() / side),
                static_cast<float>(p.y() / side) + 5.0f * static_cast<float>(half));
        }
        chart.resize(mesh.positions.size(), half);
    }
    ProgressiveMesh made = make(mesh);
    made.set_triangle_count(mesh.triangles.size() / 8);
    EXPECT_LE(made.triangles().size(), mesh.triangles.size() / 8);
    for (const auto& t : made.triangles()) {
        EXPECT_EQ(chart[made.input_vertices()[t[0]]], chart[made.input_vertices()[t[1]]]);
        EXPECT_EQ(chart[made.input_vertices()[t[0]]], chart[made.input_vertices()[t[2]]]);
    }
    EXPECT_EQ(count_edges(welded(made)).other, 0u);
}

// Mean colour difference between a level and its input, a disk of another colour in a plane.
double colour_error(const ProgressiveMesh& mesh, int side,
                    const std::function<double(double, double)>& truth) {
    double sum = 0.0;
    int count = 0;
    for (double y = 0.25; y < side; y += 0.5) {
        for (double x = 0.25; x < side; x += 0.5) {
            for (const auto& t : mesh.triangles()) {
                const auto& p = mesh.finest().positions;
                const Eigen::Vector3d a = p[t[0]], b = p[t[1]] - a, c = p[t[2]] - a;
                const double whole = b.x() * c.y() - b.y() * c.x();
                const double u = ((x - a.x()) * c.y() - (y - a.y()) * c.x()) / whole;
                const double v = (b.x() * (y - a.y()) - b.y() * (x - a.x())) / whole;
                if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
                const auto red = [&](std::size_t k) {
                    return mesh.finest().colours[t[k]][0] / 255.0;
                };
                sum += std::abs((1.0 - u - v) * red(0) + u * red(1) + v * red(2) - truth(x, y));
                ++count;
                break;
            }
        }
    }
    return sum / count;
}

TEST(ProgressiveAttributes, ColoursOfAPlaneDecideWhatStays) {
    const int side = 40;
    const auto truth = [](double x, double y) {
        return (x - 17.0) * (x - 17.0) + (y - 21.0) * (y - 21.0) < 100.0 ? 1.0 : 0.0;
    };
    TriangleMesh input;
    append(make_grid(side, side, [](int x, int y) { return Eigen::Vector3d(x, y, 0.0); }), input);
    for (const Eigen::Vector3d& p : input.positions)
        input.colours.push_back(
            {static_cast<std::uint8_t>(255.0 * truth(p.x(), p.y())), 0, 0, 255});
    ProgressiveMesh with = make(input), without = make(input, {.colour_weight = 0.0});
    with.set_triangle_count(200);
    without.set_triangle_count(200);
    EXPECT_LT(colour_error(with, side, truth), 0.05);
    EXPECT_LT(3.0 * colour_error(with, side, truth), colour_error(without, side, truth));
}

// Every triangle has three vertices of its own with its normal.
TriangleMesh flat_shaded(const TriangleMesh& smooth) {
    TriangleMesh mesh;
    for (const auto& [a, b, c] : smooth.triangles) {
        const auto& p = smooth.positions;
        const Eigen::Vector3d normal = (p[b] - p[a]).cross(p[c] - p[a]).normalized();
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const std::uint32_t vertex : {a, b, c}) {
            mesh.positions.push_back(p[vertex]);
            mesh.normals.push_back(normal.cast<float>());
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

TEST(ProgressiveAttributes, GeomorphsEndAtTheCoarserLevel) {
    for (const TriangleMesh& input :
         {make_globe(18, 11), make_box(6), flat_shaded(make_globe(12, 7))}) {
        ProgressiveMesh mesh = make(input);
        Random random(3);
        for (int i = 0; i < 60; ++i) {
            const auto count = [&] {
                return static_cast<std::size_t>(
                    random.below(static_cast<int>(input.triangles.size()) + 1));
            };
            const std::size_t coarse = std::max<std::size_t>(count(), 17);  // no sheets above 16
            mesh.set_triangle_count(std::max(coarse, count()));
            const std::vector<std::uint32_t> targets = mesh.geomorph_targets(coarse);
            const std::vector<TriangleMesh::Triangle> fine(mesh.triangles().begin(),
                                                           mesh.triangles().end());
            ASSERT_EQ(targets.size(), mesh.vertex_count());
            EXPECT_EQ(mesh.geomorph_targets(input.triangles.size()).back(), targets.size() - 1);
            mesh.set_triangle_count(coarse);
            for (std::size_t k = 0; k < fine.size(); ++k) {
                const TriangleMesh::Triangle moved = {targets[fine[k][0]], targets[fine[k][1]],
                                                      targets[fine[k][2]]};
                if (k < mesh.triangles().size()) {
                    ASSERT_EQ(moved, mesh.triangles()[k]);
                    continue;
                }
                // No area: two of its corners have met.
                const auto& p = mesh.finest().positions;
                ASSERT_TRUE(p[moved[0]] == p[moved[1]] || p[moved[1]] == p[moved[2]] ||
                            p[moved[2]] == p[moved[0]]);
            }
        }
    }
}

}  // namespace terrane::progressive_attributes_test
