// SPDX-License-Identifier: MIT
#include <terrane/terrain/crease_normals.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace terrane::crease_normals_test {

/// A cylinder of radius 1 around z from -1 to 1 with `sides` sides, its caps as fans.
TriangleMesh cylinder(std::uint32_t sides) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, -1}, {0, 0, 1}};
    for (std::uint32_t i = 0; i < sides; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / sides;
        mesh.positions.emplace_back(std::cos(angle), std::sin(angle), -1.0);
        mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 1.0);
    }
    for (std::uint32_t i = 0; i < sides; ++i) {
        const std::uint32_t low = 2 + 2 * i, next = 2 + 2 * ((i + 1) % sides);
        mesh.triangles.push_back({low, next, next + 1});
        mesh.triangles.push_back({low, next + 1, low + 1});
        mesh.triangles.push_back({0, next, low});
        mesh.triangles.push_back({1, low + 1, next + 1});
    }
    return mesh;
}

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180.0); }

TEST(CreaseNormals, ABoxHasFacetsAndACylinderIsSmoothAround) {
    // the sides of 12 meet at 30 degrees, sides and caps at 90
    const TriangleMesh shaded = with_crease_normals(cylinder(12), cosine_of(40.0));
    ASSERT_TRUE(shaded.validate());
    ASSERT_EQ(shaded.positions.size(), 2u + 4u * 12u);
    ASSERT_EQ(shaded.normals.size(), shaded.positions.size());
    for (std::size_t i = 0; i < shaded.triangles.size(); ++i) {
        for (const std::uint32_t vertex : shaded.triangles[i]) {
            const Eigen::Vector3d p = shaded.positions[vertex], out(p.x(), p.y(), 0.0);
            const Eigen::Vector3d expected = i % 4 < 2 ? out : Eigen::Vector3d(0.0, 0.0, p.z());
            EXPECT_LT((shaded.normals[vertex].cast<double>() - expected).norm(), 1e-6) << i;
        }
    }
    const TriangleMesh box = with_crease_normals(cylinder(4), cosine_of(40.0));
    EXPECT_EQ(box.positions.size(), 2u + 3u * 8u);
    // an angle of exactly the crease angle is smooth
    EXPECT_EQ(with_crease_normals(cylinder(4), cosine_of(90.0)).positions.size(), 10u);
    EXPECT_EQ(with_crease_normals(cylinder(12), cosine_of(29.9)).positions.size(), 2u + 6u * 12u);
    EXPECT_EQ(with_crease_normals(cylinder(12), cosine_of(180.0)).positions.size(), 26u);
}

TEST(CreaseNormals, KeepTrianglesColoursAndDegenerateParts) {
    TriangleMesh mesh = cylinder(4);
    mesh.positions.emplace_back(5.0, 5.0, 5.0);  // unused
    mesh.triangles.push_back({0, 0, 1});
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        mesh.colours.push_back({static_cast<std::uint8_t>(i), 0, 0, 255});
    const TriangleMesh shaded = with_crease_normals(mesh, cosine_of(40.0));
    ASSERT_TRUE(shaded.validate());
    ASSERT_EQ(shaded.triangles.size(), mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t was = mesh.triangles[i][k], is = shaded.triangles[i][k];
            EXPECT_EQ(shaded.positions[is], mesh.positions[was]);
            EXPECT_EQ(shaded.colours[is], mesh.colours[was]);
            EXPECT_NEAR(shaded.normals[is].norm(), 1.0f, 1e-6f);
        }
    }
}

TEST(CreaseNormals, KeepTextureCoordinatesAndMaterialsApart) {
    // two triangles in a plane, with a seam of texture between them
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0.2}};
    mesh.texture_coordinates = {{0, 0}, {1, 0}, {1, 1}, {0.2f, 0}, {0.4f, 0}, {0, 1}};
    mesh.materials = {0, 0, 0, 1, 1, 1};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    const TriangleMesh smooth = with_crease_normals(mesh, std::cos(0.7));
    EXPECT_EQ(smooth.triangles, mesh.triangles);
    EXPECT_EQ(smooth.texture_coordinates, mesh.texture_coordinates);
    EXPECT_EQ(smooth.materials, mesh.materials);
    // one normal on both sides of the seam
    EXPECT_EQ(smooth.normals[0], smooth.normals[3]);
    EXPECT_EQ(smooth.normals[2], smooth.normals[4]);
    EXPECT_NE(smooth.normals[1], smooth.normals[5]);
    const TriangleMesh sharp = with_crease_normals(mesh, std::cos(0.05));
    EXPECT_NE(sharp.normals[0], sharp.normals[3]);
    EXPECT_EQ(sharp.normals[0], sharp.normals[1]);
}

}  // namespace terrane::crease_normals_test
