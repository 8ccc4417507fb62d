// SPDX-License-Identifier: MIT
// P1 from below: if the error target is out of reach, the whole budget is used.
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace exact_budget_test {

using test::Random;

constexpr double kOutOfReach_px = 1e-9;
constexpr std::size_t kMoreThanAll = 600'000;  // triangles

// All chunks of some levels of a fractal of 2 x 2 roots; of the finest level any of them.
std::shared_ptr<const ResidentSet> random_set(Random& random, const HeightSource& source,
                                              double share) {
    const Lattice& lattice = source.lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::vector<float> fades;
    for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
        const std::int32_t first = lattice.first_root_x << level;
        const std::int32_t count = lattice.root_count_x << level;
        for (std::int32_t y = first; y < first + count; ++y) {
            for (std::int32_t x = first; x < first + count; ++x) {
                if (level == lattice.finest_level && random.between(0.0, 1.0) > share) continue;
                chunks.push_back(make_chunk(source, {x, y, level}).value());
                const double fade = level > 0 ? random.between(0.2, 2.0) : 1.0;
                fades.push_back(static_cast<float>(std::min(1.0, fade)));
            }
        }
    }
    return std::make_shared<const ResidentSet>(lattice, source.extent(), std::move(chunks), fades,
                                               1);
}

TEST(ExactBudget, IsUsedOrEveryVertexThatMattersIsThere) {
    constexpr std::uint64_t kSeed = 41;
    Random random(kSeed);
    int by_budget = 0, by_vertices = 0;
    for (int state = 0; state < 60; ++state) {
        const auto source = FractalHeights::create({.seed = random.bits(),
                                                    .octave_count = 6,
                                                    .amplitude = random.between(20.0, 200.0),
                                                    .wavelength_log2 = 8,
                                                    .root_size_log2 = 8})
                                .value();
        const auto set = random_set(random, *source, random.between(0.0, 1.0));
        const WorldPos eye(random.between(-250.0, 250.0), random.between(-250.0, 250.0),
                           random.between(50.0, 400.0));
        const View view =
            look_at(eye, {random.between(-250.0, 250.0), random.between(-250.0, 250.0), 0.0},
                    random.between(0.3, 1.5), 1280, 720)
                .value();
        const double morph_ratio = state % 3 == 0 ? 1.0 : random.between(1.0, 2.0);
        const auto make = [&](std::size_t budget) {
            return Triangulator::create(*source, {.triangle_budget = budget,
                                                  .max_error_px = kOutOfReach_px,
                                                  .morph_ratio = morph_ratio,
                                                  .open_chunks = 24})
                .value();
        };
        const std::size_t all = make(kMoreThanAll).update(set, view).triangle_count;
        ASSERT_LT(all, kMoreThanAll);
        const auto budget = static_cast<std::size_t>(
            std::exp2(random.between(3.0, 1.5 + std::log2(static_cast<double>(all)))));
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", state " << state << ", budget "
                                        << budget << " of " << all);
        Triangulator triangulator = make(budget);
        const TerrainMesh mesh = triangulator.update(set, view);
        ASSERT_LE(mesh.triangle_count, budget);
        EXPECT_EQ(test::find_flaw(mesh), "");
        if (mesh.triangle_count == all) {
            ++by_vertices;
        } else {
            EXPECT_GE(static_cast<double>(mesh.triangle_count) + 2.0,
                      0.97 * static_cast<double>(budget));
            EXPECT_EQ(mesh.status, MeshStatus::budget_reached);
            ++by_budget;
        }
    }
    EXPECT_GT(by_budget, 20);
    EXPECT_GT(by_vertices, 5);
}

}  // namespace exact_budget_test
}  // namespace terrane
