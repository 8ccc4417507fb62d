// SPDX-License-Identifier: MIT
#include "support/meshes/objects.h"
#include "support/random.h"

#include <terrane/scene/object_model.h>
#include <terrane/scene/scene.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::test::scene {
namespace mesh_rays_test {

// Fraction at which a segment meets the plane of a triangle within its edges (T. Moller, B. Trumbore, 1997), and the
// least distance from an edge as a barycentric coordinate: negative outside.
struct Meeting {
    double fraction = 0.0, inside = -1.0;
};
Meeting meet(const Eigen::Vector3d& from, const Eigen::Vector3d& along, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d p = along.cross(c - a);
    const double determinant = (b - a).dot(p);
    if (determinant == 0.0) return {};
    const double u = (from - a).dot(p) / determinant;
    const Eigen::Vector3d q = (from - a).cross(b - a);
    const double v = along.dot(q) / determinant;
    return {(c - a).dot(q) / determinant, std::min({u, v, 1.0 - u - v})};
}

TEST(MeshRays, AgreeWithAllTrianglesOneByOne) {
    const TriangleMesh mesh = make_rock(3, 7);
    const MeshRays rays = MeshRays::create(mesh).value();
    Random random(11);
    int hits = 0;
    for (int i = 0; i < 20'000; ++i) {
        const Eigen::Vector3d from = random.between(0.0, 4.0) * random.direction();
        const Eigen::Vector3d to = random.between(0.0, 4.0) * random.direction();
        double least = std::numeric_limits<double>::infinity();
        bool is_clear = true;  // not near an edge or an end, where rounding decides
        for (const auto& [a, b, c] : mesh.triangles) {
            const Meeting at =
                meet(from, to - from, mesh.positions[a], mesh.positions[b], mesh.positions[c]);
            const bool is_within = at.fraction > -1e-9 && at.fraction < 1.0 + 1e-9;
            if (is_within && std::abs(at.inside) < 1e-9) is_clear = false;
            if (at.inside < 0.0) continue;
            if (std::min(std::abs(at.fraction), std::abs(at.fraction - 1.0)) < 1e-9)
                is_clear = false;
            if (at.fraction >= 0.0 && at.fraction <= 1.0) least = std::min(least, at.fraction);
        }
        if (!is_clear) continue;
        const std::optional<MeshHit> hit = rays.ray(from, to);
        ASSERT_EQ(hit.has_value(), least <= 1.0) << i;
        if (!hit) continue;
        ++hits;
        EXPECT_NEAR(hit->fraction, least, 1e-9);
        EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-12);
        EXPECT_LE(hit->normal.dot(to - from), 0.0);
    }
    EXPECT_GT(hits, 2000);
}

TEST(MeshRays, DoNotGetThroughEdgesAndVertices) {
    const TriangleMesh mesh = make_rock(3, 7);
    const MeshRays rays = MeshRays::create(mesh).value();
    Random random(12);
    const Eigen::Vector3d inside(0.0, 0.0, 0.2);
    for (int i = 0; i < 50'000; ++i) {
        const auto& triangle = mesh.triangles[static_cast<std::size_t>(
            random.below(static_cast<int>(mesh.triangles.size())))];
        const Eigen::Vector3d& a = mesh.positions[triangle[0]];
        const Eigen::Vector3d& b = mesh.positions[triangle[1]];
        const double share = random.below(3) == 0 ? 0.0 : random.between(0.0, 1.0);
        const Eigen::Vector3d on_edge = a + share * (b - a);
        // from outside to the inside, through a point of an edge
        const Eigen::Vector3d from = inside + random.between(3.0, 1000.0) * (on_edge - inside);
        EXPECT_TRUE(rays.ray(from, inside)) << i;
    }
}

