// SPDX-License-Identifier: MIT
// The bits of a recorded sequence of contractions. They may change only together with an entry in CHANGELOG.md; the
// failure prints the present hash. Built with both compilers at more than one optimisation level: all must agree.
#include "support/hash.h"
#include "support/meshes/box_triangles.h"
#include "support/random.h"

#include <terrane/terrain/progressive_mesh.h>

#include <gtest/gtest.h>

namespace terrane {
namespace golden_progressive_test {

// Two sheets of noise that share a border with other attributes, and a box beside them.
TriangleMesh make_sheets() {
    constexpr std::uint32_t kSide = 32;
    test::Random random(9);
    TriangleMesh mesh;
    for (std::uint32_t sheet = 0; sheet < 2; ++sheet) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (std::uint32_t y = 0; y <= kSide; ++y) {
            for (std::uint32_t x = 0; x <= kSide; ++x) {
                const double z = (y == 0) ? 0.0 : random.between(-0.4, 0.4);
                mesh.positions.emplace_back(x, sheet == 0 ? -double{1.0} * y : double{1.0} * y, z);
                mesh.normals.emplace_back(0.0f, sheet == 0 ? 0.6f : -0.6f, 0.8f);
                mesh.texture_coordinates.emplace_back(static_cast<float>(x) / 32.0f,
                                                      static_cast<float>(y + 32 * sheet) / 64.0f);
                mesh.colours.push_back({static_cast<std::uint8_t>(8 * x > 255 ? 255 : 8 * x),
                                        static_cast<std::uint8_t>(100 * sheet), 7, 255});
            }
        }
        for (std::uint32_t y = 0; y < kSide; ++y) {
            for (std::uint32_t x = 0; x < kSide; ++x) {
                const std::uint32_t a = first + y * (kSide + 1) + x, b = a + kSide + 1;
                const bool is_turned = sheet == 0;
                mesh.triangles.push_back({a, is_turned ? b + 1 : a + 1, is_turned ? a + 1 : b + 1});
                mesh.triangles.push_back({a, is_turned ? b : b + 1, is_turned ? b + 1 : b});
            }
        }
    }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int i = 0; i < 8; ++i) {
        mesh.positions.emplace_back(40.0 + (i & 1), 3.0 + 0.5 * (i & 2), 0.2 * (i & 4));
        mesh.normals.emplace_back(0.0f, 0.0f, 1.0f);
        mesh.texture_coordinates.emplace_back(0.0f, 0.0f);
        mesh.colours.push_back({9, 9, 9, 255});
    }
    for (const TriangleMesh::Triangle& t : test::kBoxTriangles)
        mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    return mesh;
}

TEST(GoldenProgressive, IsTheSameWithEveryCompilerAtEveryLevel) {
    ProgressiveMesh mesh = ProgressiveMesh::create(make_sheets()).value();
    test::Hash hash;
    hash.add_all(mesh.input_vertices());
    for (std::size_t count = mesh.triangles().size();; count = count * 7 / 8) {
        mesh.set_triangle_count(count);
        hash.add(mesh.error_m());
        hash.add_all(mesh.triangles());
        if (mesh.triangles().size() == mesh.least_triangle_count()) break;
    }
    EXPECT_LT(mesh.triangles().size(), 30u);
    EXPECT_EQ(hash.value(), 0xcfe7bd0e15ced3acu) << std::hex << hash.value();
}

}  // namespace golden_progressive_test
}  // namespace terrane
