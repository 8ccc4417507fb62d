// SPDX-License-Identifier: MIT
#include "scene/scene_cases.h"
#include "support/random.h"

#include <terrane/scene/culling.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

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

namespace terrane::test::caster_volume {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Directions of all kinds: any, along an axis of the view, along an edge of its picture, against them.
Eigen::Vector3d random_sun(Random& random, const View& view) {
    const double sign = random.below(2) == 0 ? 1.0 : -1.0;
    switch (random.below(5)) {
        case 0:
            return sign * view.forward;
        case 1:
            return sign * view.up;
        case 2:
            return sign * direction_through(view, random.below(2) * view.width_px,
                                            random.below(2) * view.height_px);
        default:
            return std::exp2(random.between(-20.0, 20.0)) * random.direction();
    }
}

// A point that the view shows within a distance.
WorldPos random_receiver(Random& random, const View& view, double distance) {
    const Eigen::Vector3d ray = direction_through(view, random.between(0.0, view.width_px),
                                                  random.between(0.0, view.height_px));
    return view.eye_world + random.between(0.0, distance) * ray;
}

TEST(CasterVolume, HasEveryPointWhoseRayFromTheSunMeetsTheViewWithinTheDistance) {
    constexpr std::uint64_t kSeed = 11;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    for (int i = 0; i < 20'000; ++i) {
        const View view = random_view(random, 1e4 * random.direction());
        const Eigen::Vector3d sun = random_sun(random, view);
        const double distance = std::exp2(random.between(-3.0, 18.0));
        const CasterVolume volume(view, {.sun_direction = sun, .distance = distance});
        for (int k = 0; k < 20; ++k) {
            const double length =
                random.below(4) == 0 ? 0.0 : distance * std::exp2(random.between(-8.0, 8.0));
            const WorldPos caster =
                random_receiver(random, view, distance) + length * sun.normalized();
            ASSERT_TRUE(volume.meets(BoundingSphere{caster, 0.0})) << i << " " << length;
            ASSERT_TRUE(volume.meets(Aabb{caster, caster})) << i << " " << length;
            // a bounding volume of any size that has the point
            const double size = distance * std::exp2(random.between(-10.0, 2.0));
            const WorldPos middle = caster + random.between(0.0, size) * random.direction();
            ASSERT_TRUE(volume.meets(BoundingSphere{middle, size})) << i << " " << length;
            const OrientedBox box{{random.rotation(), middle}, Eigen::Vector3d::Constant(size)};
            ASSERT_TRUE(volume.meets(box)) << i << " " << length;
            ASSERT_TRUE(volume.meets(bounding_box(box))) << i << " " << length;
        }
    }
}

// By brute force: the largest t at which a plane of the view still excludes the box that has moved t metres away from
// the sun is found for each plane, and the intervals of t that no plane excludes are intersected.
bool sweep_meets_planes(const View& view, const SunShadows& shadows, const Aabb& box) {
    const ViewVolume receivers(view, shadows.distance);
    const Eigen::Vector3d away = -shadows.sun_direction.normalized();
    const Eigen::Vector3d middle = 0.5 * (box.low + box.high) - view.eye_world;
    const Eigen::Vector3d half = 0.5 * (box.high - box.low);
    double first = 0.0, last = kInfinite;
    for (std::size_t plane = 0; plane < 5; ++plane) {
        const Eigen::Vector3d normal = receivers.normals()[plane];
        const double at = normal.dot(middle) + normal.cwiseAbs().dot(half) +
                          (plane == 4 ? shadows.distance : 0.0);
        const double speed = normal.dot(away);
        if (speed > 0.0) first = std::max(first, -at / speed);
        if (speed < 0.0) last = std::min(last, -at / speed);
        if (speed == 0.0 && at < 0.0) return false;
    }
    return first <= last;
}

TEST(CasterVolume, KeepsBoxesWhoseSweepMeetsTheViewAndFewOthers) {
    constexpr std::uint64_t kSeed = 12;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    int needed = 0, kept = 0, total = 0;
    for (int i = 0; i < 2000; ++i) {
        View view = random_view(random, WorldPos::Zero());
        view.vertical_fov = random.between(0.2, 1.5);
        const SunShadows shadows{.sun_direction = random.direction(),
                                 .distance = random.between(50.0, 500.0)};
        const CasterVolume volume(view, shadows);
        for (int k = 0; k < 200; ++k) {
            const OrientedBox box = random_box(
                random, view.eye_world + random.between(0.0, 2000.0) * random.direction(),
                random.between(0.1, 20.0));
            const bool is_kept = volume.meets(bounding_box(box));
            // a box without a point in the swept view may meet all its planes, and is kept for that
            const bool is_needed = sweep_meets_planes(view, shadows, bounding_box(box));
            needed += is_needed && is_kept ? 1 : 0;
            kept += is_kept ? 1 : 0;
            ++total;
        }
    }
    std::printf("%d of %d boxes kept, the planes at one time would keep %d of them\n", kept, total,
                needed);
    EXPECT_GT(needed, total / 50);
    EXPECT_LT(kept, needed + needed / 10);
}

TEST(CasterVolume, ATreeFindsWhatEveryBoxOnItsOwnFinds) {
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        Random random(seed);
        std::vector<Aabb> boxes;
        for (int i = random.below(400); i > 0; --i)
            boxes.push_back(bounding_box(random_box(random, 300.0 * random.direction(), 10.0)));
        const CullTree tree(boxes);
        std::vector<std::uint32_t> found = {7};
        for (int i = 0; i < 20; ++i) {
            const View view = random_view(random, WorldPos::Zero());
            const CasterVolume volume(
                view, {.sun_direction = random_sun(random, view), .distance = 200.0});
            tree.find_casters(volume, found);
            std::sort(found.begin(), found.end());
            std::vector<std::uint32_t> expected;
            for (std::uint32_t k = 0; k < boxes.size(); ++k) {
                if (volume.meets(boxes[k])) expected.push_back(k);
            }
            ASSERT_EQ(found, expected);
        }
    }
}

