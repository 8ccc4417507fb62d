// SPDX-License-Identifier: MIT
#include "program/geometry.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::tools {
namespace quaternion_test {

TEST(Quaternion, TurnsXToYByAQuarterAboutZ) {
    const Eigen::Matrix3d rotation = matrix_from_quaternion({1.0, 0.0, 0.0, 1.0});
    EXPECT_LT((rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST(Quaternion, ComesBackFromItsMatrix) {
    test::Random random(5);
    for (int i = 0; i < 10'000; ++i) {
        Quaternion q{};
        double square = 0.0;
        for (double& component : q) {
            // many zeros, so that each component is sometimes the largest
            component = random.below(3) == 0 ? 0.0 : random.between(-1.0, 1.0);
            square += component * component;
        }
        if (square < 1e-6) continue;
        for (double& component : q) component /= std::sqrt(square);
        const Quaternion back = quaternion_from_matrix(matrix_from_quaternion(q));
        double along = 0.0;
        for (std::size_t k = 0; k < 4; ++k) along += q[k] * back[k];
        EXPECT_NEAR(std::abs(along), 1.0, 1e-14) << "seed 5, round " << i;
        EXPECT_GE(back[0], 0.0);
    }
}

}  // namespace quaternion_test
}  // namespace terrane::tools
