// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace triangle_distance_test {

using test::Random;
using Vector = Eigen::Matrix<long double, 3, 1>;

// The nearest of all points of the edges, and of the foot on the plane where it is inside, in long double.
long double oracle(const Eigen::Vector3d& point, const Corners& corners) {
    const Vector p = point.cast<long double>();
    const std::array<Vector, 3> c = {corners[0].cast<long double>(), corners[1].cast<long double>(),
                                     corners[2].cast<long double>()};
    long double least = std::numeric_limits<long double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
        const Vector edge = c[(i + 1) % 3] - c[i];
        const long double square = edge.dot(edge);
        const long double t =
            square > 0 ? std::clamp<long double>((p - c[i]).dot(edge) / square, 0, 1) : 0;
        least = std::min(least, (p - c[i] - t * edge).norm());
    }
    const Vector normal = (c[1] - c[0]).cross(c[2] - c[0]);
    if (!(normal.norm() > 0)) return least;
    for (std::size_t i = 0; i < 3; ++i) {
        if (normal.dot((c[(i + 1) % 3] - c[i]).cross(p - c[i])) < 0) return least;
    }
    return std::min(least, std::abs(normal.dot(p - c[0])) / normal.norm());
}

// From triangles with all sides alike to needles with no area but for rounding.
TEST(TriangleDistance, IsNotBelowTheDistanceAndNearIt) {
    Random random(31);
    for (int i = 0; i < 200'000; ++i) {
        const Eigen::Vector3d a = 10.0 * random.direction();
        const Eigen::Vector3d b = 10.0 * random.direction();
        const double share = random.between(-1.0, 2.0);
        const double shape = std::exp2(random.between(-60.0, 0.0));
        const Eigen::Vector3d c = a + share * (b - a) + 10.0 * shape * random.direction();
        const Corners triangle = {a, b, c};
        Eigen::Vector3d p = a + random.between(-3.0, 3.0) * (b - a);
        const double aside = random.between(0.0, 10.0) * std::exp2(random.between(-40.0, 0.0));
        p += aside * random.direction();
        const auto exact = static_cast<double>(oracle(p, triangle));
        const double answer = distance_to_triangle(p, triangle);
        const double size = std::max({(p - a).norm(), (b - a).norm(), (c - a).norm()});
        ASSERT_GE(answer, exact - 0x1p-48 * size) << i << " shape " << shape;
        // the rounding of a ratio of 1e-9, and half the height of a needle that counts as its edges
        ASSERT_LE(answer, exact + 0x1p-17 * size) << i << " shape " << shape;
    }
}

}  // namespace triangle_distance_test
}  // namespace terrane::internal