TEST(CasterVolume, OnlyDirectionsAndDistancesInRangeHaveShadows) {
    const Eigen::Vector3d sun(0.0, 1.0, 1.0);
    EXPECT_TRUE(has_shadows({.sun_direction = sun, .distance = 1e-3}));
    EXPECT_TRUE(has_shadows({.sun_direction = 1e100 * sun, .distance = 1e9}));
    for (const double distance : {0.0, -1.0, 1.1e9, kInfinite, std::nan("")})
        EXPECT_FALSE(has_shadows({.sun_direction = sun, .distance = distance})) << distance;
    for (const double factor : {0.0, 1e300, kInfinite, std::nan("")}) {
        EXPECT_FALSE(
            has_shadows({.sun_direction = factor * Eigen::Vector3d::Ones(), .distance = 1.0}))
            << factor;
    }
    EXPECT_FALSE(has_shadows({})) << "of its defaults";
}

}  // namespace
}  // namespace terrane::test::caster_volume

namespace terrane::test::cull_tree {
namespace {

std::vector<Aabb> random_boxes(Random& random, int count, double spread) {
    std::vector<Aabb> boxes;
    for (int i = 0; i < count; ++i) {
        const WorldPos centre(random.between(-spread, spread), random.between(-spread, spread),
                              random.between(-spread / 10, spread / 10));
        boxes.push_back(bounding_box(random_box(random, centre, random.between(0.1, 10.0))));
    }
    return boxes;
}

std::vector<std::uint32_t> one_by_one(const ViewVolume& volume, std::span<const Aabb> boxes,
                                      CullTest test) {
    std::vector<std::uint32_t> visible;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        PlaneState state;
        if (volume.test_planes(boxes[i], state) == Containment::outside) continue;
        if (test == CullTest::exact && !volume.meets(boxes[i])) continue;
        visible.push_back(i);
    }
    return visible;
}

std::vector<std::uint32_t> sorted(std::vector<std::uint32_t> indices) {
    std::sort(indices.begin(), indices.end());
    return indices;
}

// Views a tree, each culled with both tests and compared with every box on its own. The memory is kept from view to
// view, as a viewer that jumps; the order does not depend on it.
void compare_views(std::uint64_t seed, int views) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    std::vector<Aabb> boxes = random_boxes(random, random.below(400), 200.0);
    CullTree tree(boxes);
    CullMemory memory;
    std::vector<std::uint32_t> visible, fresh;
    for (int i = 0; i < views; ++i) {
        if (i % 10 == 9) {
            for (Aabb& box : boxes) {
                const Eigen::Vector3d move = random.between(0.0, 5.0) * random.direction();
                box = {box.low + move, box.high + move};
            }
            tree.refit(boxes);
        }
        const ViewVolume volume(random_view(random, WorldPos(0, 0, 0)),
                                random.below(2) == 0 ? random.between(1.0, 300.0)
                                                     : std::numeric_limits<double>::infinity());
        for (const CullTest test : {CullTest::planes, CullTest::exact}) {
            tree.cull(volume, test, memory, visible);
            CullMemory none;
            tree.cull(volume, test, none, fresh);
            ASSERT_EQ(visible, fresh);
            ASSERT_EQ(sorted(visible), one_by_one(volume, boxes, test));
        }
    }
}

