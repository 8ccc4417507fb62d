// SPDX-License-Identifier: MIT
#include "lod/frame_mesh.h"
#include "support/grounds.h"
#include "support/mesh_checks.h"
#include "support/random_world.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::triangulator_test {

using namespace test;

TEST(Triangulator, StaysWatertightAndWithinBudgetWhateverIsResident) {
    for (int seed = 1; seed <= few_or_many(10, 30); ++seed) {
        SeededRandom random(static_cast<std::uint64_t>(seed));
        const RandomWorld world(random, 60);
        RandomResidence residence(world);
        const std::size_t least = world.root_triangles();
        for (const std::size_t more : {0u, 1u, 500u, 5'000u, 60'000u}) {
            SCOPED_TRACE(world.describe());
            residence.jump(random);
            Triangulator triangulator =
                Triangulator::create(world.source(), {.triangle_budget = least + more,
                                                      .max_error_px = random.between(0.2, 20.0)})
                    .value();
            const TerrainMesh mesh =
                triangulator.update(residence.resident(), random_view(random, world));
            EXPECT_LE(mesh.triangle_count, least + more);
            EXPECT_EQ(mesh.indices.size(), 3 * mesh.triangle_count);
            ASSERT_EQ(find_flaw(make_soup(mesh), world.lattice()), "");
        }
    }
}

TEST(Triangulator, NeverMeasuresMoreThanItCertifies) {
    const int seeds = few_or_many(5, 10);
    int seen = 0;  // some views see only the sky
    for (int seed = 1; seed <= seeds; ++seed) {
        SeededRandom random(static_cast<std::uint64_t>(20 + seed));
        const RandomWorld world(random, 60);
        RandomResidence residence(world);
        for (const std::size_t budget : {2'000u, 4'000u, 8'000u, 16'000u, 32'000u}) {
            SCOPED_TRACE(world.describe());
            residence.jump(random);
            Triangulator triangulator =
                Triangulator::create(world.source(), {.triangle_budget = budget,
                                                      .max_error_px = random.between(0.3, 5.0)})
                    .value();
            const View view = random_view(random, world);
            const TerrainMesh mesh = triangulator.update(residence.resident(), view);
            const double measured = measure_error_px(make_soup(mesh), world.source(), view, 12);
            seen += measured > 0.0 ? 1 : 0;
            EXPECT_LE(measured, mesh.error_px);
        }
    }
    EXPECT_GT(4 * seen, 3 * 5 * seeds);
}

TEST(Triangulator, GivesTheSameBytesWhateverItDidBefore) {
    SeededRandom random(31);
    const RandomWorld world(random, 60);
    RandomResidence residence(world);
    const TriangulatorSettings settings{.triangle_budget = 20'000, .max_error_px = 0.5};
    Triangulator old = Triangulator::create(world.source(), settings).value();
    for (int state = 0; state < few_or_many(8, 20); ++state) {
        SCOPED_TRACE(testing::Message() << "state " << state);
        residence.jump(random);
        const View view = random_view(random, world);
        Triangulator fresh = Triangulator::create(world.source(), settings).value();
        EXPECT_EQ(find_difference(old.update(residence.resident(), view),
                                  fresh.update(residence.resident(), view)),
                  "");
    }
}

TEST(Triangulator, MeetsItsTargetWhenEverythingIsResident) {
    const auto source = FractalHeights::create({.seed = 6,
                                                .octave_count = 10,
                                                .amplitude = 120.0,
                                                .wavelength_log2 = 9,
                                                .finest_spacing_log2 = 0,
                                                .root_size_log2 = 10})
                            .value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({10, 20, 400}, {300, 200, 0}, 1.0, 640, 360).value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 2'000'000, .max_error_px = 2.0}).value();
    pager.update({{.view = view, .threshold_px = 2.0}}, {}, 0.0);
    const TerrainMesh mesh = triangulator.update(pager.resident(), view);
    EXPECT_EQ(mesh.status, MeshStatus::error_met);
    EXPECT_LE(mesh.error_px, 2.0);
    EXPECT_GT(mesh.triangle_count, 1'000u);
}

// One root of one level with the same bound everywhere.
TEST(Triangulator, WorksOnAWorldOfASingleChunk) {
    Lattice lattice{.spacing = 10.0};
    const test::WaveHeights source(lattice, 30.0, 400.0);
    const auto set =
        std::make_shared<const ResidentSet>(lattice, source.extent(), all_chunks(source), 1);
    const View view = look_at({600, 600, 200}, {700, 700, 0}, 1.0, 640, 360).value();
    TerrainMesh mesh;
    for (const std::size_t budget : {2u, 3u, 100u, 100'000u}) {
        Triangulator triangulator =
            Triangulator::create(source, {.triangle_budget = budget, .max_error_px = 0.001})
                .value();
        mesh = triangulator.update(set, view);
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_EQ(find_flaw(make_soup(mesh), lattice), "");
        EXPECT_LE(test::measure_error_px(make_soup(mesh), source, view, 8), mesh.error_px);
    }
    EXPECT_EQ(mesh.triangle_count, 2u * kChunkCells * kChunkCells);
    EXPECT_EQ(mesh.status, MeshStatus::finest_reached);
}

}  // namespace terrane::triangulator_test

// P1 from below: if the error target cannot be met, the whole budget is used.

namespace terrane::exact_budget_test {

using namespace test;

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

// All chunks of the coarser levels of a fractal of 2 x 2 roots, and a random subset of the finest level.
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
    SeededRandom random(41);
    int by_budget = 0, by_vertices = 0;
    const int states = few_or_many(24, 60);
    for (int state = 0; state < states; ++state) {
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
        // every sixth budget is enough for all vertices
        const std::size_t budget = state % 6 == 5
                                       ? all + static_cast<std::size_t>(random.below(1000))
                                       : static_cast<std::size_t>(std::exp2(random.between(
                                             3.0, std::log2(static_cast<double>(all)))));
        SCOPED_TRACE(testing::Message()
                     << "state " << state << ", budget " << budget << " of " << all);
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
    EXPECT_GT(by_budget, states / 3);
    EXPECT_GE(by_vertices, states / 6);
}

// Random demands of other consumers: some share a threshold, some need no triangles, some are at the ends of the range.
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
    SeededRandom random(43);
    int blocked_by_others = 0, blocked_by_ground = 0, granted_all = 0;
    const int states = few_or_many(24, 60);
    for (int state = 0; state < states; ++state) {
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
            SCOPED_TRACE(testing::Message() << "state " << state << ", frame " << frame);
            const std::vector<TriangleDemand> demands = random_demands(random, budget);
            const TerrainMesh mesh = shared.update(set, view, demands);
            EXPECT_EQ(test::find_flaw(mesh), "");
            ASSERT_LE(mesh.triangle_count + mesh.demand_triangles, budget);
            // All demands above demand_threshold_px are granted, and none at or below it.
            std::size_t above = 0, next = 0;
            for (const TriangleDemand& demand : demands) {
                if (demand.threshold_px > mesh.demand_threshold_px) above += demand.triangles;
                // equal up to the rounding of keys
                if (demand.threshold_px <= mesh.demand_threshold_px &&
                    demand.threshold_px * (1.0 + 1e-6) >= mesh.demand_threshold_px)
                    next += demand.triangles;
            }
            ASSERT_EQ(above, mesh.demand_triangles);
            ASSERT_GE(mesh.demand_threshold_px, mesh.threshold_px);
            // With the remaining budget alone the ground is the same; otherwise the next demand does not fit beside it.
            Triangulator alone = make(budget - mesh.demand_triangles);
            const TerrainMesh ground = alone.update(set, view);
            ASSERT_LE(ground.threshold_px, mesh.threshold_px);
            if (ground.threshold_px < mesh.threshold_px) {
                ++blocked_by_others;
                ASSERT_GT(next, 0u);
                ASSERT_GT(mesh.triangle_count + mesh.demand_triangles + next, budget);
            } else if (mesh.status == MeshStatus::budget_reached) {
                ++blocked_by_ground;
            } else {
                ++granted_all;
            }
        }
    }
    EXPECT_GT(blocked_by_others, few_or_many(5, 20));
    EXPECT_GT(blocked_by_ground, few_or_many(2, 10));
    EXPECT_GT(granted_all, few_or_many(2, 10));
}

}  // namespace terrane::exact_budget_test

