// SPDX-License-Identifier: MIT
//
// Budgets of millions of triangles: the meshes are watertight and use them to the last few.
#include "support/mesh_checks.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

namespace terrane::large_budget_test {

// One root of five levels, all resident: 2^11 cells a side, 8,388,608 triangles at the finest level.
TEST(LargeBudget, IsUsedUpToEightMillionTriangles) {
    const auto source = FractalHeights::create({.seed = 8,
                                                .octave_count = 5,
                                                .amplitude = 100.0,
                                                .wavelength_log2 = 6,
                                                .gain = 0.7,
                                                .root_size_log2 = 11,
                                                .first_root_x = 0,
                                                .first_root_y = 0,
                                                .root_count_x = 1,
                                                .root_count_y = 1})
                            .value();
    const Lattice& lattice = source->lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
        for (std::int32_t y = 0; y < 1 << level; ++y) {
            for (std::int32_t x = 0; x < 1 << level; ++x) {
                chunks.push_back(make_chunk(*source, {x, y, level}).value());
            }
        }
    }
    const auto set =
        std::make_shared<const ResidentSet>(lattice, source->extent(), std::move(chunks), 1);
    const View view = look_at({-100, -100, 700}, {1200, 1000, 0}, 1.2, 1920, 1080).value();
    for (const std::size_t budget : {1'000'000u, 3'000'000u, 8'000'000u}) {
        SCOPED_TRACE(budget);
        Triangulator triangulator =
            Triangulator::create(*source, {.triangle_budget = budget, .max_error_px = 1e-6})
                .value();
        const TerrainMesh mesh = triangulator.update(set, view);
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_GE(static_cast<double>(mesh.triangle_count), 0.97 * static_cast<double>(budget));
        EXPECT_EQ(mesh.status, MeshStatus::budget_reached);
        EXPECT_EQ(test::find_flaw(mesh), "");
    }
}

}  // namespace terrane::large_budget_test
