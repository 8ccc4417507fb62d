// SPDX-License-Identifier: MIT
#include "collision/proxy/proxy_meshes.h"
#include "shapes/proxy_cells.h"

#include <terrane/collision/collision_proxy.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace terrane {
namespace {

using internal::ProxyPart;
using internal::SolidMesh;
using test::NamedMesh;

constexpr std::size_t kMaxParts = 3;

std::vector<ProxyPart> cut(const SolidMesh& solid, double error) {
    return internal::cut_to_parts(solid, error, 4 * kMaxParts).value();
}

TEST(ErrorReach, IsNeverAboveTheDistanceThatAProxyHas) {
    int known = 0;
    for (const NamedMesh& named : test::proxy_meshes()) {
        const SolidMesh solid = internal::make_solid_mesh(named.mesh);
        for (const bool is_tiny : {true, false}) {
            const double error = (is_tiny ? 1e-9 : 0.05) * solid.extent;
            const double least = internal::least_error(solid, cut(solid, error));
            known += least > 0.0 ? 1 : 0;
            // few vertices move hulls away, inwards
            const CollisionProxySettings settings{.proxy_error = error,
                                                  .max_parts = kMaxParts,
                                                  .max_hull_vertices = is_tiny ? 8u : 64u};
            const CollisionProxy proxy = make_collision_proxy(named.mesh, settings).value();
            EXPECT_LE(least, proxy.distance_m) << named.name << " within " << error;
        }
    }
    EXPECT_GE(known, 4);
}

TEST(ErrorReach, IsRefusedByItsValueAndTheLimitBeforePiecesAreMerged) {
    const TriangleMesh rock = test::rock_mesh(10, 0.3, 1);
    const SolidMesh solid = internal::make_solid_mesh(rock);
    const std::vector<ProxyPart> parts = cut(solid, 1e-9);
    const double least = internal::least_error(solid, parts);
    EXPECT_GT(least, 1e-3);
    // work of the cuts: with a precision of a quarter of the error every piece would have 20,000 sub-triangles
    std::size_t pieces = 0;
    for (const ProxyPart& part : parts) pieces += part.distance.pieces;
    EXPECT_LT(pieces, 3000 * parts.size());
    const Result<CollisionProxy> refused = make_collision_proxy(
        rock, {.proxy_error = 1e-9, .max_parts = kMaxParts, .must_be_within_error = true});
    ASSERT_FALSE(refused);
    const std::string start = "a proxy of 3 hulls needs an error of more than ";
    const std::string& message = refused.error().message;
    ASSERT_EQ(message.substr(0, start.size()), start);
    EXPECT_NE(message.find(" m, got 1e-09"), std::string::npos) << message;
    EXPECT_NEAR(std::atof(message.c_str() + start.size()), least, 1e-4 * least);
}

TEST(ErrorReach, IsSaidOfProxiesThatTheLimitOfVerticesKeepsAway) {
    const TriangleMesh ball = test::rock_mesh(10, 0.0, 1);
    const CollisionProxySettings settings{
        .proxy_error = 1e-4, .max_hull_vertices = 8, .must_be_within_error = true};
    const Result<CollisionProxy> refused = make_collision_proxy(ball, settings);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message.find("a proxy of 64 hulls needs an error of at least "), 0u)
        << refused.error().message;
}

TEST(ErrorReach, ChangesNothingWhereTheErrorIsReached) {
    const TriangleMesh l = test::l_mesh();
    for (const double error : {0.05, 0.2}) {
        const CollisionProxy one = make_collision_proxy(l, {.proxy_error = error}).value();
        const Result<CollisionProxy> other =
            make_collision_proxy(l, {.proxy_error = error, .must_be_within_error = true});
        ASSERT_TRUE(other) << other.error().message;
        EXPECT_EQ(other->distance_m, one.distance_m);
        EXPECT_EQ(other->shape.parts().size(), one.shape.parts().size());
    }
}

}  // namespace
}  // namespace terrane
