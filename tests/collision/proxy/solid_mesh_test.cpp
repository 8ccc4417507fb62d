// SPDX-License-Identifier: MIT
#include "collision/proxy/proxy_meshes.h"
#include "collision/proxy/proxy_oracle.h"
#include "shapes/proxy_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace terrane {
namespace {

TEST(SolidMesh, InsideAndDistanceAgreeWithSlowOnes) {
    for (const auto& [name, mesh] : test::proxy_meshes()) {
        const internal::SolidMesh solid = internal::make_solid_mesh(mesh);
        EXPECT_TRUE(solid.is_closed) << name;
        const std::uint64_t seed = 5;
        SCOPED_TRACE(name + ", seed " + std::to_string(seed));
        std::mt19937_64 random(seed);
        std::size_t inside = 0;
        Eigen::Vector3d low = mesh.positions[0], high = low;
        for (const Eigen::Vector3d& p : mesh.positions) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
        for (int i = 0; i < 500; ++i) {
            Eigen::Vector3d p;
            for (int axis = 0; axis < 3; ++axis) {
                // Half of the points share coordinates with vertices: rays meet edges and vertices.
                p[axis] = i % 2 == 0 ? low[axis] + (high[axis] - low[axis]) *
                                                       static_cast<double>(random() >> 11) * 0x1p-53
                                     : mesh.positions[random() % mesh.positions.size()][axis];
            }
            double slow = 1e300;
            for (const auto& t : mesh.triangles) {
                slow =
                    std::min(slow, test::slow_distance(mesh.positions[t[0]], mesh.positions[t[1]],
                                                       mesh.positions[t[2]], p));
            }
            EXPECT_NEAR(internal::find_nearest(solid, p).distance, slow, 1e-12);
            if (slow < 1e-9) continue;
            const bool is_slow_inside = std::abs(test::solid_angle_winding(mesh, p)) > 0.5;
            inside += is_slow_inside ? 1 : 0;
            EXPECT_EQ(internal::is_inside(solid, p), is_slow_inside) << p.transpose();
        }
        EXPECT_GT(inside, 5U);
    }
}

}  // namespace
}  // namespace terrane
