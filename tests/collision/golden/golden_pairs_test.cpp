// SPDX-License-Identifier: MIT
// Bits of hulls and of queries of all pairs of shapes. They may change only with an entry in CHANGELOG.md; a failure
// prints the new hash. Built with both compilers at several optimisation levels, which must agree.
#include "support/hash.h"
#include "support/random.h"

#include <terrane/collision/shape_pairs.h>

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace terrane {
namespace golden_pairs_test {

using test::Hash;
using test::Random;

// Not Eigen's product, whose order of operations may change.
Eigen::Vector3d direction(Random& random) {
    for (;;) {
        const double x = random.between(-1, 1), y = random.between(-1, 1),
                     z = random.between(-1, 1);
        const double square = x * x + y * y + z * z;
        if (square < 0.01 || square > 1.0) continue;
        const double size = std::sqrt(square);
        return {x / size, y / size, z / size};
    }
}

// One draw per statement: the order of evaluation of operands is unspecified.
Eigen::Vector3d vector_up_to(Random& random, double longest) {
    const double size = random.between(0.0, longest);
    return size * direction(random);
}

Pose random_pose(Random& random, double far) {
    Motion turn;
    turn.rotation_vector = vector_up_to(random, 3.1);
    Pose pose;
    pose.rotation = turn.at(1.0).rotation;
    pose.translation = vector_up_to(random, far);
    return pose;
}

void add(Hash& hash, const Eigen::Vector3d& v) {
    for (int i = 0; i < 3; ++i) hash.add(v[i]);
}

ConvexHull random_hull(Random& random, int count, double flat) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < count; ++i) {
        points.push_back(direction(random));
        points.back().z() *= flat;
    }
    return ConvexHull::create(points).value();
}

std::vector<ConvexHull> make_hulls() {
    Random random(41);
    std::vector<ConvexHull> hulls;
    for (const int count : {1, 2, 3, 4, 8, 20, 100, 1000}) {
        hulls.push_back(random_hull(random, count, 1.0));
        hulls.push_back(random_hull(random, count, 0.0));
    }
    // A rotated grid: many collinear and coplanar points, none exactly.
    std::vector<Eigen::Vector3d> grid;
    const Pose pose = random_pose(random, 1.0);
    for (int i = 0; i < 125; ++i) {
        const double x = i % 5, y = i / 5 % 5, z = i / 25;
        const Eigen::Matrix3d& r = pose.rotation;
        grid.emplace_back((r(0, 0) * x + r(0, 1) * y) + r(0, 2) * z,
                          (r(1, 0) * x + r(1, 1) * y) + r(1, 2) * z,
                          (r(2, 0) * x + r(2, 1) * y) + r(2, 2) * z);
    }
    hulls.push_back(ConvexHull::create(grid).value());
    return hulls;
}

TEST(GoldenHulls, AreTheSameWithEveryCompilerAtEveryLevel) {
    Hash hash;
    Random random(42);
    for (const ConvexHull& hull : make_hulls()) {
        for (const Eigen::Vector3d& vertex : hull.vertices()) add(hash, vertex);
        hash.add(hull.face_count());
        hash.add(bounding_radius(hull));
        hash.add(smallest_half_extent(hull));
        for (int i = 0; i < 20; ++i) hash.add(support_distance(hull, direction(random)));
    }
    EXPECT_EQ(hash.value(), 0x7f52b77af9f94df3u) << std::hex << hash.value();
}

std::vector<Shape> make_shapes() {
    Random random(43);
    std::vector<CompoundPart> parts(4);
    parts[0].shape = Box{{0.6, 0.2, 0.3}};
    parts[1].shape = Sphere{0.4};
    parts[2].shape = Capsule{0.15, 0.5};
    parts[3].shape = random_hull(random, 12, 0.5);
    for (CompoundPart& part : parts) part.body_from_part = random_pose(random, 0.8);
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 9; ++i) {
        corners.emplace_back(i % 3 - 1.0, i / 3 - 1.0, random.between(-0.2, 0.2));
    }
    const std::vector<std::array<std::uint32_t, 3>> triangles{
        {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {3, 4, 7}, {3, 7, 6}, {4, 5, 8}, {4, 8, 7}};
    return {Sphere{0.5},
            Capsule{0.3, 0.6},
            Box{{0.7, 0.4, 0.5}},
            random_hull(random, 20, 0.6),
            random_hull(random, 200, 1.0),
            Compound::create(parts).value(),
            Compound::from_triangles(corners, triangles).value()};
}

void add_contacts(Hash& hash, std::span<const PairContact> contacts) {
    hash.add(contacts.size());
    for (const PairContact& contact : contacts) {
        add(hash, contact.point_world);
        add(hash, contact.normal);
        hash.add(contact.depth);
        hash.add(contact.feature_a.first);
        hash.add(contact.feature_a.second);
        hash.add(contact.feature_b.first);
        hash.add(contact.feature_b.second);
        hash.add(contact.part_a);
        hash.add(contact.part_b);
    }
}

// All queries of two shapes.
void add_answers(Hash& hash, const Shape& a, const Motion& motion_a, const Shape& b,
                 const Motion& motion_b) {
    const Pose& pose_a = motion_a.start;
    const Pose& pose_b = motion_b.start;
    hash.add(test_contact(a, pose_a, b, pose_b).is_touching);
    std::array<PairContact, 96> contacts;
    const PairContactAnswer found = find_contacts(a, pose_a, b, pose_b, 0.05, contacts);
    add_contacts(hash, std::span(contacts).first(found.count));
    const PairDistanceAnswer distance = signed_distance(a, pose_a, b, pose_b);
    hash.add(distance.distance);
    add(hash, distance.normal);
    add(hash, distance.point_a_world);
    add(hash, distance.point_b_world);
    const PseudodistanceAnswer pseudo = pseudodistance(a, pose_a, b, pose_b);
    hash.add(pseudo.pseudodistance);
    add(hash, pseudo.normal);
    for (const bool skips : {false, true}) {
        CastSettings settings;
        settings.skip_separating = skips;
        const PairCastAnswer met = cast(a, motion_a, b, motion_b, settings);
        hash.add(met.hit);
        hash.add(met.fraction);
        hash.add(met.started_in_contact);
        add_contacts(hash, std::span(met.contacts).first(met.count));
    }
    const ShapeRayAnswer ray = cast_ray(a, pose_a, pose_b.translation, pose_a.translation);
    hash.add(ray.hit);
    hash.add(ray.fraction);
    add(hash, ray.point_world);
    add(hash, ray.normal);
    hash.add(ray.part);
}

TEST(GoldenPairs, AnswerTheSameWithEveryCompilerAtEveryLevel) {
    Hash hash;
    Random random(44);
    const std::vector<Shape> shapes = make_shapes();
    for (const Shape& a : shapes) {
        for (const Shape& b : shapes) {
            for (int i = 0; i < 6; ++i) {
                Motion motion_a, motion_b;
                motion_a.start = random_pose(random, 1.0);
                motion_b.start = random_pose(random, 1.6);
                if (i % 5 == 0) motion_b.start.rotation = motion_a.start.rotation;
                motion_a.translation = 4.0 * direction(random);
                if (i % 2 == 0) motion_a.rotation_vector = 2.0 * direction(random);
                if (i % 3 == 0) motion_b.rotation_vector = direction(random);
                add_answers(hash, a, motion_a, b, motion_b);
            }
        }
    }
    EXPECT_EQ(hash.value(), 0x0f26b0728dd586c7u) << std::hex << hash.value();
}

}  // namespace golden_pairs_test
}  // namespace terrane
