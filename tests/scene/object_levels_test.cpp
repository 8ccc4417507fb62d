// SPDX-License-Identifier: MIT
#include "support/meshes.h"

#include <terrane/scene/object_levels.h>

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace terrane::object_levels_test {

TEST(ObjectLevels, AreFewerTrianglesWithLargerErrorsThenAnImpostor) {
    const ObjectLevels rock = make_object_levels(test::make_rock(4, 1)).value();
    ASSERT_GE(rock.model.levels.size(), 4u);
    EXPECT_EQ(rock.triangles.size() + 1, rock.model.levels.size());
    EXPECT_TRUE(rock.model.levels.back().is_impostor);
    for (std::size_t i = 0; i < rock.triangles.size(); ++i) {
        EXPECT_EQ(rock.model.levels[i].triangles, rock.triangles[i].size());
        EXPECT_EQ(rock.model.levels[i].mesh_level, i);
    }
    const Aabb& box = rock.model.bounds;
    EXPECT_DOUBLE_EQ(rock.model.absence_error_m, (box.high - box.low).norm());
}

TEST(ObjectLevels, WithoutAnImpostorAreAllMeshes) {
    const TriangleMesh rock = test::make_rock(4, 1);
    const ObjectLevels with = make_object_levels(rock).value();
    const ObjectLevels without = make_object_levels(rock, false).value();
    EXPECT_FALSE(without.model.impostor);
    ASSERT_GE(without.triangles.size(), with.triangles.size());
    for (std::size_t i = 0; i < with.triangles.size(); ++i)
        EXPECT_EQ(without.triangles[i], with.triangles[i]);
    EXPECT_LT(without.triangles.back().size(), 100u);
    for (const ObjectLevel& level : without.model.levels) EXPECT_FALSE(level.is_impostor);
}

TEST(ObjectLevels, AreContinuousOfMeshesOfManyTrianglesOnly) {
    const ObjectLevels dense = make_object_levels(test::make_rock(5, 1)).value();
    ASSERT_NE(dense.model.continuous, nullptr);
    EXPECT_EQ(dense.model.continuous->finest().triangles.size(), 20480u);
    EXPECT_EQ(dense.model.continuous->finest().positions, dense.mesh.positions);
    EXPECT_EQ(make_object_levels(test::make_rock(3, 1)).value().model.continuous, nullptr);
}

TEST(ObjectLevels, OfMeshesWithoutExtentOrWithNanAreRefused) {
    const auto message = [](const auto& change) {
        TriangleMesh mesh = test::make_tree(5);
        change(mesh);
        return make_object_levels(mesh).error().message;
    };
    EXPECT_EQ(message([](TriangleMesh& mesh) { mesh = {}; }),
              "an object must have triangles and an extent");
    EXPECT_EQ(message([](TriangleMesh& mesh) {
                  mesh.triangles = {{0, 0, 1}, {2, 2, 2}};
              }),
              "an object must have triangles and an extent");
    EXPECT_NE(
        message([](TriangleMesh& mesh) { mesh.positions[1].z() = std::nan(""); }).find("vertex 1"),
        std::string::npos);
    EXPECT_NE(message([](TriangleMesh& mesh) {
                  mesh.triangles.push_back({0, 1, 9999});
              }).find("9999"),
              std::string::npos);
}

TEST(ObjectLevels, OfDegenerateDuplicatedAndDisconnectedTrianglesAreMade) {
    TriangleMesh mesh = test::make_tree(5);
    const std::vector<TriangleMesh::Triangle> once = mesh.triangles;
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
    mesh.triangles.push_back({0, 0, 0});
    mesh.triangles.push_back({0, 1, 1});
    EXPECT_TRUE(make_object_levels(mesh).has_value());
    TriangleMesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.triangles = {{0, 1, 2}};
    const ObjectLevels levels = make_object_levels(one).value();
    EXPECT_EQ(levels.model.levels.size(), 1u) << "an impostor would have more triangles";
}

TEST(ObjectLevels, OfAnArtistHaveTheDistanceOfTheirSurfaces) {
    // a ball of radius 1 + size, with 4^detail * 20 triangles
    const auto ball = [](int detail, double size) {
        TriangleMesh mesh = test::make_rock(detail, 1);
        for (Eigen::Vector3d& p : mesh.positions) p = (1.0 + size) * p.normalized();
        return mesh;
    };
    const std::vector<TriangleMesh> meshes{ball(4, 0.0), ball(3, 0.1), ball(1, 0.1)};
    const ObjectLevels made = make_object_levels(meshes).value();
    ASSERT_EQ(made.model.levels.size(), 4u);
    EXPECT_EQ(made.model.levels[0].error_m, 0.0);
    EXPECT_GE(made.model.levels[1].error_m, 0.1);
    EXPECT_LT(made.model.levels[1].error_m, 0.11);
    EXPECT_GE(made.model.levels[2].error_m, 2.0 * made.model.levels[1].error_m);
    EXPECT_TRUE(made.model.levels[3].is_impostor);
    EXPECT_GE(made.model.absence_error_m, 2.0 * made.model.levels[3].error_m);
    std::size_t before = 0;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        ASSERT_EQ(made.triangles[i].size(), meshes[i].triangles.size());
        for (std::size_t k = 0; k < meshes[i].triangles.size(); ++k) {
            for (std::size_t corner = 0; corner < 3; ++corner) {
                EXPECT_EQ(made.triangles[i][k][corner], before + meshes[i].triangles[k][corner]);
            }
        }
        before += meshes[i].positions.size();
    }
    EXPECT_EQ(made.mesh.positions.size(), before);
    EXPECT_TRUE(made.mesh.validate());
    EXPECT_FALSE(make_object_levels(meshes, false).value().model.impostor);
}

TEST(ObjectLevels, OfAnArtistMayLackAttributesOfOthers) {
    std::vector<TriangleMesh> meshes{test::make_rock(2, 1), test::make_rock(1, 1)};
    for (TriangleMesh& mesh : meshes) mesh.colours.clear();
    meshes[1].colours.assign(meshes[1].positions.size(), {1, 2, 3, 4});
    meshes[0].materials.assign(meshes[0].positions.size(), 1);
    const TriangleMesh all = make_object_levels(meshes).value().mesh;
    ASSERT_TRUE(all.validate());
    const std::size_t first = meshes[0].positions.size();
    EXPECT_EQ(all.colours[0], (std::array<std::uint8_t, 4>{255, 255, 255, 255}));
    EXPECT_EQ(all.colours[first], (std::array<std::uint8_t, 4>{1, 2, 3, 4}));
    EXPECT_EQ(all.materials[0], 1);
    EXPECT_EQ(all.materials[first], 0);
}

TEST(ObjectLevels, OfAnArtistAreRefusedByTheirNumber) {
    const TriangleMesh fine = test::make_rock(2, 1), coarse = test::make_rock(1, 1);
    const auto message = [](const std::vector<TriangleMesh>& meshes) {
        const auto made = make_object_levels(meshes);
        return made ? std::string() : made.error().message;
    };
    EXPECT_EQ(message({}), "level 0 is missing");
    EXPECT_EQ(message({coarse, fine}),
              "level 1 has 320 triangles, not fewer than the 80 of the level before");
    EXPECT_EQ(message({fine, coarse, {}}), "level 2 has no triangles");
    TriangleMesh bad = coarse;
    bad.positions[3].x() = std::nan("");
    EXPECT_EQ(message({fine, bad}).find("level 1 is invalid: "), 0u);
}

}  // namespace terrane::object_levels_test
