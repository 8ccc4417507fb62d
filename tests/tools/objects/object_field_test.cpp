// SPDX-License-Identifier: MIT
#include "objects/object_field.h"

#include "support/meshes/objects.h"

#include <terrane/scene/view_volume.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace terrane::tools {
namespace object_field_test {

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create({.seed = 3,
                                   .octave_count = 8,
                                   .amplitude = 60.0,
                                   .wavelength_log2 = 9,
                                   .root_size_log2 = 11})
        .value();
}

SceneObjects forest(double per_km2) {
    SceneObjects objects;
    objects.meshes = {test::make_tree(12), test::make_rock(3, 1)};
    objects.files = {"tree.obj", "rock.obj"};
    objects.scatters = {{0, {.per_km2 = per_km2, .seed = 1}}};
    objects.objects = {{1, {Eigen::Matrix3d::Identity(), {0.0, 60.0, 30.0}}, 2.0}};
    return objects;
}

View view_along(const WorldPos& eye) {
    View view;
    view.eye_world = eye;
    return view;
}

TEST(ObjectLevels, AreFewerTrianglesWithLargerErrorsThenAnImpostor) {
    const ObjectLevels rock = make_levels(test::make_rock(4, 1)).value();
    ASSERT_GE(rock.model.levels.size(), 4u);
    EXPECT_EQ(rock.triangles.size() + 1, rock.model.levels.size());
    EXPECT_TRUE(rock.model.levels.back().is_impostor);
    for (std::size_t i = 0; i < rock.triangles.size(); ++i) {
        EXPECT_EQ(rock.model.levels[i].triangles, rock.triangles[i].size());
        EXPECT_EQ(rock.model.levels[i].mesh_level, i);
    }
    EXPECT_DOUBLE_EQ(rock.model.absence_error_m, rock.size);
}

TEST(ObjectLevels, OfMeshesWithoutExtentOrWithNanAreRefused) {
    TriangleMesh mesh;
    EXPECT_EQ(make_levels(mesh).error().message, "an object must have triangles and an extent");
    mesh = test::make_tree(5);
    mesh.triangles = {{0, 0, 1}, {2, 2, 2}};
    EXPECT_EQ(make_levels(mesh).error().message, "an object must have triangles and an extent");
    mesh = test::make_tree(5);
    mesh.positions[1].z() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(make_levels(mesh).error().message.find("vertex 1"), std::string::npos);
    mesh = test::make_tree(5);
    mesh.triangles.push_back({0, 1, 9999});
    EXPECT_NE(make_levels(mesh).error().message.find("9999"), std::string::npos);
}

TEST(ObjectLevels, OfDegenerateDuplicatedAndDisconnectedTrianglesAreMade) {
    TriangleMesh mesh = test::make_tree(5);
    const std::vector<TriangleMesh::Triangle> once = mesh.triangles;
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
    mesh.triangles.push_back({0, 0, 0});
    mesh.triangles.push_back({0, 1, 1});
    EXPECT_TRUE(make_levels(mesh).has_value());
    TriangleMesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.triangles = {{0, 1, 2}};
    const ObjectLevels levels = make_levels(one).value();
    EXPECT_EQ(levels.model.levels.size(), 1u) << "an impostor would have more triangles";
}

TEST(ObjectField, HasTheObjectsOfAllSquaresInRangeOnceTheyAreLoaded) {
    const auto source = hills();
    const SceneObjects objects = forest(400.0);
    View view = view_along({0.0, -300.0, 90.0});
    ObjectField field = ObjectField::create(source, objects, 1.0, view, nullptr).value();
    field.load_all(view);
    field.begin_frame(view);
    field.end_frame(1.0);
    const ObjectCounts all = field.counts();
    // every object of the scatter that the view must show, found without squares' ranges
    const Scatter scatter = Scatter::create(source, objects.scatters[0].settings).value();
    const ObjectLevels levels = make_levels(objects.meshes[0]).value();
    const ViewVolume volume(view);
    const WorldRect& extent = source->extent();
    const ScatterSquare first = scatter.square_at(extent.west, extent.south);
    const ScatterSquare last = scatter.square_at(extent.east, extent.north);
    std::size_t needed = 0;
    for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            const std::vector<ScatterPoint> points = scatter.objects_in({x, y}).value();
            for (const ScatterPoint& point : points) {
                const double distance = (point.position_world - view.eye_world).norm();
                const double px = levels.size * point.scale * view.pixels_per_radian() / distance;
                const BoundingSphere middle = {point.position_world + Eigen::Vector3d(0, 0, 4),
                                               0.0};
                needed += px > 1.5 && volume.meets(middle) ? 1u : 0u;
            }
        }
    }
    EXPECT_GT(needed, 100u);
    EXPECT_GE(all.drawn, needed);
    EXPECT_EQ(all.failed_squares, 0u);
}

TEST(ObjectField, SquaresComeInAFewAFrameAndAFlightEndsAsIfLoadedAtOnce) {
    const auto source = hills();
    const SceneObjects objects = forest(400.0);
    View view = view_along({-900.0, -300.0, 90.0});
    ObjectField flown = ObjectField::create(source, objects, 4.0, view, nullptr).value();
    flown.load_all(view);
    for (int frame = 0; frame < 150; ++frame) {
        view.eye_world.x() += 10.0;
        flown.begin_frame(view);
        flown.end_frame(4.0);
    }
    for (int frame = 0; frame < 50; ++frame) flown.begin_frame(view);
    flown.end_frame(4.0);
    ObjectField fresh = ObjectField::create(source, objects, 4.0, view, nullptr).value();
    fresh.load_all(view);
    fresh.begin_frame(view);
    fresh.end_frame(4.0);
    EXPECT_EQ(flown.counts().drawn, fresh.counts().drawn);
    EXPECT_EQ(flown.counts().triangles, fresh.counts().triangles);
    EXPECT_GT(fresh.counts().drawn, 50u);
}

TEST(ObjectField, RefusesAScatterOfMoreObjectsThanItCanHold) {
    const auto source = hills();
    const View view = view_along({0, 0, 0});
    const auto made = ObjectField::create(source, forest(1e6), 1e-3, view, nullptr);
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().message,
              "tree.obj: a scatter may have at most 2^22 objects in sight, got about 1.67772e+07");
}

}  // namespace object_field_test
}  // namespace terrane::tools
