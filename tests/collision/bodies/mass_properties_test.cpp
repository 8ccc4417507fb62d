// SPDX-License-Identifier: MIT
#include "body_cases.h"
#include "support/random.h"
#include "world/solver/solver_body.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace terrane::internal {
namespace mass_properties_test {

using test::all_shapes;
using test::name_of;
using test::Random;

Pose random_pose(Random& random, double reach) {
    Eigen::Vector3d turn, place;
    for (int axis = 0; axis < 3; ++axis) turn[axis] = random.between(-3, 3);
    for (int axis = 0; axis < 3; ++axis) place[axis] = random.between(-reach, reach);
    return {Motion{{}, Eigen::Vector3d::Zero(), turn}.at(1.0).rotation, place};
}

ConvexHull hull_of_box(const Eigen::Vector3d& half, const Pose& pose) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 8; ++i) {
        points.push_back(pose * Eigen::Vector3d((i & 1 ? 1 : -1) * half.x(),
                                                (i & 2 ? 1 : -1) * half.y(),
                                                (i & 4 ? 1 : -1) * half.z()));
    }
    return ConvexHull::create(points).value();
}

Eigen::Vector3d sorted(Eigen::Vector3d v) {
    std::sort(v.begin(), v.end());
    return v;
}

void expect_inertia(const Shape& shape, double mass, const Eigen::Vector3d& wanted,
                    double accuracy) {
    const Eigen::Vector3d inertia = sorted(make_mass_properties(shape, mass).inertia);
    EXPECT_LT((inertia - sorted(wanted)).norm(), accuracy * wanted.norm())
        << inertia.transpose() << " instead of " << sorted(wanted).transpose();
}

/// Inertia tensor about the shape's origin, body frame, by counting lattice points inside the shape.
struct Counted {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Matrix3d about_centre = Eigen::Matrix3d::Zero();  // of 1 kg
};
Counted count_points(const Shape& shape, int steps) {
    const double radius = bounding_radius(shape);
    std::vector<Eigen::Vector3d> inside;
    for (int i = 0; i < steps * steps * steps; ++i) {
        const Eigen::Vector3d cell(i % steps, i / steps % steps, i / steps / steps);
        const Eigen::Vector3d point = radius * (2.0 * (cell.array() + 0.5) / steps - 1.0).matrix();
        if (test_contact(Sphere{0.0}, {Eigen::Matrix3d::Identity(), point}, shape, {})
                .is_touching) {
            inside.push_back(point);
        }
    }
    Counted counted;
    for (const Eigen::Vector3d& p : inside) {
        counted.centre += p / static_cast<double>(inside.size());
    }
    for (const Eigen::Vector3d& p : inside) {
        const Eigen::Vector3d d = p - counted.centre;
        counted.about_centre +=
            (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose()) /
            static_cast<double>(inside.size());
    }
    return counted;
}

TEST(MassProperties, AreThoseOfAllPointsOfTheShape) {
    constexpr double kAccuracy = 0.01;  // of a lattice of 60 points along each axis
    for (const Shape& shape : {Shape(test::make_wedge()), Shape(Capsule{0.4, 0.8})}) {
        const Counted counted = count_points(shape, 60);
        const CentredShape centred = make_centred(shape).value();
        const double size = bounding_radius(shape);
        const Eigen::Matrix3d& axes = centred.body_from_centred.rotation;
        EXPECT_LT((centred.body_from_centred.translation - counted.centre).norm(),
                  kAccuracy * size);
        const MassProperties mass = make_mass_properties(centred.shape, 2.0);
        const Eigen::Matrix3d tensor = axes * mass.inertia.asDiagonal() * axes.transpose();
        EXPECT_LT((tensor - 2.0 * counted.about_centre).norm(), kAccuracy * tensor.norm())
            << name_of(shape);
        EXPECT_GT(axes.determinant(), 0.999);
        EXPECT_EQ(mass.inverse_mass, 0.5);
    }
}

TEST(MassProperties, OfAHullOfABoxAreTheBoxesHoweverItIsPlaced) {
    const std::uint64_t seed = 31;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    for (int run = 0; run < 200; ++run) {
        Eigen::Vector3d half;
        for (int axis = 0; axis < 3; ++axis) half[axis] = random.between(0.01, 3.0);
        const Pose pose = random_pose(random, run % 2 == 0 ? 0.0 : 50.0);
        const ConvexHull hull = hull_of_box(half, pose);
        const CentredShape centred = make_centred(hull).value();
        expect_inertia(centred.shape, 7.0, make_mass_properties(Box{half}, 7.0).inertia, 1e-9);
        EXPECT_LT((centred.body_from_centred.translation - pose.translation).norm(), 1e-11);
        // The same set of points in the world.
        const Pose world = random_pose(random, 1000.0);
        const Pose inner = to_centred(world, centred.body_from_centred);
        const PairDistanceAnswer apart =
            signed_distance(hull, world, centred.shape,
                            {inner.rotation, inner.translation + Eigen::Vector3d(200.0, 0.0, 0.0)});
        const PairDistanceAnswer wanted =
            signed_distance(hull, world, hull,
                            {world.rotation, world.translation + Eigen::Vector3d(200.0, 0.0, 0.0)});
        EXPECT_NEAR(apart.distance, wanted.distance, 1e-9);
        const Pose back = from_centred(inner, centred.body_from_centred);
        EXPECT_LT((back.rotation - world.rotation).norm(), 1e-12);
        EXPECT_LT((back.translation - world.translation).norm(), 1e-10);
    }
}

