// SPDX-License-Identifier: MIT
#include "collision/shapes/proxy_meshes.h"
#include "shapes/proxy_parts.h"
#include "support/random.h"

#include <terrane/collision/world.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

namespace terrane {
namespace {

using namespace test;

double extent_of(const TriangleMesh& mesh) {
    Eigen::Vector3d low = mesh.positions[0], high = low;
    for (const Eigen::Vector3d& p : mesh.positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    return (high - low).maxCoeff();
}

std::uint64_t bits_of(const Compound& compound) {
    Hash hash;
    for (const CompoundPart& part : compound.parts()) {
        for (const Eigen::Vector3d& p : std::get<ConvexHull>(part.shape).vertices()) {
            for (const double x : p) hash.add(x);
        }
    }
    return hash.value();
}

class ProxyOfMesh : public testing::TestWithParam<std::size_t> {
protected:
    NamedMesh named = proxy_meshes()[GetParam()];
};

TEST_P(ProxyOfMesh, DistanceHoldsAgainstDenseSampling) {
    for (const double share : {0.03, 0.1, 0.3}) {
        const Result<CollisionProxy> proxy =
            make_collision_proxy(named.mesh, {.proxy_error = share * extent_of(named.mesh)});
        ASSERT_TRUE(proxy) << proxy.error().message;
        const std::uint64_t seed = GetParam() + 10;
        SCOPED_TRACE(named.name + ", share " + std::to_string(share) + ", seed " +
                     std::to_string(seed));
        const ProxyDistance measured = measure_proxy(named.mesh, *proxy, 3000, seed);
        const double rounding = 1e-9 * extent_of(named.mesh);
        EXPECT_LE(measured.mesh_to_proxy, proxy->mesh_to_proxy_m + rounding);
        EXPECT_LE(measured.proxy_to_mesh, proxy->proxy_to_mesh_m + rounding);
        EXPECT_EQ(proxy->distance_m, std::max(proxy->mesh_to_proxy_m, proxy->proxy_to_mesh_m));
        EXPECT_EQ(proxy->is_within_error,
                  proxy->distance_m <= share * extent_of(named.mesh) * (1.0 + 1e-6));
        // The bound is tight where it is not small: samples reach most of it.
        if (proxy->distance_m > 0.05 * extent_of(named.mesh)) {
            EXPECT_GE(std::max(measured.mesh_to_proxy, measured.proxy_to_mesh),
                      0.8 * proxy->distance_m);
        }
    }
}

TEST_P(ProxyOfMesh, ALargeErrorGivesOneHullAndZeroTheTriangles) {
    const Result<CollisionProxy> one = make_collision_proxy(named.mesh, {.proxy_error = 1000.0});
    ASSERT_TRUE(one) << one.error().message;
    EXPECT_EQ(one->shape.parts().size(), 1U);
    EXPECT_EQ(one->kind, CollisionProxyKind::hulls);
    EXPECT_GT(smallest_half_extent(one->shape), 0.0);
    const Result<CollisionProxy> all = make_collision_proxy(named.mesh, {.proxy_error = 0.0});
    ASSERT_TRUE(all) << all.error().message;
    EXPECT_EQ(all->kind, CollisionProxyKind::surface);
    EXPECT_EQ(all->shape.parts().size(), named.mesh.triangles.size());
}

TEST_P(ProxyOfMesh, InsideOutIsAsSolidAndRepeatsItsBits) {
    TriangleMesh turned = named.mesh;
    for (auto& t : turned.triangles) std::swap(t[1], t[2]);
    const CollisionProxySettings settings{.proxy_error = 0.1 * extent_of(named.mesh)};
    const Result<CollisionProxy> one = make_collision_proxy(named.mesh, settings);
    const Result<CollisionProxy> other = make_collision_proxy(turned, settings);
    ASSERT_TRUE(one && other);
    EXPECT_EQ(other->kind, CollisionProxyKind::hulls);
    EXPECT_NEAR(other->mesh_volume, one->mesh_volume, 1e-12);
    EXPECT_TRUE(other->is_within_error);
    EXPECT_EQ(bits_of(one->shape), bits_of(make_collision_proxy(named.mesh, settings)->shape));
    World world = World::create({}).value();
    EXPECT_TRUE(world.add(BodySettings{.shape = one->shape}, {}));
}

INSTANTIATE_TEST_SUITE_P(All, ProxyOfMesh, testing::Range<std::size_t>(0, 8),
                         [](const auto& each) { return proxy_meshes()[each.param].name; });

TEST(CollisionProxy, AnLIsTwoBoxes) {
    const Result<CollisionProxy> proxy = make_collision_proxy(l_mesh(), {});
    ASSERT_TRUE(proxy);
    EXPECT_EQ(proxy->shape.parts().size(), 2U);
    EXPECT_NEAR(proxy->parts_volume, 3.0, 1e-12);
    EXPECT_NEAR(proxy->mesh_volume, 3.0, 1e-12);
}

TEST(CollisionProxy, AConvexMeshIsOneExactHullWhateverTheError) {
    const TriangleMesh box = box_mesh({-1.0, 0.0, 2.0}, {3.0, 1.0, 4.0});
    for (const double error : {0.0, 0.01, 10.0}) {
        const Result<CollisionProxy> proxy = make_collision_proxy(box, {.proxy_error = error});
        ASSERT_TRUE(proxy);
        ASSERT_EQ(proxy->shape.parts().size(), 1U);
        EXPECT_EQ(proxy->kind, CollisionProxyKind::hulls);
        EXPECT_NEAR(proxy->parts_volume, 4.0 * 1.0 * 2.0, 1e-9);
        EXPECT_LE(proxy->distance_m, 1e-8);
    }
}

TEST(CollisionProxy, ComponentsFarApartAreTwoHulls) {
    TriangleMesh mesh = box_mesh({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0});
    const TriangleMesh other = box_mesh({5.0, 0.0, 0.0}, {6.0, 1.0, 1.0});
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    for (auto t : other.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, {.proxy_error = 0.1});
    ASSERT_TRUE(proxy);
    EXPECT_EQ(proxy->shape.parts().size(), 2U);
    EXPECT_NEAR(proxy->parts_volume, 2.0, 1e-9);
}

TEST(CollisionProxy, AnOpenMeshIsASurfaceWithinItsDistance) {
    TriangleMesh mesh = torus_mesh(24, 12, 1.0, 0.3);
    mesh.triangles.pop_back();
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, {.proxy_error = 0.1});
    ASSERT_TRUE(proxy);
    EXPECT_EQ(proxy->kind, CollisionProxyKind::open);
    EXPECT_EQ(proxy->mesh_volume, 0.0);
    EXPECT_LT(proxy->shape.parts().size(), mesh.triangles.size());
    EXPECT_LE(proxy->distance_m, 0.1 + 1e-8);
    const ProxyDistance measured = measure_proxy(mesh, *proxy, 3000, 7);
    EXPECT_LE(measured.mesh_to_proxy, proxy->distance_m);
    EXPECT_LE(measured.proxy_to_mesh, proxy->distance_m);
}

TEST(CollisionProxy, CornersOfOneTriangleEachAreWelded) {
    const TriangleMesh mesh = l_mesh();
    TriangleMesh soup;
    for (const auto& t : mesh.triangles) {
        const auto first = static_cast<std::uint32_t>(soup.positions.size());
        for (const std::uint32_t corner : t) soup.positions.push_back(mesh.positions[corner]);
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    soup.triangles.push_back({0, 0, 1});  // degenerate
    const Result<CollisionProxy> proxy = make_collision_proxy(soup, {});
    ASSERT_TRUE(proxy);
    EXPECT_EQ(bits_of(proxy->shape), bits_of(make_collision_proxy(mesh, {})->shape));
}

TEST(CollisionProxy, LimitsAreKeptAndSaid) {
    const Result<CollisionProxy> proxy =
        make_collision_proxy(torus_mesh(24, 12, 1.0, 0.3),
                             {.proxy_error = 0.02, .max_parts = 5, .max_hull_vertices = 8});
    ASSERT_TRUE(proxy);
    EXPECT_LE(proxy->shape.parts().size(), 5U);
    EXPECT_FALSE(proxy->is_within_error);
    EXPECT_GT(proxy->distance_m, 0.02);
    for (const CompoundPart& part : proxy->shape.parts()) {
        EXPECT_LE(std::get<ConvexHull>(part.shape).vertices().size(), 8U);
    }
}

TEST(CollisionProxy, BadInputIsOneClearLine) {
    const TriangleMesh good = l_mesh();
    const auto message = [](const TriangleMesh& mesh, const CollisionProxySettings& settings = {}) {
        const Result<CollisionProxy> proxy = make_collision_proxy(mesh, settings);
        return proxy ? std::string() : proxy.error().message;
    };
    EXPECT_NE(message({}).find("no triangle"), std::string::npos);
    TriangleMesh bad = good;
    bad.positions[3].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_NE(message(bad), "");
    bad = good;
    bad.triangles[2][1] = 99;
    EXPECT_NE(message(bad), "");
    bad = good;
    bad.positions[0].x() = 9e5;
    EXPECT_NE(message(bad), "");
    EXPECT_NE(message(good, {.proxy_error = -1.0}).find("proxy_error"), std::string::npos);
    EXPECT_NE(message(good, {.proxy_error = std::nan("")}).find("proxy_error"), std::string::npos);
    EXPECT_NE(message(good, {.max_parts = 0}).find("max_parts"), std::string::npos);
    EXPECT_NE(message(good, {.max_hull_vertices = 3}).find("max_hull_vertices"), std::string::npos);
}

TEST(CollisionProxy, AnyTrianglesGiveAnAnswer) {
    long compared = 0, closed = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937_64 random(seed);
        TriangleMesh mesh;
        const std::size_t points = 3 + random() % 6;
        for (std::size_t i = 0; i < points;
             ++i) {  // on a small lattice, so that many coincide or are coplanar
            mesh.positions.emplace_back(static_cast<double>(random() % 3),
                                        static_cast<double>(random() % 3),
                                        static_cast<double>(random() % 2));
        }
        for (std::size_t i = 0; i < 1 + random() % 12; ++i) {
            TriangleMesh::Triangle t{};
            for (auto& corner : t) corner = static_cast<std::uint32_t>(random() % points);
            mesh.triangles.push_back(t);
            // Half of the meshes contain every triangle with both orientations and are thus closed.
            if (seed % 2 == 0) mesh.triangles.push_back({t[0], t[2], t[1]});
        }
        for (const double error : {0.0, 0.1, 3.0}) {
            const Result<CollisionProxy> proxy = make_collision_proxy(mesh, {.proxy_error = error});
            if (!proxy) continue;
            ++compared;
            closed += seed % 2 == 0;
            const ProxyDistance measured = measure_proxy(mesh, *proxy, 200, seed);
            EXPECT_LE(measured.mesh_to_proxy, proxy->mesh_to_proxy_m + 1e-8);
            EXPECT_LE(measured.proxy_to_mesh, proxy->proxy_to_mesh_m + 1e-8);
        }
    }
    EXPECT_GT(compared, 9);
    EXPECT_GT(closed, 4);
}

using internal::ProxyPart;
using internal::SolidMesh;

constexpr std::size_t kMaxParts = 3;

std::vector<ProxyPart> cut(const SolidMesh& solid, double error) {
    return internal::cut_to_parts(solid, error, 4 * kMaxParts).value();
}

TEST(ErrorReach, IsNeverAboveTheDistanceThatAProxyHas) {
    // Within a tiny error, proxies of curved meshes, which are the last four, cost most of the time.
    const int tiny_count = few_or_many(4, 8);
    int known = 0, index = 0;
    for (const NamedMesh& named : proxy_meshes()) {
        const SolidMesh solid = internal::make_solid_mesh(named.mesh);
        const bool can_be_tiny = index++ < tiny_count;
        for (const bool is_tiny : {true, false}) {
            if (is_tiny && !can_be_tiny) continue;
            const double error = (is_tiny ? 1e-9 : 0.05) * solid.extent;
            const double least = internal::least_error(solid, cut(solid, error));
            known += least > 0.0 ? 1 : 0;
            // with few vertices hulls shrink inwards, away from the mesh
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
    const TriangleMesh rock = rock_mesh(10, 0.3, 1);
    const SolidMesh solid = internal::make_solid_mesh(rock);
    const std::vector<ProxyPart> parts = cut(solid, 1e-9);
    const double least = internal::least_error(solid, parts);
    EXPECT_GT(least, 1e-3);
    // work of the cuts: at a precision of a quarter of the error every piece would have 20,000 sub-triangles
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
    const TriangleMesh ball = rock_mesh(10, 0.0, 1);
    const CollisionProxySettings settings{
        .proxy_error = 1e-4, .max_hull_vertices = 8, .must_be_within_error = true};
    const Result<CollisionProxy> refused = make_collision_proxy(ball, settings);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message.find("a proxy of 64 hulls needs an error of at least "), 0u)
        << refused.error().message;
}

TEST(ErrorReach, ChangesNothingWhereTheErrorIsReached) {
    const TriangleMesh l = l_mesh();
    for (const double error : {0.05, 0.2}) {
        const CollisionProxy one = make_collision_proxy(l, {.proxy_error = error}).value();
        const Result<CollisionProxy> other =
            make_collision_proxy(l, {.proxy_error = error, .must_be_within_error = true});
        ASSERT_TRUE(other) << other.error().message;
        EXPECT_EQ(other->distance_m, one.distance_m);
        EXPECT_EQ(other->shape.parts().size(), one.shape.parts().size());
    }
}

TEST(SolidMesh, InsideAndDistanceAgreeWithSlowOnes) {
    for (const auto& [name, mesh] : proxy_meshes()) {
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
                // Half of the points share coordinates with vertices, so that rays meet edges and vertices.
                p[axis] = i % 2 == 0 ? low[axis] + (high[axis] - low[axis]) *
                                                       static_cast<double>(random() >> 11) * 0x1p-53
                                     : mesh.positions[random() % mesh.positions.size()][axis];
            }
            double slow = 1e300;
            for (const auto& t : mesh.triangles) {
                slow = std::min(slow, slow_distance(mesh.positions[t[0]], mesh.positions[t[1]],
                                                    mesh.positions[t[2]], p));
            }
            EXPECT_NEAR(internal::find_nearest(solid, p).distance, slow, 1e-12);
            if (slow < 1e-9) continue;
            const bool is_slow_inside = std::abs(solid_angle_winding(mesh, p)) > 0.5;
            inside += is_slow_inside ? 1 : 0;
            EXPECT_EQ(internal::is_inside(solid, p), is_slow_inside) << p.transpose();
        }
        EXPECT_GT(inside, 5U);
    }
}

}  // namespace
}  // namespace terrane
