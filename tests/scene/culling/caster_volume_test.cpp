// SPDX-License-Identifier: MIT
#include "scene/culling/random_views.h"

#include <terrane/scene/culling.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

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

TEST(CasterVolume, DoesNotReachAwayFromTheSunNorBesideTheView) {
    // north, 90 degrees wide and high, up to 100 m; the sun is in the west at 45 degrees
    View view;
    view.vertical_fov = 2.0 * std::atan(1.0);
    view.width_px = view.height_px = 100;
    const CasterVolume volume(view, {.sun_direction = {-1.0, 0.0, 1.0}, .distance = 100.0});
    const auto has = [&](double x, double y, double z) {
        return volume.meets(BoundingSphere{{x, y, z}, 0.0});
    };
    EXPECT_TRUE(has(0.0, 50.0, 0.0)) << "in view";
    EXPECT_TRUE(has(-500.0, 50.0, 500.0)) << "its shadow falls on (0, 50, 0)";
    EXPECT_FALSE(has(-500.0, 50.0, 600.1))
        << "its shadow passes over the view's western upper edge";
    EXPECT_FALSE(has(-500.0, 101.0, 500.0)) << "its shadow falls beyond the distance";
    EXPECT_FALSE(has(-500.0, -1.0, 500.0)) << "its shadow falls behind the eye";
    EXPECT_FALSE(has(60.0, 50.0, 0.0)) << "its shadow falls away from the view";
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
