// SPDX-License-Identifier: MIT
#include "support/random.h"

#include <terrane/collision/ground_queries.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>

namespace terrane {
namespace rotation_test {

TEST(MotionAt, AgreesWithTheCLibrary) {
    SCOPED_TRACE("seed 7");
    test::Random random(7);
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d axis = random.direction();
        const double angle = random.between(0.0, i % 2 == 0 ? 6.3 : 1000.0);
        Motion motion;
        motion.rotation_vector = angle * axis;
        const double t = random.between(0.0, 1.0);
        const Eigen::Matrix3d expected =
            Eigen::AngleAxisd(t * motion.rotation_vector.norm(), axis).toRotationMatrix();
        const double rounding = 2e-15 + 3e-16 * angle;
        EXPECT_LE((motion.at(t).rotation - expected).cwiseAbs().maxCoeff(), rounding) << angle;
    }
}

TEST(MotionAt, StaysOrthonormal) {
    SCOPED_TRACE("seed 8");
    test::Random random(8);
    for (int i = 0; i < 500; ++i) {
        Motion motion;
        motion.start.rotation = random.rotation();
        motion.rotation_vector = random.between(0.0, 30.0) * random.direction();
        const Eigen::Matrix3d r = motion.at(0.7).rotation;
        EXPECT_LE((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15);
        EXPECT_GT(r.determinant(), 0.0);
    }
}

// As accurate near orthonormal as far from it: the method changes at 1e-8.
TEST(Orthonormalized, KeepsTheFirstAxisAndThePlaneOfTheSecond) {
    SCOPED_TRACE("seed 11");
    test::Random random(11);
    for (const double off : {0.0, 1e-16, 1e-12, 1e-9, 4.9e-9, 5.1e-9, 1e-8, 1e-6, 0.1, 10.0}) {
        for (int i = 0; i < 200; ++i) {
            const Eigen::Matrix3d exact = random.rotation();
            Eigen::Matrix3d skewed = exact;
            for (int column = 0; column < 3; ++column) {
                skewed.col(column) *= 1.0 + random.between(0.0, off);
            }
            skewed.col(1) += random.between(-off, off) * exact.col(0);
            skewed.col(2) += off * random.direction();
            EXPECT_LE((orthonormalized(skewed) - exact).cwiseAbs().maxCoeff(), 2e-15 * (1.0 + off))
                << off;
        }
    }
}

TEST(RotationVectorBetween, IsUndoneByAMotion) {
    SCOPED_TRACE("seed 9");
    test::Random random(9);
    for (int i = 0; i < 2000; ++i) {
        const double angle = i % 3 == 0   ? 3.14159265358979
                             : i % 3 == 1 ? 1e-9
                                          : random.between(0.0, 3.14);
        Motion there;
        there.start.rotation = random.rotation();
        there.rotation_vector = angle * random.direction();
        const Eigen::Matrix3d to = there.at(1.0).rotation;
        Motion again = there;
        again.rotation_vector = rotation_vector_between(there.start.rotation, to);
        EXPECT_LE(again.rotation_vector.norm(), 3.1415926535897936);
        EXPECT_LE((again.at(1.0).rotation - to).cwiseAbs().maxCoeff(), 5e-15);
    }
}

TEST(CheckShape, NamesTheFieldAndTheValue) {
    EXPECT_TRUE(check(Sphere{0.0}));
    EXPECT_TRUE(check(Box{{0.0, 1e5, 0.0}}));
    const Result<void> sphere = check(Sphere{-1.5});
    ASSERT_FALSE(sphere);
    EXPECT_EQ(sphere.error().message, "sphere radius must be 0 to 1e5 m, got -1.5");
    EXPECT_FALSE(check(Capsule{0.5, std::nan("")}));
    EXPECT_FALSE(check(Box{{1.0, 1.0, 1e6}}));
}

TEST(SupportDistance, IsTheLargestOverTheShape) {
    const Eigen::Vector3d n = Eigen::Vector3d(1.0, 2.0, 2.0) / 3.0;
    EXPECT_DOUBLE_EQ(support_distance(Sphere{0.5}, n), 0.5);
    EXPECT_DOUBLE_EQ(support_distance(Capsule{0.5, 3.0}, n), 2.5);
    EXPECT_DOUBLE_EQ(support_distance(Box{{3.0, 1.5, 0.75}}, n), 2.5);
    EXPECT_DOUBLE_EQ(default_contact_tolerance(Sphere{0.05}), 0.005);
    EXPECT_DOUBLE_EQ(default_contact_tolerance(Box{{1.0, 2.0, 3.0}}), 0.01);
}

}  // namespace rotation_test
}  // namespace terrane