TEST(MeshRays, MeetNothingWhereThereIsNothing) {
    const MeshRays none = MeshRays::create({}).value();
    EXPECT_FALSE(none.ray({0, 0, 0}, {0, 0, -1}));
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 1, 2}};  // the last two without area
    const MeshRays rays = MeshRays::create(mesh).value();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, -1}));
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, 0}));  // ends on it
    EXPECT_EQ(rays.ray({0.2, 0.2, 0}, {0.2, 0.2, -1})->fraction, 0.0);
    EXPECT_TRUE(rays.ray({0.2, 0.2, 1e6}, {0.2, 0.2, -1e6}));
    EXPECT_FALSE(rays.ray({1.5, 0.0, 1}, {1.5, 0.0, -1}));  // the one without area
    EXPECT_FALSE(rays.ray({0.2, 0.2, 1}, {0.2, 0.2, 0.5}));
    EXPECT_FALSE(rays.ray({0.2, 0.2, 0}, {0.2, 0.2, 0}));
    EXPECT_FALSE(rays.ray({-1, 0.2, 0}, {2, 0.2, 0}));  // in its plane
    EXPECT_FALSE(rays.ray({0.2, 0.2, nan}, {0.2, 0.2, -1}));
    EXPECT_FALSE(rays.ray({0.2, 0.2, infinity}, {0.2, 0.2, -1}));
    mesh.positions[0].x() = nan;
    EXPECT_FALSE(MeshRays::create(mesh));
}

TEST(SceneRay, MeetsTheFirstOfAllObjects) {
    Random random(13);
    const TriangleMesh mesh = make_rock(1, 3);
    ObjectModel model;
    model.bounds = {Eigen::Vector3d::Constant(-2.0), Eigen::Vector3d::Constant(2.0)};
    model.levels = {{0.0, 80, 0, false}};
    model.absence_error_m = 2.0;
    Scene scene = Scene::create({}).value();
    const ModelId unseen = scene.add_model(model).value();
    model.rays = MeshRays::create(mesh).value();
    const ModelId rock = scene.add_model(model).value();
    const WorldPos far_away(3e5, -2e5, 100.0);
    struct Group {
        GroupId id;
        std::vector<PlacedObject> objects;
    };
    std::vector<Group> groups;
    for (int i = 0; i < 4; ++i) {
        std::vector<PlacedObject> objects(200);
        for (PlacedObject& object : objects) {
            object.position_world = far_away + random.between(0.0, 60.0) * random.direction();
            object.scale = static_cast<float>(random.between(0.3, 2.0));
            const Eigen::Vector3d axis = random.direction();
            const double half = random.between(0.0, 3.0);
            object.rotation = {static_cast<float>(axis.x() * std::sin(half)),
                               static_cast<float>(axis.y() * std::sin(half)),
                               static_cast<float>(axis.z() * std::sin(half)),
                               static_cast<float>(std::cos(half))};
        }
        groups.push_back({scene.add_group(rock, objects).value(), objects});
        ASSERT_TRUE(scene.add_group(unseen, objects));
    }
    scene.remove_group(groups[1].id);
    groups.erase(groups.begin() + 1);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const WorldPos from = far_away + random.between(0.0, 90.0) * random.direction();
        const WorldPos to = far_away + random.between(0.0, 90.0) * random.direction();
        double least = std::numeric_limits<double>::infinity();
        const PlacedObject* expected = nullptr;
        for (const Group& group : groups) {
            for (const PlacedObject& object : group.objects) {
                const auto& [x, y, z, w] = object.rotation;
                const Eigen::Matrix3d rotation =
                    Eigen::Quaterniond(static_cast<double>(w), static_cast<double>(x),
                                       static_cast<double>(y), static_cast<double>(z))
                        .normalized()
                        .toRotationMatrix();
                for (const auto& triangle : mesh.triangles) {
                    std::array<Eigen::Vector3d, 3> p;
                    for (std::size_t k = 0; k < 3; ++k)
                        p[k] = object.position_world + static_cast<double>(object.scale) *
                                                           (rotation * mesh.positions[triangle[k]]);
                    const Meeting at = meet(from, to - from, p[0], p[1], p[2]);
                    if (at.inside < 0.0 || at.fraction < 0.0 || at.fraction > 1.0) continue;
                    if (at.fraction < least) expected = &object;
                    least = std::min(least, at.fraction);
                }
            }
        }
        const std::optional<SceneHit> hit = scene.ray(from, to);
        ASSERT_EQ(hit.has_value(), expected != nullptr) << i;
        if (!hit) continue;
        ++hits;
        // positions of instances are float within their cluster
        EXPECT_NEAR(hit->fraction * (to - from).norm(), least * (to - from).norm(), 1e-2);
        EXPECT_NEAR((hit->point_world - (from + least * (to - from))).norm(), 0.0, 1e-2);
        for (const Group& group : groups) {
            if (group.id != hit->group) continue;
            EXPECT_EQ(&group.objects[hit->object], expected);
        }
    }
    EXPECT_GT(hits, 300);
}

}  // namespace mesh_rays_test
}  // namespace terrane::test::scene