TEST(CullTree, FindsWhatEveryBoxOnItsOwnFinds) {
    for (std::uint64_t seed = 0; seed < 100; ++seed) compare_views(seed, 30);
}

// TERRANE_VIEWS=1000000 is the long run: see docs/objects.md.
TEST(CullTree, NeverDropsWhatIsInViewOverRandomViews) {
    const int views = test::number_from("TERRANE_VIEWS", 2000);
    Random random(7);
    const std::vector<Aabb> boxes = random_boxes(random, 2000, 300.0);
    const CullTree tree(boxes);
    CullMemory memory;
    std::vector<std::uint32_t> visible;
    std::vector<char> is_kept(boxes.size());
    std::size_t checked = 0;
    for (int i = 0; i < views; ++i) {
        const View view = random_view(random, WorldPos(0, 0, 0));
        tree.cull(ViewVolume(view), i % 2 == 0 ? CullTest::planes : CullTest::exact, memory,
                  visible);
        std::fill(is_kept.begin(), is_kept.end(), char{0});
        for (const std::uint32_t index : visible) is_kept[index] = 1;
        // A point of a box that is in view makes the box visible, whatever the tests of boxes say.
        const Frustum frustum = make_frustum(view);
        for (std::size_t box = 0; box < boxes.size(); ++box) {
            const Eigen::Vector3d size = boxes[box].high - boxes[box].low;
            const Eigen::Vector3d p =
                boxes[box].low +
                size.cwiseProduct(Eigen::Vector3d(
                    random.between(0.0, 1.0), random.between(0.0, 1.0), random.between(0.0, 1.0)));
            const bool is_in_view = std::all_of(frustum.normals.begin(), frustum.normals.end(),
                                                [&](const Eigen::Vector3d& normal) {
                                                    return normal.dot(p - view.eye_world) >= 0.0;
                                                });
            if (!is_in_view) continue;
            ++checked;
            ASSERT_TRUE(is_kept[box]) << "view " << i << ", box " << box;
        }
    }
    std::printf("%zu boxes in view over %d views\n", checked, views);
    EXPECT_GT(checked, static_cast<std::size_t>(views));
}

TEST(CullTree, IsEmptyForNoBoxesAndKeepsTheOnlyOne) {
    const CullTree none(std::span<const Aabb>{});
    CullMemory memory;
    std::vector<std::uint32_t> visible = {7};
    none.cull(ViewVolume(View{}), CullTest::exact, memory, visible);
    EXPECT_TRUE(visible.empty());
    const Aabb box = {{-1, 5, -1}, {1, 6, 1}};
    const CullTree one({&box, 1});
    one.cull(ViewVolume(View{}), CullTest::exact, memory, visible);
    EXPECT_EQ(visible, std::vector<std::uint32_t>{0});
}

}  // namespace
}  // namespace terrane::test::cull_tree
