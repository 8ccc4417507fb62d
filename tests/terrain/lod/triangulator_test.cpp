// SPDX-License-Identifier: MIT
#include "lod/frame_mesh.h"
#include "support/grounds.h"
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

namespace terrane::triangulator_test {

using namespace test;

std::shared_ptr<const HeightSource> small_fractal(std::uint64_t seed) {
    const auto source = FractalHeights::create({.seed = seed,
                                                .octave_count = 10,
                                                .amplitude = 120.0,
                                                .wavelength_log2 = 9,
                                                .finest_spacing_log2 = 0,
                                                .root_size_log2 = 10});
    return source ? *source : nullptr;
}

View random_view(Random& random, const HeightSource& source) {
    const WorldRect& extent = source.extent();
    const WorldPos eye(random.between(extent.west, extent.east),
                       random.between(extent.south, extent.north), 0.0);
    WorldPos above = eye;
    above.z() = source.height(eye.x(), eye.y()) + random.between(2.0, 300.0);
    const WorldPos target =
        above + WorldPos(random.between(-100.0, 100.0), random.between(-100.0, 100.0),
                         random.between(-60.0, 10.0));
    return look_at(above, target, random.between(0.3, 1.8), 640, 360).value();
}

// Random sets of chunks closed under parents: loads may arrive in any order.
class RandomSets {
public:
    RandomSets(const HeightSource& source, std::uint64_t seed) : source_(source), random_(seed) {}

    std::shared_ptr<const ResidentSet> make() {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        const Lattice& lattice = source_.lattice();
        const double share = random_.between(0.1, 1.0);
        for (std::int32_t y = 0; y < lattice.root_count_y; ++y) {
            for (std::int32_t x = 0; x < lattice.root_count_x; ++x) {
                add({lattice.first_root_x + x, lattice.first_root_y + y, 0}, share, chunks);
            }
        }
        return std::make_shared<const ResidentSet>(lattice, source_.extent(), std::move(chunks),
                                                   ++epoch_);
    }

private:
    void add(const ChunkKey& key, double share, std::vector<std::shared_ptr<const Chunk>>& chunks) {
        std::shared_ptr<const Chunk>& chunk = made_[key];
        if (!chunk) chunk = make_chunk(source_, key).value();
        chunks.push_back(chunk);
        if (key.level == source_.lattice().finest_level) return;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            if (random_.between(0.0, 1.0) < share) add(key.child(quadrant), share, chunks);
        }
    }

    const HeightSource& source_;
    Random random_;
    std::map<ChunkKey, std::shared_ptr<const Chunk>> made_;
    std::uint64_t epoch_ = 0;
};

TEST(Triangulator, StaysWatertightAndWithinBudgetWhateverIsResident) {
    const auto source = small_fractal(3);
    ASSERT_NE(source, nullptr);
    RandomSets sets(*source, 11);
    Random random(12);
    for (int state = 0; state < 150; ++state) {
        SCOPED_TRACE(testing::Message() << "seed 11/12, state " << state);
        const std::array<std::size_t, 5> budgets{8, 9, 500, 5'000, 60'000};
        const std::size_t budget = budgets[static_cast<std::size_t>(state) % budgets.size()];
        Triangulator triangulator =
            Triangulator::create(
                *source, {.triangle_budget = budget, .max_error_px = random.between(0.2, 20.0)})
                .value();
        const TerrainMesh mesh = triangulator.update(sets.make(), random_view(random, *source));
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_EQ(mesh.indices.size(), 3 * mesh.triangle_count);
        ASSERT_EQ(find_flaw(make_soup(mesh), source->lattice()), "");
    }
}

TEST(Triangulator, NeverMeasuresMoreThanItCertifies) {
    const auto source = small_fractal(4);
    ASSERT_NE(source, nullptr);
    RandomSets sets(*source, 21);
    Random random(22);
    int seen = 0;  // some views see only the sky
    for (int state = 0; state < 40; ++state) {
        SCOPED_TRACE(testing::Message() << "seed 21/22, state " << state);
        Triangulator triangulator =
            Triangulator::create(*source, {.triangle_budget = 2'000u << (state % 5),
                                           .max_error_px = random.between(0.3, 5.0)})
                .value();
        const View view = random_view(random, *source);
        const TerrainMesh mesh = triangulator.update(sets.make(), view);
        const double measured = test::measure_error_px(make_soup(mesh), *source, view, 12);
        seen += measured > 0.0 ? 1 : 0;
        EXPECT_LE(measured, mesh.error_px);
    }
    EXPECT_GT(seen, 30);
}

