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
    EXPECT_EQ(without.model.levels.size() + 1, with.model.levels.size());
    EXPECT_EQ(without.triangles, with.triangles);
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

}  // namespace terrane::object_levels_test
