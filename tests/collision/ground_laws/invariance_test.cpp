// SPDX-License-Identifier: MIT
// The same query on the same ground elsewhere: shifted by whole chunks or by anything, mirrored, turned by 90 degrees.
#include "law_cases.h"

#include <terrane/collision/ground_queries.h>

#include <gtest/gtest.h>

#include <cstring>

namespace terrane {
namespace invariance_test {

using namespace test;

constexpr std::uint64_t kSeed = 20260307;

bool is_same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool is_same(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

// A pose whose coordinates are exact on both grounds.
Pose rounded(Pose pose) {
    for (int k = 0; k < 3; ++k) {
        pose.translation[k] = std::floor(pose.translation[k] * 0x1p20) * 0x1p-20;
    }
    return pose;
}

LawScene shifted_scene(const LawScene& scene, double shift, std::int32_t first_root) {
    TableGroundSettings settings;
    settings.spacing = scene.soup.spacing();
    settings.roots = scene.roots;
    settings.first_root = first_root;
    settings.origin_x = settings.origin_y = first_root == 0 ? shift : 0.0;
    return make_scene(
        scene.name,
        [&scene, shift](double x, double y) {
            // back to the exact lattice
            const double h = scene.soup.spacing();
            return scene.height(h * std::round((x - shift) / h), h * std::round((y - shift) / h));
        },
        settings);
}

TEST(LawsOfInvariance, ShiftedByWholeChunksNoBitChanges) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    const long count = count_of_cases(40, 4'000);
    for (const std::int32_t roots : {3, -1000, 78125}) {
        for (const LawScene& near : law_scenes()) {
            const double shift = 128.0 * near.soup.spacing() * roots;
            const LawScene far = shifted_scene(near, shift, roots);
            for (const LawShape& shape : law_shapes()) {
                for (long i = 0; i < count; ++i) {
                    const Pose here =
                        rounded(random_pose(random, near, shape, random.between(-0.5, 0.3)));
                    const Pose there = moved(here, {shift, shift, 0.0});
                    SCOPED_TRACE(describe(near, shape, here));
                    std::array<Contact, 64> a, b;
                    const ContactAnswer ca = find_contacts(shape.shape, here, near.ground, 0.1, a);
                    const ContactAnswer cb = find_contacts(shape.shape, there, far.ground, 0.1, b);
                    ASSERT_EQ(ca.count, cb.count);
                    ASSERT_TRUE(is_same(ca.lift, cb.lift));
                    for (std::size_t k = 0; k < ca.count; ++k) {
                        ASSERT_TRUE(is_same(a[k].depth, b[k].depth));
                        ASSERT_TRUE(is_same(a[k].normal, b[k].normal));
                    }
                    const DistanceAnswer da = signed_distance(shape.shape, here, near.ground, 2.0);
                    const DistanceAnswer db = signed_distance(shape.shape, there, far.ground, 2.0);
                    ASSERT_TRUE(is_same(da.distance, db.distance));
                    ASSERT_TRUE(is_same(da.normal, db.normal));
                    Motion motion;
                    motion.start = here;
                    motion.translation = 20.0 * random.direction();
                    motion.rotation_vector = (i % 2) * random.direction();
                    Motion far_motion = motion;
                    far_motion.start = there;
                    const CastAnswer ma = cast(shape.shape, motion, near.ground);
                    const CastAnswer mb = cast(shape.shape, far_motion, far.ground);
                    ASSERT_EQ(ma.hit, mb.hit);
                    ASSERT_TRUE(is_same(ma.fraction, mb.fraction));
                }
            }
        }
    }
}

void expect_the_same_after_a_shift(bool is_overlapping) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 1);
    Random random(kSeed + 1);
    const long count = count_of_cases(40, 4'000);
    for (const double shift : {0.3, -1234.567, 1e7 / 3.0, 1e7 + 0.1}) {
        for (const LawScene& near : law_scenes()) {
            const LawScene far = shifted_scene(near, shift, 0);
            for (const LawShape& shape : law_shapes()) {
                for (long i = 0; i < count; ++i) {
                    const double deepest = shallow_depth(shape);
                    const double lift = random.between(0.0, is_overlapping ? deepest : -0.5);
                    const Pose here = random_pose(random, near, shape, lift);
                    const Pose there = moved(here, {shift, shift, 0.0});
                    SCOPED_TRACE(describe(near, shape, here));
                    const double a = signed_distance(shape.shape, here, near.ground, 2.0).distance;
                    const double b = signed_distance(shape.shape, there, far.ground, 2.0).distance;
                    if (a < -deepest || b < -deepest) continue;
                    ASSERT_NEAR(a, b, 1e-8) << shift;
                }
            }
        }
    }
}

TEST(LawsOfInvariance, ShiftedByAnythingDistancesChangeByLessThan10Nanometres) {
    expect_the_same_after_a_shift(false);
}

TEST(LawsOfInvariance, ShiftedByAnythingDepthsChangeByLessThan10Nanometres) {
    expect_the_same_after_a_shift(true);
}

// Diagonals of cells alternate like the squares of a chess board: a reflection or a rotation by 90 degrees about a
// lattice point maps diagonals to diagonals.
void expect_the_same_turned(bool is_overlapping) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + 2);
    Random random(kSeed + 2);
    const long count = count_of_cases(60, 6'000);
    Eigen::Matrix3d quarter, mirror;
    quarter << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
    mirror << -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0;
    for (const LawScene& scene : law_scenes()) {
        const double middle = 0.5 * scene.soup.cells() * scene.soup.spacing();
        const Eigen::Vector3d centre(middle, middle, 0.0);
        for (const Eigen::Matrix3d& turn : {quarter, mirror}) {
            TableGroundSettings settings;
            settings.spacing = scene.soup.spacing();
            settings.roots = scene.roots;
            const LawScene turned = make_scene(
                scene.name,
                [&](double x, double y) {
                    const Eigen::Vector3d p =
                        turn.transpose() * (Eigen::Vector3d(x, y, 0.0) - centre) + centre;
                    return scene.height(p.x(), p.y());
                },
                settings);
            for (const LawShape& shape : law_shapes()) {
                const bool is_symmetric = shape.shape.index() < 3;  // sphere, capsule, box
                if (turn == mirror && !is_symmetric) continue;
                // a flat shape is deep at any overlap: the result then depends on rounding
                if (is_overlapping && shape.name == "flat hull") continue;
                for (long i = 0; i < count; ++i) {
                    const double deepest = shallow_depth(shape);
                    const double lift = random.between(0.0, is_overlapping ? deepest : -0.5);
                    const Pose here = random_pose(random, scene, shape, lift);
                    Pose there;
                    there.translation = turn * (here.translation - centre) + centre;
                    there.rotation = turn * here.rotation;
                    if (turn == mirror) there.rotation = there.rotation * mirror;
                    SCOPED_TRACE(describe(scene, shape, here));
                    // on a slope of 1e6 a rounding error in x is 1e6 times as large in z
                    if (scene.name != "cliffs") {
                        ASSERT_NEAR(compute_lift(shape.shape, there, turned.ground).lift, lift,
                                    1e-9);
                    }
                    const double a = signed_distance(shape.shape, here, scene.ground, 2.0).distance;
                    const double b =
                        signed_distance(shape.shape, there, turned.ground, 2.0).distance;
                    if (a < -deepest || b < -deepest) continue;
                    ASSERT_NEAR(a, b, 1e-9);
                }
            }
        }
    }
}

TEST(LawsOfInvariance, MirroredAndTurnedBy90DegreesDistancesStay) { expect_the_same_turned(false); }

TEST(LawsOfInvariance, MirroredAndTurnedBy90DegreesDepthsStay) { expect_the_same_turned(true); }

}  // namespace invariance_test
}  // namespace terrane