TEST(Triangulator, UsesTheBudgetWhenTheTargetIsOutOfReach) {
    const auto source = small_fractal(5);
    ASSERT_NE(source, nullptr);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({0, 0, 200}, {300, 200, 0}, 1.0, 1280, 720).value();
    const std::vector<CameraNeed> cameras{{.view = view, .threshold_px = 0.05}};
    pager.update(cameras, {}, 0.0);
    for (const std::size_t budget : {1'000u, 20'000u, 100'000u}) {
        Triangulator triangulator =
            Triangulator::create(*source, {.triangle_budget = budget, .max_error_px = 0.01})
                .value();
        const TerrainMesh mesh = triangulator.update(pager.resident(), view);
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_GE(static_cast<double>(mesh.triangle_count), 0.97 * static_cast<double>(budget));
        EXPECT_EQ(mesh.status, MeshStatus::budget_reached);
    }
}

TEST(Triangulator, MeetsItsTargetWhenEverythingIsResident) {
    const auto source = small_fractal(6);
    ASSERT_NE(source, nullptr);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({10, 20, 400}, {300, 200, 0}, 1.0, 640, 360).value();
    Triangulator triangulator =
        Triangulator::create(*source, {.triangle_budget = 2'000'000, .max_error_px = 2.0}).value();
    const std::vector<CameraNeed> cameras{{.view = view, .threshold_px = 2.0}};
    pager.update(cameras, {}, 0.0);
    const TerrainMesh mesh = triangulator.update(pager.resident(), view);
    EXPECT_EQ(mesh.status, MeshStatus::error_met);
    EXPECT_LE(mesh.error_px, 2.0);
    EXPECT_GT(mesh.triangle_count, 1'000u);
}

TEST(Triangulator, GivesTheSameBytesWhateverItDidBefore) {
    const auto source = small_fractal(7);
    ASSERT_NE(source, nullptr);
    RandomSets sets(*source, 31);
    Random random(32);
    const TriangulatorSettings settings{.triangle_budget = 20'000, .max_error_px = 0.5};
    Triangulator old = Triangulator::create(*source, settings).value();
    for (int state = 0; state < 20; ++state) {
        SCOPED_TRACE(testing::Message() << "seed 31/32, state " << state);
        const auto set = sets.make();
        const View view = random_view(random, *source);
        const TerrainMesh a = old.update(set, view);
        Triangulator fresh = Triangulator::create(*source, settings).value();
        const TerrainMesh b = fresh.update(set, view);
        EXPECT_EQ(std::vector(a.indices.begin(), a.indices.end()),
                  std::vector(b.indices.begin(), b.indices.end()));
        EXPECT_EQ(a.error_px, b.error_px);
    }
}

TEST(Triangulator, HandlesExtremeViews) {
    const auto source = small_fractal(8);
    ASSERT_NE(source, nullptr);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 10'000}).value();
    const Lattice& lattice = source->lattice();
    const double ground = source->height(lattice.x(3), lattice.y(5));
    const std::vector<std::pair<WorldPos, WorldPos>> places{
        {{0, 0, -5000}, {1, 0, -5000}},                       // below the ground
        {{lattice.x(3), lattice.y(5), ground}, {50, 50, 0}},  // at a vertex
        {{1e9, -1e9, 1e9}, {0, 0, 0}},                        // far away
        {{0, 0, 500}, {0, 0, 0}},                             // straight down
        {{0, 0, 500}, {0, 0, 1000}},                          // straight up
    };
    for (const auto& [eye, target] : places) {
        for (const double fov : {1e-3, 1.0, 3.14}) {
            SCOPED_TRACE(testing::Message()
                         << "eye " << eye.transpose() << ", field of view " << fov);
            const View view = look_at(eye, target, fov, 64, 64).value();
            pager.update(std::vector<CameraNeed>{{.view = view}}, {}, 0.0);
            const TerrainMesh mesh = triangulator.update(pager.resident(), view);
            EXPECT_LE(mesh.triangle_count, 10'000u);
            EXPECT_EQ(find_flaw(make_soup(mesh), lattice), "");
            EXPECT_LE(test::measure_error_px(make_soup(mesh), *source, view, 4), mesh.error_px);
        }
    }
}

TEST(Triangulator, RefusesAViewThatIsNotFiniteAndKeepsTheLastMesh) {
    const auto source = small_fractal(9);
    ASSERT_NE(source, nullptr);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    Triangulator triangulator = Triangulator::create(*source, {}).value();
    View view = look_at({0, 0, 300}, {100, 0, 0}, 1.0, 640, 360).value();
    pager.update(std::vector<CameraNeed>{{.view = view}}, {}, 0.0);
    const std::size_t count = triangulator.update(pager.resident(), view).triangle_count;
    View broken = view;
    broken.eye_world.y() = std::numeric_limits<double>::quiet_NaN();
    const TerrainMesh kept = triangulator.update(pager.resident(), broken);
    EXPECT_EQ(kept.status, MeshStatus::invalid_view);
    EXPECT_EQ(kept.triangle_count, count);
    EXPECT_EQ(kept.refused_views, 1u);
    broken = view;
    broken.vertical_fov = std::numbers::pi;
    EXPECT_EQ(triangulator.update(pager.resident(), broken).refused_views, 2u);
    EXPECT_EQ(triangulator.update(pager.resident(), view).triangle_count, count);
}

TEST(Triangulator, ReportsNotResidentWithoutRoots) {
    const auto source = small_fractal(10);
    ASSERT_NE(source, nullptr);
    Triangulator triangulator = Triangulator::create(*source, {}).value();
    const auto empty = std::make_shared<const ResidentSet>(
        source->lattice(), source->extent(), std::vector<std::shared_ptr<const Chunk>>{}, 1);
    const View view = look_at({0, 0, 300}, {100, 0, 0}, 1.0, 640, 360).value();
    const TerrainMesh mesh = triangulator.update(empty, view);
    EXPECT_EQ(mesh.status, MeshStatus::not_resident);
    EXPECT_EQ(mesh.triangle_count, 0u);
}

TEST(Triangulator, RefusesABudgetBelowTheRoots) {
    const auto source = small_fractal(10);
    ASSERT_NE(source, nullptr);
    EXPECT_TRUE(Triangulator::create(*source, {.triangle_budget = 8}).has_value());
    const auto refused = Triangulator::create(*source, {.triangle_budget = 7});
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("got 7"), std::string::npos);
    EXPECT_FALSE(Triangulator::create(*source, {.max_error_px = 0.0}).has_value());
    EXPECT_FALSE(
        Triangulator::create(*source, {.max_error_px = std::numeric_limits<double>::quiet_NaN()})
            .has_value());
}

// One root of one level with the same bound everywhere.
TEST(Triangulator, WorksOnAWorldOfASingleChunk) {
    Lattice lattice{.spacing = 10.0};
    const test::WaveHeights source(lattice, 30.0, 400.0);
    std::vector<std::shared_ptr<const Chunk>> chunks{make_chunk(source, {0, 0, 0}).value()};
    const auto set = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    const View view = look_at({600, 600, 200}, {700, 700, 0}, 1.0, 640, 360).value();
    for (const std::size_t budget : {2u, 3u, 100u, 100'000u}) {
        Triangulator triangulator =
            Triangulator::create(source, {.triangle_budget = budget, .max_error_px = 0.001})
                .value();
        const TerrainMesh mesh = triangulator.update(set, view);
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_EQ(find_flaw(make_soup(mesh), lattice), "");
        EXPECT_LE(test::measure_error_px(make_soup(mesh), source, view, 8), mesh.error_px);
    }
    Triangulator all =
        Triangulator::create(source, {.triangle_budget = 100'000, .max_error_px = 0.001}).value();
    const TerrainMesh mesh = all.update(set, view);
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
    EXPECT_GT(by_budget, 20);
    EXPECT_GT(by_vertices, 5);
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
    EXPECT_GT(blocked_by_others, 20);
    EXPECT_GT(blocked_by_ground, 10);
    EXPECT_GT(granted_all, 10);
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
