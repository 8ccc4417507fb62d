// SPDX-License-Identifier: MIT
#include "scene/culling/random_views.h"

#include <terrane/scene/culling.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace terrane::test::view_volume {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

View straight() {
    View view;
    view.vertical_fov = 1.0;
    view.width_px = view.height_px = 100;
    return view;
}

template <class Bound>
bool passes_planes(const ViewVolume& volume, const Bound& bound) {
    PlaneState state;
    return volume.test_planes(bound, state) != Containment::outside;
}

struct Places {
    WorldPos centre;
    double far_distance;
    View view;
    OrientedBox box;
};

Places random_places(Random& random) {
    Places places;
    places.centre = random.below(2) == 0 ? WorldPos(0, 0, 0) : WorldPos(4e5, -7e5, 2e3);
    places.far_distance = random.below(2) == 0 ? kNone : random.between(1.0, 60.0);
    places.view = random_view(random, places.centre);
    places.box = random_box(random, places.centre, random.below(2) == 0 ? 3.0 : 30.0);
    return places;
}

TEST(ViewVolume, BoxesThatHaveAPointInViewPassEveryTestAndOthersFailTheExactOne) {
    int in_view = 0, out_of_view = 0, kept_by_planes = 0;
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const Places at = random_places(random);
        const ViewVolume volume(at.view, at.far_distance);
        const Apart apart =
            are_apart(project_to_view(at.view, at.far_distance), project_to_box(at.box), at.centre);
        if (apart == Apart::no) {
            ++in_view;
            ASSERT_TRUE(passes_planes(volume, at.box));
            ASSERT_TRUE(volume.meets(at.box));
            ASSERT_TRUE(passes_planes(volume, bounding_box(at.box)));
            ASSERT_TRUE(volume.meets(bounding_box(at.box)));
            ASSERT_TRUE(passes_planes(volume, bounding_sphere(at.box)));
            ASSERT_TRUE(volume.meets(bounding_sphere(at.box)));
        } else if (apart == Apart::yes) {
            ++out_of_view;
            ASSERT_FALSE(volume.meets(at.box));
            kept_by_planes += passes_planes(volume, at.box) ? 1 : 0;
        }
    }
    EXPECT_GT(in_view, 500);
    EXPECT_GT(out_of_view, 500);
    EXPECT_GT(kept_by_planes, 20) << "the inexact test must be seen to keep some";
}

TEST(ViewVolume, BallsMeetItWhereTheirCentreIsNearerThanTheirRadius) {
    int in_view = 0, out_of_view = 0;
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const Places at = random_places(random);
        const ViewVolume volume(at.view, at.far_distance);
        const BoundingSphere ball = {at.centre + random.between(0.0, 20.0) * random.direction(),
                                     random.below(8) == 0 ? 0.0 : random.between(0.0, 20.0)};
        const double distance =
            (project_to_view(at.view, at.far_distance)(ball.centre) - ball.centre).norm();
        if (std::abs(distance - ball.radius) < 1e-5) continue;
        const bool is_in_view = distance < ball.radius;
        (is_in_view ? in_view : out_of_view) += 1;
        ASSERT_EQ(volume.meets(ball), is_in_view) << distance << " " << ball.radius;
        if (is_in_view) {
            ASSERT_TRUE(passes_planes(volume, ball));
        }
    }
    EXPECT_GT(in_view, 500);
    EXPECT_GT(out_of_view, 500);
}

TEST(ViewVolume, TrianglesMeetItWhereTheyHaveAPointInView) {
    int in_view = 0, out_of_view = 0;
    for (std::uint64_t seed = 0; seed < 2000; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        const Places at = random_places(random);
        const ViewVolume volume(at.view, at.far_distance);
        std::vector<Eigen::Vector3d> corners, world;
        const Pose pose = {random.rotation(), at.centre};
        const double scale = random.between(0.5, 2.0);
        for (int i = 0; i < 3; ++i) {
            corners.push_back(random.between(0.0, 20.0) * random.direction());
            world.push_back(pose * Eigen::Vector3d(scale * corners.back()));
        }
        const TriangleMesh::Triangle triangle = {0, 1, 2};
        const Apart apart = are_apart(project_to_view(at.view, at.far_distance),
                                      project_to_triangle(world[0], world[1], world[2]), at.centre);
        if (apart == Apart::unknown) continue;
        (apart == Apart::no ? in_view : out_of_view) += 1;
        ASSERT_EQ(volume.meets_triangles(pose, scale, corners, {&triangle, 1}), apart == Apart::no);
    }
    EXPECT_GT(in_view, 300);
    EXPECT_GT(out_of_view, 300);
}

TEST(ViewVolume, InsideMeansEveryPointAndRemovesThePlanesThatAreDecided) {
    const ViewVolume volume(straight(), 100.0);
    PlaneState state;
    EXPECT_EQ(volume.test_planes(BoundingSphere{{0, 50, 0}, 1.0}, state), Containment::inside);
    EXPECT_EQ(state.mask, 0);
    state = {};
    EXPECT_EQ(volume.test_planes(BoundingSphere{{0, 100, 0}, 1.0}, state),
              Containment::intersecting);
    EXPECT_EQ(state.mask, 1 << 4) << "the far plane alone is left";
    state = {};
    EXPECT_EQ(volume.test_planes(Aabb{{-1, 102, -1}, {1, 103, 1}}, state), Containment::outside);
    EXPECT_EQ(state.first, 4) << "the plane that excluded it comes first in the next frame";
}

TEST(ViewVolume, TheEyeAndTouchingBoundsAreInView) {
    const ViewVolume volume(straight());
    EXPECT_TRUE(volume.meets(BoundingSphere{}));
    EXPECT_TRUE(volume.meets(Aabb{}));
    EXPECT_TRUE(volume.meets(Aabb{{-1, -1, -1}, {1, 0, 1}})) << "its face touches the eye";
    EXPECT_FALSE(volume.meets(Aabb{{-1, -1, -1}, {1, -1e-6, 1}}));
    EXPECT_TRUE(volume.meets(Aabb{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}})) << "around the eye";
    const Aabb everywhere = {Eigen::Vector3d::Constant(-1e300), Eigen::Vector3d::Constant(1e300)};
    EXPECT_TRUE(volume.meets(everywhere));
    EXPECT_TRUE(passes_planes(volume, everywhere));
}

TEST(ViewVolume, BoundsThatAreNotFiniteAreKept) {
    const ViewVolume volume(straight());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const BoundingSphere ball = {{nan, -10, 0}, 1.0};
    EXPECT_TRUE(passes_planes(volume, ball));
    EXPECT_TRUE(volume.meets(ball));
    const Aabb box = {{-1, nan, -1}, {1, nan, 1}};
    EXPECT_TRUE(passes_planes(volume, box));
    EXPECT_TRUE(volume.meets(box));
}

}  // namespace
}  // namespace terrane::test::view_volume