TEST(MassProperties, OfPartsThatMakeABoxAreTheBoxes) {
    const Eigen::Vector3d half(0.5, 1.0, 2.0);
    const std::uint64_t seed = 32;
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    for (int run = 0; run < 50; ++run) {
        const Pose whole = random_pose(random, 3.0);
        std::vector<CompoundPart> parts;
        for (int i = 0; i < 8; ++i) {
            const Eigen::Vector3d place((i & 1 ? 0.5 : -0.5) * half.x(),
                                        (i & 2 ? 0.5 : -0.5) * half.y(),
                                        (i & 4 ? 0.5 : -0.5) * half.z());
            const Pose pose{whole.rotation, whole * place};
            if (i % 2 == 0) {
                parts.push_back({Box{0.5 * half}, pose});
            } else {
                parts.push_back({hull_of_box(0.5 * half, pose), {}});
            }
        }
        // A plate has no mass beside solid parts.
        parts.push_back({Box{{4.0, 4.0, 0.0}}, whole});
        const CentredShape centred = make_centred(Compound::create(parts).value()).value();
        expect_inertia(centred.shape, 3.0, make_mass_properties(Box{half}, 3.0).inertia, 1e-9);
        EXPECT_LT((centred.body_from_centred.translation - whole.translation).norm(), 1e-12);
    }
}

TEST(MassProperties, OfPlatesRodsAndPointsAreFinite) {
    const Pose turned = [] {
        Random random(33);
        return random_pose(random, 2.0);
    }();
    const CentredShape plate = make_centred(hull_of_box({1.0, 2.0, 0.0}, turned)).value();
    expect_inertia(plate.shape, 3.0, make_mass_properties(Box{{1.0, 2.0, 0.0}}, 3.0).inertia, 1e-9);
    const CentredShape rod = make_centred(hull_of_box({0.0, 2.0, 0.0}, turned)).value();
    const MassProperties of_rod = make_mass_properties(rod.shape, 3.0);
    expect_inertia(rod.shape, 3.0, {4.0, 4.0, 0.0}, 1e-9);
    EXPECT_EQ(of_rod.inverse_inertia.minCoeff(), 0.0);
    EXPECT_LT(of_rod.inverse_inertia.maxCoeff(), 1.0);
    const CentredShape point = make_centred(hull_of_box({0.0, 0.0, 0.0}, turned)).value();
    EXPECT_EQ(make_mass_properties(point.shape, 3.0).inverse_inertia.norm(), 0.0);
    EXPECT_LT((point.body_from_centred.translation - turned.translation).norm(), 1e-12);
    // The triangles of a closed mesh: a shell.
    const double third = 1.0 / 3.0;
    const std::vector<Eigen::Vector3d> corners{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const std::vector<std::array<std::uint32_t, 3>> faces{
        {0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    const Compound shell = Compound::from_triangles(corners, faces).value();
    const CentredShape centred = make_centred(shell).value();
    EXPECT_LT(centred.body_from_centred.translation.norm(), 1e-15);
    // Of each face: the centre at a distance of 1/sqrt(3), and its own spread of 8/12 along its sides.
    const double spread = third * (third + 8.0 / 12.0);
    EXPECT_NEAR(make_mass_properties(centred.shape, 1.0).inertia[0], 2.0 * spread, 1e-12);
}

TEST(MassProperties, ShareWhatIsCentredAlready) {
    const ConvexHull hull = hull_of_box({1.0, 2.0, 0.5}, {});
    const CentredShape centred = make_centred(hull).value();
    EXPECT_EQ(std::get<ConvexHull>(centred.shape).vertices().data(), hull.vertices().data());
    for (const Shape& shape : all_shapes()) {
        const CentredShape once = make_centred(shape).value();
        const CentredShape twice = make_centred(once.shape).value();
        EXPECT_TRUE(twice.body_from_centred.translation.isZero(1e-12)) << name_of(shape);
        const Pose world = [] {
            Random random(34);
            return random_pose(random, 10.0);
        }();
        const Pose same = to_centred(world, make_centred(Sphere{1.0}).value().body_from_centred);
        EXPECT_EQ(same.rotation, world.rotation);
        EXPECT_EQ(same.translation, world.translation);
    }
}

}  // namespace mass_properties_test
}  // namespace terrane::internal
