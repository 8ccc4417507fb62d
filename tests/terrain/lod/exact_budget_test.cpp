// SPDX-License-Identifier: MIT
// P1 from below: if the error target is out of reach, the whole budget is used.
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace exact_budget_test {

using test::Random;

constexpr double kOutOfReach_px = 1e-9;
constexpr std::size_t kMoreThanAll = 600'000;  // triangles

std::shared_ptr<const HeightSource> random_hills(Random& random) {
    const std::uint64_t seed = random.bits();
    return FractalHeights::create({.seed = seed,
                                   .octave_count = 6,
                                   .amplitude = random.between(20.0, 200.0),
                                   .wavelength_log2 = 8,
                                   .root_size_log2 = 8})
        .value();
}

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
        const auto source = random_hills(random);
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

// Demands of others, some of one threshold, some without triangles, some at the ends of the range.
std::vector<TriangleDemand> random_demands(Random& random, std::size_t budget) {
    std::vector<TriangleDemand> demands;
    const int count = random.below(random.below(2) == 0 ? 60 : 4);
    for (int i = 0; i < count; ++i) {
        double threshold_px = std::exp2(random.between(-6.0, 12.0));
        if (random.below(10) == 0) threshold_px = std::numeric_limits<double>::infinity();
        if (random.below(10) == 0) threshold_px = 1e-300;
        // never granted
        if (random.below(20) == 0) threshold_px = std::numeric_limits<double>::quiet_NaN();
        if (random.below(20) == 0) threshold_px = -1000.0;
        if (random.below(5) == 0 && !demands.empty()) threshold_px = demands[0].threshold_px;
        const int most = static_cast<int>(std::min<std::size_t>(budget, 1'000'000) / 8 + 2);
        demands.push_back({threshold_px, static_cast<std::uint32_t>(random.below(most))});
    }
    return demands;
}

TEST(ExactBudget, IsSharedWithOthersUpToTheFirstThatDoesNotFit) {
    constexpr std::uint64_t kSeed = 43;
    Random random(kSeed);
    int blocked_by_others = 0, blocked_by_ground = 0, granted_all = 0;
    for (int state = 0; state < 60; ++state) {
        const auto source = random_hills(random);
        const auto set = random_set(random, *source, random.between(0.0, 1.0));
        const View view = look_at({random.between(-250.0, 250.0), random.between(-250.0, 250.0),
                                   random.between(50.0, 400.0)},
                                  {0.0, 0.0, 0.0}, random.between(0.3, 1.5), 1280, 720)
                              .value();
        const auto budget = static_cast<std::size_t>(std::exp2(random.between(3.0, 18.0)));
        const double target_px = random.below(2) == 0 ? 0.01 : 20.0;
        const auto make = [&](std::size_t triangles) {
            return Triangulator::create(
                       *source,
                       {.triangle_budget = triangles, .max_error_px = target_px, .open_chunks = 24})
                .value();
        };
        Triangulator shared = make(budget);
        for (int frame = 0; frame < 3; ++frame) {
            SCOPED_TRACE(testing::Message()
                         << "seed " << kSeed << ", state " << state << ", frame " << frame);
            const std::vector<TriangleDemand> demands = random_demands(random, budget);
            const TerrainMesh mesh = shared.update(set, view, demands);
            EXPECT_EQ(test::find_flaw(mesh), "");
            ASSERT_LE(mesh.triangle_count + mesh.others_triangles, budget);
            // All above others_threshold_px are granted, and none at or below the threshold.
            std::size_t above = 0, next = 0;
            for (const TriangleDemand& demand : demands) {
                if (demand.threshold_px > mesh.others_threshold_px) above += demand.triangles;
                // up to the rounding of keys
                if (demand.threshold_px <= mesh.others_threshold_px &&
                    demand.threshold_px * (1.0 + 1e-6) >= mesh.others_threshold_px)
                    next += demand.triangles;
            }
            ASSERT_EQ(above, mesh.others_triangles);
            ASSERT_GE(mesh.others_threshold_px, mesh.threshold_px);
            // What the others have left gives the same ground, or the next demand does not fit beside it.
            Triangulator alone = make(budget - mesh.others_triangles);
            const TerrainMesh ground = alone.update(set, view);
            ASSERT_LE(ground.threshold_px, mesh.threshold_px);
            if (ground.threshold_px < mesh.threshold_px) {
                ++blocked_by_others;
                ASSERT_GT(next, 0u);
                ASSERT_GT(mesh.triangle_count + mesh.others_triangles + next, budget);
            } else if (mesh.status == MeshStatus::budget_reached) {
                ++blocked_by_ground;
            } else {
                ++granted_all;
            }
        }
    }
    EXPECT_GT(blocked_by_others, 20);
    EXPECT_GT(blocked_by_ground, 10);
    EXPECT_GT(granted_all, 10);
}

}  // namespace exact_budget_test
}  // namespace terrane
