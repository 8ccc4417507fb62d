// SPDX-License-Identifier: MIT
//
// Hashes of the heights of a seed as doubles. They must be the same with every compiler, at every optimisation level
// and on every processor. After an intended change, copy the printed hashes and add an entry under "Terrain changes" in
// CHANGELOG.md.
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/scatter.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane {
namespace golden_heights_test {

std::uint64_t hash_of(const std::vector<double>& values) {
    test::Hash hash;
    hash.add_all(std::span<const double>(values));
    return hash.value();
}

/// Samples of a fine and a coarse grid and heights between them, around (place, -place).
std::vector<double> heights_around(const HeightSource& source, std::int64_t place) {
    std::vector<double> all;
    for (const std::int64_t step : {1, 64}) {
        const SampleGrid grid{{place, -place}, step, 65, 65};
        std::vector<double> heights(grid.size());
        EXPECT_TRUE(source.sample(grid, heights).has_value());
        all.insert(all.end(), heights.begin(), heights.end());
    }
    for (int index = 0; index < 1000; ++index) {
        all.push_back(source.height(static_cast<double>(place) + 0.37 * index,
                                    static_cast<double>(-place) + 1.91 * index));
    }
    return all;
}

/// The bounds that certify these heights are promised as well.
std::vector<double> bounds_around(const HeightSource& source, std::int64_t place) {
    std::vector<double> all;
    const std::int64_t corner = place / 16 * 16;
    const SampleGrid grid{{corner, -corner}, 4, 33, 33};
    std::vector<float> bounds(grid.size());
    EXPECT_TRUE(source.vertex_bounds(grid, bounds).has_value());
    all.insert(all.end(), bounds.begin(), bounds.end());
    bounds.resize(32 * 32);
    EXPECT_TRUE(source.cell_bounds(grid, bounds).has_value());
    all.insert(all.end(), bounds.begin(), bounds.end());
    all.push_back(source.rise_bound(17.0));
    return all;
}

struct Golden {
    std::uint64_t seed;
    std::int64_t place;
    std::uint64_t heights, bounds;
};

void expect_golden(const HeightSource& source, const Golden& golden) {
    SCOPED_TRACE(testing::Message() << "seed " << golden.seed << " at " << golden.place);
    const std::uint64_t heights = hash_of(heights_around(source, golden.place));
    const std::uint64_t bounds = hash_of(bounds_around(source, golden.place));
    EXPECT_EQ(heights, golden.heights) << "heights: " << std::hex << heights;
    EXPECT_EQ(bounds, golden.bounds) << "bounds: " << std::hex << bounds;
}

TEST(GoldenHeights, FractalHasTheBitsThatWerePromised) {
    constexpr Golden kGoldens[] = {
        {1, 0, 0x02e89ac4ea7c4aedu, 0x3fe6599e4c5dcd29u},
        {1, 10'000'000, 0xfa8457c07d783de4u, 0xe09a3ac05cdc2e02u},
        {1, -1'000'000'000, 0x4f0238a733f9b158u, 0x6546d629365cc069u},
        {2, 0, 0x3eb5e807e3599528u, 0xab352f24418c8c17u},
        {2, 10'000'000, 0xf2ac26c0d435c6f2u, 0x58827d954e5b6959u},
        {2, -1'000'000'000, 0x19d9c742dd2d9f62u, 0x556dd02e92e98a12u},
        {0xfedcba9876543210u, 0, 0x3f35932a12c62f01u, 0xb81fb7dd551b01c5u},
        {0xfedcba9876543210u, 10'000'000, 0x00ef83fbfe5d5d64u, 0x9fd487572b1033d0u},
        {0xfedcba9876543210u, -1'000'000'000, 0x6e09877021026806u, 0xdf263eca87cc5e6du},
    };
    for (const Golden& golden : kGoldens) {
        expect_golden(*FractalHeights::create({.seed = golden.seed, .gain = 0.53}).value(), golden);
    }
}

TEST(GoldenHeights, EveryKindHasTheBitsThatWerePromised) {
    struct KindGolden {
        FractalKind kind;
        Golden golden;
    };
    constexpr KindGolden kGoldens[] = {
        {FractalKind::ridged, {1, 0, 0x85d1611eb708869bu, 0xf9300c6e44b35917u}},
        {FractalKind::ridged, {2, -1'000'000'000, 0xe5c0ba325f1dbd44u, 0x65352efbd850e092u}},
        {FractalKind::hybrid, {1, 0, 0x430e3ddead8b03cfu, 0xb28d52acd58087e5u}},
        {FractalKind::hybrid, {2, -1'000'000'000, 0x84cd16760ecb7c4bu, 0x59ee0063354e7a8fu}},
        {FractalKind::warped, {1, 0, 0xa91b12fe69a19f5eu, 0x280d91f00dc41aabu}},
        {FractalKind::warped, {2, -1'000'000'000, 0xdfa7237ec23dcd8du, 0xfb429a5a4ab4eadcu}},
    };
    for (const auto& [kind, golden] : kGoldens) {
        SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind));
        const FractalSettings settings{.seed = golden.seed, .kind = kind, .gain = 0.53};
        expect_golden(*FractalHeights::create(settings).value(), golden);
    }
}

TEST(GoldenHeights, DetailHasTheBitsThatWerePromised) {
    constexpr Golden kGoldens[] = {{1, 0, 0xf17bc053736d0c17u, 0x4d2d04e10041a682u},
                                   {2, 1000, 0x791252a270a1f92fu, 0x7e4beb0c61af2476u}};
    for (const Golden& golden : kGoldens) {
        const DetailField field{.origin_x = 12.5,
                                .cell_x = 32.0,
                                .cell_y = 27.3,
                                .columns = 3,
                                .rows = 2,
                                .node_spacing_x = 310.0,
                                .node_spacing_y = 290.0,
                                .amplitude = {1.0f, 3.5f, 0.0f, 2.25f, 0.5f, 7.0f}};
        const auto base = FractalHeights::create({.seed = golden.seed, .octave_count = 3}).value();
        expect_golden(*add_detail(base, field, {.seed = golden.seed, .gain = 0.6}).value(), golden);
    }
}

}  // namespace golden_heights_test

// Bits of meshes along a flight. They may change only with an entry in CHANGELOG.md ("Terrain changes" if heights
// changed); a failure prints the new hashes. Built with both compilers at several optimisation levels, which must
// agree.

namespace golden_mesh_test {

TEST(GoldenMesh, IsTheSameWithEveryCompilerAtEveryLevel) {
    const auto source = FractalHeights::create({.seed = 11, .root_size_log2 = 13}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 20'000}).value();
    test::Hash hash;
    double threshold_px = 1.0;
    for (int frame = 0; frame < 12; ++frame) {
        const WorldPos eye(40.0 * frame, -300.0 + 9.0 * frame, 250.0);
        const View view = look_at(eye, eye + WorldPos(100.0, 31.0, -22.0), 1.0, 1280, 720).value();
        const CameraNeed camera{
            .view = view, .velocity = {1200.0, 270.0, 0.0}, .threshold_px = threshold_px};
        pager.update({&camera, 1}, {}, frame / 30.0);
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        threshold_px = mesh.threshold_px;
        for (const MeshChunk& part : mesh.chunks) {
            hash.add(part.chunk->key.x);
            hash.add(part.chunk->key.y);
            hash.add(part.chunk->key.level);
            hash.add(part.index_count);
            for (std::uint32_t i = 0; i < part.index_count; ++i) {
                hash.add(part.offsets[mesh.indices[part.first_index + i]]);
            }
        }
        hash.add_all(mesh.indices);
        hash.add(mesh.error_px);
    }
    EXPECT_EQ(hash.value(), 0x9c0f008ac3de307bu) << std::hex << hash.value();
}

}  // namespace golden_mesh_test

// Bits of a recorded sequence of contractions. They may change only with an entry in CHANGELOG.md; a failure prints the
// new hash. Built with both compilers at several optimisation levels, which must agree.

namespace golden_progressive_test {

// Two sheets of noise with different attributes along their common border, and a box beside them.
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

// Bits of scattered placements. They may change only with an entry in CHANGELOG.md; a failure prints the new hash.
// Built with both compilers at several optimisation levels, which must agree.

namespace golden_scatter_test {

TEST(GoldenScatter, IsTheSameWithEveryCompilerAtEveryLevel) {
    const std::shared_ptr<const HeightSource> source =
        FractalHeights::create({.seed = 5, .root_size_log2 = 13}).value();
    test::Hash hash;
    std::size_t count = 0;
    for (const double per_km2 : {40.0, 3000.0, 300'000.0}) {
        const Scatter scatter =
            Scatter::create(source, {.per_km2 = per_km2, .max_slope = 0.5, .seed = 9}).value();
        const ScatterSquare middle = scatter.square_at(0.0, 0.0);
        for (std::int32_t y = -1; y <= 1; ++y) {
            for (std::int32_t x = -1; x <= 1; ++x) {
                const std::vector<ScatterPoint> points =
                    scatter.objects_in({middle.x + x, middle.y + y}).value();
                for (const ScatterPoint& point : points) {
                    hash.add_all(std::span<const double>(point.position_world.data(), 3));
                    hash.add(point.scale);
                    hash.add(point.half_turn_cosine);
                    hash.add(point.half_turn_sine);
                    ++count;
                }
            }
        }
    }
    EXPECT_GT(count, 1000u);
    EXPECT_EQ(hash.value(), 0xed23ef7c26866cf6u) << std::hex << hash.value();
}

}  // namespace golden_scatter_test
}  // namespace terrane