namespace terrane::internal::morph_test {

constexpr std::uint64_t kSeed = 31;

// Share of a vertex whose priority is a multiple of the threshold.
double share_of(double ratio, double priority) {
    const double full = ratio * ratio / (ratio * ratio - 1.0);
    return std::clamp(full * (1.0 - 1.0 / (priority * priority)), 0.0, 1.0);
}

// Mean error over all shares s of the mesh with the vertices whose share exceeds s. The error is the priority that
// belongs to s, or `excess` if the vertex with that priority should be active and is not.
double mean_error(double ratio, double excess, double shown) {
    constexpr int kSteps = 200'000;
    const double full = ratio * ratio / (ratio * ratio - 1.0);
    double sum = 0.0;
    for (int i = 0; i < kSteps; ++i) {
        const double share = (i + 0.5) / kSteps;
        const double priority = 1.0 / std::sqrt(1.0 - share / full);
        const bool is_late = share > share_of(ratio, shown) && share < share_of(ratio, excess);
        sum += is_late ? excess : priority;
    }
    return sum / kSteps;
}

TEST(Morph, BoundsHeldVerticesByTheAverageOfTheirMeshes) {
    test::Random random(kSeed);
    for (int i = 0; i < 40; ++i) {
        const double ratio = random.between(1.05, 3.0);
        const double shown = random.between(1.0, 1.2 * ratio);
        const double excess = shown * random.between(1.0, 2.0);
        EXPECT_NEAR(Morph(ratio, 1.0f).error_with_held(excess, shown),
                    mean_error(ratio, excess, shown), 1e-3)
            << "ratio " << ratio << ", shown " << shown << ", excess " << excess << ", seed "
            << kSeed;
    }
}

TEST(Morph, BoundsOtherVerticesByTheErrorFactor) {
    const Morph morph(kDefaultMorphRatio, 1.0f);
    EXPECT_NEAR(morph.error_factor(), mean_error(kDefaultMorphRatio, 1.0, 1.0), 1e-4);
    EXPECT_EQ(morph.error_with_held(1.1, 1.1), morph.error_factor());
    EXPECT_EQ(morph.error_with_held(0.5, 1.1), morph.error_factor());
}

// A share of 0 is equivalent to a missing vertex; a larger share reduces the error.
TEST(Morph, IsBetweenInPlaceAndMissing) {
    const Morph morph(kDefaultMorphRatio, 1.0f);
    for (const double excess : {1.01, 1.1, kDefaultMorphRatio, 1.5, 3.0}) {
        EXPECT_NEAR(morph.error_with_held(excess, 1.0), morph.error_with_missing(excess), 1e-12)
            << excess;
        EXPECT_LE(morph.error_with_held(excess, 1.05), morph.error_with_missing(excess) + 1e-12)
            << excess;
        EXPECT_GE(morph.error_with_held(excess, 1.05), morph.error_factor()) << excess;
    }
}

}  // namespace terrane::internal::morph_test
