// SPDX-License-Identifier: MIT
#include <terrane/terrain/primitive_meshes.h>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

namespace terrane {
namespace {

// Six times the signed volume of the tetrahedra from the origin: above 0 if triangles face outwards.
double volume_of(const TriangleMesh& mesh) {
    double volume = 0.0;
    for (const auto& [a, b, c] : mesh.triangles)
        volume += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c]));
    return volume / 6.0;
}

double area_of(const TriangleMesh& mesh) {
    double area = 0.0;
    for (const auto& [a, b, c] : mesh.triangles)
        area += 0.5 * (mesh.positions[b] - mesh.positions[a])
                          .cross(mesh.positions[c] - mesh.positions[a])
                          .norm();
    return area;
}

// Every edge between two positions has a neighbour in the opposite direction, and normals are unit and outward.
void expect_closed(const TriangleMesh& mesh) {
    ASSERT_TRUE(mesh.validate());
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    using Point = std::tuple<double, double, double>;
    const auto point = [&](std::uint32_t i) {
        const Eigen::Vector3d& p = mesh.positions[i];
        return Point(p.x() + 0.0, p.y() + 0.0, p.z() + 0.0);
    };
    std::map<std::pair<Point, Point>, int> edges;
    for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
        const Eigen::Vector3d& a = mesh.positions[triangle[0]];
        const Eigen::Vector3d across =
            (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a).normalized();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
            ++edges[{point(from), point(to)}];
            --edges[{point(to), point(from)}];
            EXPECT_NEAR(mesh.normals[from].norm(), 1.0f, 1e-6f);
            EXPECT_GT(mesh.normals[from].cast<double>().dot(across), 0.9);
        }
    }
    for (const auto& [edge, count] : edges) ASSERT_EQ(count, 0);
}

TEST(PrimitiveMeshes, AreClosedAndFaceOutwards) {
    constexpr double kPi = std::numbers::pi;
    const TriangleMesh box = make_box_mesh({1.0, 2.0, 3.0}).value();
    expect_closed(box);
    EXPECT_DOUBLE_EQ(volume_of(box), 48.0);
    EXPECT_DOUBLE_EQ(area_of(box), 88.0);
    const TriangleMesh sphere = make_sphere_mesh(2.0).value();
    expect_closed(sphere);
    // a polyhedron of 32 meridians and 16 bands in the sphere
    EXPECT_NEAR(volume_of(sphere) / (4.0 / 3.0 * kPi * 8.0), 1.0, 0.025);
    for (const Eigen::Vector3d& p : sphere.positions) EXPECT_NEAR(p.norm(), 2.0, 1e-12);
    const TriangleMesh capsule = make_capsule_mesh(0.5, 1.5).value();
    expect_closed(capsule);
    EXPECT_NEAR(volume_of(capsule) / (kPi * 0.25 * 3.0 + 4.0 / 3.0 * kPi * 0.125), 1.0, 0.025);
    const TriangleMesh cylinder = make_cylinder_mesh(0.5, 0.25).value();
    expect_closed(cylinder);
    // a prism of 32 sides
    const double section = 0.5 * 32.0 * 0.25 * std::sin(2.0 * kPi / 32.0);
    EXPECT_NEAR(volume_of(cylinder), 0.5 * section, 1e-12);
}

TEST(PrimitiveMeshes, RefuseSizesByName) {
    EXPECT_EQ(make_sphere_mesh(0.0).error().message,
              "radius must be above 0 and at most 1e5 m, got 0");
    EXPECT_EQ(make_capsule_mesh(1.0, -1.0).error().message,
              "half_height must be 0 to 1e5 m, got -1");
    EXPECT_EQ(make_box_mesh({1.0, std::nan(""), 1.0}).error().message,
              "half_extents must be above 0 and at most 1e5 m, got nan");
    EXPECT_TRUE(make_cylinder_mesh(1e5, 1e-9));
    EXPECT_FALSE(make_cylinder_mesh(1e5, 1e6));
}

}  // namespace
}  // namespace terrane
