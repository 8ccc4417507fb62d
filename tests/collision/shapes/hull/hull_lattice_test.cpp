// SPDX-License-Identifier: MIT
#include "collision/shapes/point_clouds.h"
#include "shapes/quickhull.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace terrane {
namespace lattice_test {

using internal::LatticePoint;

std::int64_t draw(test::Random& random, double size) {
    return static_cast<std::int64_t>(random.between(-size, size));
}

// Nearly coplanar points of all sizes, which doubles cannot distinguish.
TEST(SideOfPlane, IsExact) {
    SCOPED_TRACE("seed 31");
    test::Random random(31);
    int beyond_doubles = 0;
    for (int i = 0; i < 20'000; ++i) {
        const double size = std::ldexp(1.0, 4 + i % 50);
        LatticePoint u{};
        LatticePoint v{};
        LatticePoint a{};
        for (std::size_t k = 0; k < 3; ++k) {
            a[k] = std::int64_t{1} << 59;
            u[k] = draw(random, size);
            v[k] = draw(random, size);
        }
        const std::int64_t s = draw(random, 16.0);
        const std::int64_t t = draw(random, 16.0);
        LatticePoint b = a;
        LatticePoint c = a;
        LatticePoint d = a;
        for (std::size_t k = 0; k < 3; ++k) {
            b[k] += u[k];
            c[k] += v[k];
            d[k] += s * u[k] + t * v[k];
        }
        ASSERT_EQ(internal::side_of_plane(a, b, c, d), 0) << i;
        const Eigen::Vector3d normal = internal::triangle_normal(a, b, c);
        for (std::size_t k = 0; k < 3; ++k) {
            for (const int step : {-1, 1}) {
                LatticePoint off = d;
                off[k] += step;
                const double along = step * normal[static_cast<int>(k)];
                const int expected = along > 0.0 ? 1 : along < 0.0 ? -1 : 0;
                ASSERT_EQ(internal::side_of_plane(a, b, c, off), expected) << i;
                ASSERT_EQ(internal::side_of_plane(a, c, b, off), -expected) << i;
                const double rounded = normal.dot(internal::difference(a, off));
                if ((rounded > 0.0) - (rounded < 0.0) != expected) ++beyond_doubles;
            }
        }
    }
    EXPECT_GT(beyond_doubles, 1000);
}

// The corners of the whole lattice: the largest possible sums.
TEST(SideOfPlane, HoldsTheLargestCoordinates) {
    const std::int64_t m = std::int64_t{1} << 60;
    for (int mask = 0; mask < 4096; ++mask) {
        std::array<LatticePoint, 4> p{};
        std::array<std::array<int, 3>, 4> small{};
        for (std::size_t i = 0; i < 4; ++i) {
            for (std::size_t k = 0; k < 3; ++k) {
                small[i][k] = mask >> (3 * i + k) & 1;
                p[i][k] = m * small[i][k];
            }
        }
        const auto edge = [&](std::size_t i) {
            return Eigen::Vector3d(small[i][0] - small[0][0], small[i][1] - small[0][1],
                                   small[i][2] - small[0][2]);
        };
        const double volume = edge(1).cross(edge(2)).dot(edge(3));
        const int expected = volume > 0.5 ? 1 : volume < -0.5 ? -1 : 0;
        ASSERT_EQ(internal::side_of_plane(p[0], p[1], p[2], p[3]), expected) << mask;
    }
}

TEST(Turn, IsExact) {
    const std::int64_t m = std::int64_t{1} << 60;
    EXPECT_EQ(internal::turn({0, 0, 0}, {m, 1, 0}, {m, 1, 5}, 2), 0);
    EXPECT_EQ(internal::turn({0, 0, 0}, {m, m - 1, 0}, {m - 1, m - 2, 0}, 2), -1);
    EXPECT_EQ(internal::turn({0, 0, 0}, {0, m, m - 1}, {0, m - 1, m - 2}, 0), -1);
    EXPECT_EQ(internal::turn({0, 0, 0}, {m - 1, 0, m}, {m - 2, 0, m - 1}, 1), -1);
}

TEST(LatticePoints, AreSortedOnceEachAndWithinARoundingOfTheExtent) {
    SCOPED_TRACE("seed 32");
    test::Random random(32);
    for (int i = 0; i < 200; ++i) {
        test::Points points =
            test::transformed(test::integers(random, 50, 2), std::pow(10.0, i % 7 - 3),
                              random.rotation(), 1e4 * random.direction());
        points.push_back(points[7]);
        const internal::LatticePoints result = internal::make_lattice_points(points);
        ASSERT_LE(result.lattice.size(), points.size() - 1);
        Eigen::Vector3d low = points[0];
        for (const Eigen::Vector3d& p : points) low = low.cwiseMin(p);
        for (std::size_t k = 0; k < result.lattice.size(); ++k) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const double along = static_cast<double>(result.lattice[k][axis]) * result.spacing;
                const int a = static_cast<int>(axis);
                EXPECT_NEAR(along, result.positions[k][a] - low[a], 0x1p-53 * result.extent);
                EXPECT_GE(result.lattice[k][axis], 0);
                EXPECT_LE(result.lattice[k][axis], std::int64_t{1} << 60);
            }
            if (k > 0) {
                EXPECT_LT(result.lattice[k - 1], result.lattice[k]);
            }
        }
    }
    const internal::LatticePoints one =
        internal::make_lattice_points(test::Points(3, {-0.0, 1, 2}));
    ASSERT_EQ(one.positions.size(), 1u);
    EXPECT_FALSE(std::signbit(one.positions[0].x()));
}

}  // namespace lattice_test
}  // namespace terrane
