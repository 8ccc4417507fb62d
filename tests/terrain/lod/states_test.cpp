// SPDX-License-Identifier: MIT
//
// P1 to P3 and P9 in random states: worlds, resident sets, fades, views, budgets and error targets. 5,000 states;
// 100,000 in long runs.
#include "support/grounds.h"
#include "support/mesh_checks.h"
#include "support/random_world.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace terrane::test {
namespace states_test {

constexpr int kShards = 5;
const int kWorlds = few_or_many(8, 160);  // per shard
constexpr int kFlights = 5;               // per world
constexpr int kFrames = 25;               // per flight
constexpr int kPoints = 2000;             // points measured per frame

TriangulatorSettings random_settings(Random& random, const RandomWorld& world) {
    TriangulatorSettings settings;
    const std::size_t least = world.root_triangles();
    switch (random.below(8)) {
        case 0:
            settings.triangle_budget = least;
            break;
        case 1:
            settings.triangle_budget = least + static_cast<std::size_t>(random.below(12));
            break;
        case 2:
            settings.triangle_budget = 50'000;
            break;
        default:
            settings.triangle_budget =
                least + static_cast<std::size_t>(random_magnitude(random, 1.0, 5'000.0));
    }
    settings.max_error_px = random_magnitude(random, 0.02, 100.0);
    settings.morph_ratio = random.below(4) == 0 ? 1.0 : random.between(1.0, 3.0);
    settings.open_chunks = 1 + static_cast<std::size_t>(random.below(40));
    return settings;
}

// Describes the first violation in a frame; "" if there is none.
std::string find_fault(const TerrainMesh& mesh, const RandomWorld& world, const View& view,
                       const TriangulatorSettings& settings) {
    std::ostringstream out;
    if (mesh.triangle_count > settings.triangle_budget) {
        out << mesh.triangle_count << " triangles; ";
    }
    out << find_flaw(mesh);
    if ((mesh.status == MeshStatus::error_met) != (mesh.error_px <= settings.max_error_px)) {
        out << name_of(mesh.status) << " with an error of " << mesh.error_px << " px; ";
    }
    const auto count = static_cast<int>(mesh.triangle_count);
    const double measured =
        measure_error_px(make_soup(mesh), world.source(), view, std::max(1, kPoints / count));
    if (!(measured <= mesh.error_px)) {
        out << "measured " << measured << " px, certified " << mesh.error_px << "; ";
    }
    const double far_px = measure_error_px(make_soup(mesh), world.source(), view,
                                           std::max(1, kPoints / 4 / count), mesh.finest_error_m);
    if (!(far_px <= mesh.refinable_error_px) || !(mesh.refinable_error_px <= mesh.error_px)) {
        out << "measured " << far_px << " px beyond " << mesh.finest_error_m << " m, certified "
            << mesh.refinable_error_px << " of " << mesh.error_px;
    }
    return out.str();
}

bool is_morphing(const TerrainMesh& mesh) {
    return std::any_of(mesh.chunks.begin(), mesh.chunks.end(),
                       [](const MeshChunk& part) { return part.offsets != nullptr; });
}

class States : public testing::TestWithParam<int> {};

TEST_P(States, KeepBudgetCertificateAndBitsAndAreWatertight) {
    const auto seed = static_cast<std::uint64_t>(GetParam());
    Random random(seed);
    int counted = 0, with_error = 0, morphing = 0;
    for (int w = 0; w < kWorlds; ++w) {
        const RandomWorld world(random, 12);
        RandomResidence residence(world);
        for (int flight = 0; flight < kFlights; ++flight) {
            const TriangulatorSettings settings = random_settings(random, world);
            Triangulator kept = Triangulator::create(world.source(), settings).value();
            View view;
            for (int frame = 0; frame < kFrames; ++frame) {
                view = residence.fly(random, frame == 0 ? nullptr : &view);
                SCOPED_TRACE(testing::Message()
                             << "seed " << seed << ", world " << w << " (" << world.describe()
                             << "), flight " << flight << ", frame " << frame << ", budget "
                             << settings.triangle_budget << ", target " << settings.max_error_px
                             << " px, morph ratio " << settings.morph_ratio << ", eye "
                             << view.eye_world.transpose() << ", field of view "
                             << view.vertical_fov);
                if (random.below(40) == 0) {
                    View broken = view;
                    broken.eye_world.x() = std::numeric_limits<double>::quiet_NaN();
                    EXPECT_EQ(kept.update(residence.resident(), broken).status,
                              MeshStatus::invalid_view);
                }
                const TerrainMesh mesh = kept.update(residence.resident(), view);
                ASSERT_EQ(find_fault(mesh, world, view, settings), "");
                ++counted;
                with_error += mesh.error_px > 0.0 ? 1 : 0;
                morphing += is_morphing(mesh) ? 1 : 0;
                if (random.below(2) == 0) continue;
                TriangulatorSettings others = settings;
                others.open_chunks = 1;
                others.worker_count = random.below(16) == 0 ? 1 + random.below(4) : 1;
                Triangulator fresh = Triangulator::create(world.source(), others).value();
                const TerrainMesh again = fresh.update(residence.resident(), view);
                ASSERT_EQ(find_difference(mesh, again), "") << "kept or fresh triangulator";
            }
        }
    }
    EXPECT_EQ(counted, kWorlds * kFlights * kFrames);
    EXPECT_GT(with_error, counted / 2);  // some views see only the sky
    EXPECT_GT(morphing, counted / 4);
}

INSTANTIATE_TEST_SUITE_P(Seed, States, testing::Range(1, 1 + kShards));

}  // namespace states_test

namespace large_budget_test {

// The meshes of large budgets are watertight and use them to the last few triangles. One root of three levels, or in
// long runs of five, all resident: 8,388,608 triangles at the finest level.
TEST(LargeBudget, IsUsedUpToEightMillionTriangles) {
    const auto source = FractalHeights::create({.seed = 8,
                                                .octave_count = 5,
                                                .amplitude = 100.0,
                                                .wavelength_log2 = 6,
                                                .gain = 0.7,
                                                .root_size_log2 = few_or_many(9, 11),
                                                .first_root_x = 0,
                                                .first_root_y = 0,
                                                .root_count_x = 1,
                                                .root_count_y = 1})
                            .value();
    const auto set = std::make_shared<const ResidentSet>(source->lattice(), source->extent(),
                                                         all_chunks(*source), 1);
    const double scale = source->lattice().root_size() / 2048.0;
    const View view =
        look_at(scale * WorldPos(-100, -100, 700), scale * WorldPos(1200, 1000, 0), 1.2, 1920, 1080)
            .value();
    const int most = few_or_many(300'000, 8'000'000);
    for (const int triangles : {most / 8, most * 3 / 8, most}) {
        SCOPED_TRACE(triangles);
        const auto budget = static_cast<std::size_t>(triangles);
        Triangulator triangulator =
            Triangulator::create(*source, {.triangle_budget = budget, .max_error_px = 1e-6})
                .value();
        const TerrainMesh mesh = triangulator.update(set, view);
        EXPECT_LE(mesh.triangle_count, budget);
        EXPECT_GE(static_cast<double>(mesh.triangle_count), 0.97 * static_cast<double>(budget));
        EXPECT_EQ(mesh.status, MeshStatus::budget_reached);
        EXPECT_EQ(find_flaw(mesh), "");
    }
}

}  // namespace large_budget_test
}  // namespace terrane::test
