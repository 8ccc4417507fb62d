// SPDX-License-Identifier: MIT
// Bits of collision proxies. They may change only with an entry in CHANGELOG.md; a failure prints the new hash. Built
// with both compilers at several optimisation levels, which must agree.
#include "support/hash.h"
#include "support/random.h"

#include <terrane/collision/collision_proxy.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <variant>

namespace terrane {
namespace golden_proxy_test {

using test::Hash;
using test::Random;

// An octahedron whose triangles are cut in four, `cuts` times, with vertices at random distances of 0.6 to 1. Square
// roots only, which IEEE 754 rounds correctly.
TriangleMesh rock(int cuts) {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int cut = 0; cut < cuts; ++cut) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, is_new] =
                middles.try_emplace(std::minmax(a, b), mesh.positions.size());
            if (is_new) {
                const Eigen::Vector3d sum = mesh.positions[a] + mesh.positions[b];
                const double size =
                    std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
                mesh.positions.emplace_back(sum.x() / size, sum.y() / size, sum.z() / size);
            }
            return place->second;
        };
        std::vector<TriangleMesh::Triangle> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    Random random(21);
    for (Eigen::Vector3d& p : mesh.positions) p *= random.between(0.6, 1.0);
    return mesh;
}

void add_part(Hash& hash, const CompoundPart& part) {
    hash.add_all(std::span<const double>(part.body_from_part.rotation.data(), 9));
    hash.add_all(std::span<const double>(part.body_from_part.translation.data(), 3));
    if (const auto* hull = std::get_if<ConvexHull>(&part.shape)) {
        for (const Eigen::Vector3d& p : hull->vertices())
            hash.add_all(std::span<const double>(p.data(), 3));
    }
}

TEST(GoldenProxy, IsTheSameWithEveryCompilerAtEveryLevel) {
    const TriangleMesh mesh = rock(1);
    Hash hash;
    std::size_t hulls = 0;
    for (const double error : {0.3, 0.05, 0.01}) {
        const CollisionProxy proxy = make_collision_proxy(mesh, {.proxy_error = error}).value();
        hash.add(proxy.distance_m);
        hash.add(proxy.mesh_to_proxy_m);
        hash.add(proxy.proxy_to_mesh_m);
        hash.add(proxy.mesh_volume);
        hash.add(proxy.parts_volume);
        for (const CompoundPart& part : proxy.shape.parts()) add_part(hash, part);
        hulls += proxy.shape.parts().size();
    }
    EXPECT_GT(hulls, 3u);
    EXPECT_EQ(hash.value(), 0x8bad73fb5873fc9eu) << std::hex << hash.value();
}

}  // namespace golden_proxy_test
}  // namespace terrane
