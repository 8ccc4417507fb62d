// SPDX-License-Identifier: MIT
// The bits of meshes along a flight. They may change only together with an entry in CHANGELOG.md
// ("Terrain changes" where heights changed); the failure prints the present hashes. Built with both
// compilers at more than one optimisation level: all must agree.
#include "support/hash.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

namespace terrane {
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
    EXPECT_EQ(hash.value(), 0xd0a528833fe6638bu) << std::hex << hash.value();
}

}  // namespace golden_mesh_test
}  // namespace terrane
