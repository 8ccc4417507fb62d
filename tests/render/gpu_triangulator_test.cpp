// SPDX-License-Identifier: MIT
//
// The device's triangles against the CPU's, bit for bit, in random states: worlds, resident sets, fades, views, budgets
// and error targets. 180 states; 10,020 in long runs.
#include "support/random_world.h"

#include <terrane/render/gpu_triangulator.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace terrane::internal {
bool is_above_drawn_ground(const TerrainMesh& mesh, const WorldPos& place);
}  // namespace terrane::internal

namespace terrane::test {
namespace gpu_triangulator_test {

const int kWorlds = few_or_many(6, 334);
constexpr int kFlights = 3;  // per world
constexpr int kFrames = 10;  // per flight

TriangulatorSettings random_settings(Random& random, const RandomWorld& world) {
    TriangulatorSettings settings;
    const std::size_t least = world.root_triangles();
    settings.triangle_budget =
        random.below(6) == 0
            ? least
            : least + static_cast<std::size_t>(random_magnitude(random, 1.0, 20'000.0));
    settings.max_error_px = random_magnitude(random, 0.02, 100.0);
    settings.morph_ratio = random.below(4) == 0 ? 1.0 : random.between(1.0, 3.0);
    return settings;
}

// Whether a bound of the device is at least that of the CPU, and at most 0.1 % larger.
bool is_bound(double cpu, double gpu) { return cpu == gpu || (cpu <= gpu && gpu <= 1.001 * cpu); }

// Demands of objects: none in half of the states, else up to 20, some infinite or never granted.
std::vector<TriangleDemand> random_demands(Random& random) {
    std::vector<TriangleDemand> demands;
    if (random.below(2) == 0) return demands;
    for (int i = random.below(20); i > 0; --i) {
        const double unusual = random.below(2) == 0 ? std::numeric_limits<double>::infinity() : 0.0;
        demands.push_back(
            {.threshold_px = random.below(8) == 0 ? unusual : random_magnitude(random, 0.01, 1e4),
             .triangles = static_cast<std::uint32_t>(random_magnitude(random, 1.0, 5000.0))});
    }
    return demands;
}

// Places around the drawn ground: the eye, points over and beside the world, and points close to random triangles.
std::vector<WorldPos> random_places(Random& random, const RandomWorld& world, const View& view,
                                    const TerrainMesh& mesh) {
    std::vector<WorldPos> places{view.eye_world};
    const Lattice& lattice = world.lattice();
    for (int i = 0; i < 8 && !mesh.chunks.empty(); ++i) {
        const MeshChunk& part = mesh.chunks[static_cast<std::size_t>(
            random.below(static_cast<int>(mesh.chunks.size())))];
        const std::size_t triangle =
            part.first_index +
            3 * static_cast<std::size_t>(random.below(static_cast<int>(part.index_count / 3)));
        const double spacing = lattice.spacing * static_cast<double>(part.chunk->step);
        WorldPos middle = WorldPos::Zero();
        for (const std::uint16_t sample : mesh.indices.subspan(triangle, 3)) {
            const int column = sample % kChunkSamples, row = sample / kChunkSamples;
            middle += WorldPos(lattice.x(part.chunk->corner.x) + column * spacing,
                               lattice.y(part.chunk->corner.y) + row * spacing,
                               part.displayed_height(sample, lattice.quantum)) /
                      3.0;
        }
        middle.z() += random.between(-0.1, 0.1) * spacing;
        places.push_back(middle);
    }
    const WorldRect extent = world.source().extent();
    const double side = extent.east - extent.west;
    for (int i = 0; i < 4; ++i) {
        const double x = random.between(extent.west - 0.1 * side, extent.east + 0.1 * side);
        const double y = random.between(extent.south, extent.north);
        const double z = world.source().height(std::clamp(x, extent.west, extent.east), y);
        places.emplace_back(x, y, z + 0.05 * side * random.between(-1.0, 1.0));
    }
    return places;
}

TEST(GpuTriangulator, HasTheBitsOfTheCpuInRandomStates) {
    const GlContext context = GlContext::create(GlChecks::on).value();
    const std::uint64_t seed = 7;
    Random random(seed);
    int counted = 0, above = 0, not_above = 0, granted = 0, refused = 0;
    for (int w = 0; w < kWorlds; ++w) {
        const RandomWorld world(random, 12);
        RandomResidence residence(world);
        for (int flight = 0; flight < kFlights; ++flight) {
            const TriangulatorSettings settings = random_settings(random, world);
            Triangulator cpu = Triangulator::create(world.source(), settings).value();
            auto made = GpuTriangulator::create(context, world.source(), settings);
            ASSERT_TRUE(made.has_value()) << made.error().message;
            GpuTriangulator gpu = *std::move(made);
            View view;
            for (int frame = 0; frame < kFrames; ++frame) {
                view = residence.fly(random, frame == 0 ? nullptr : &view);
                SCOPED_TRACE(testing::Message()
                             << "seed " << seed << ", world " << w << " (" << world.describe()
                             << "), flight " << flight << ", frame " << frame << ", budget "
                             << settings.triangle_budget << ", target " << settings.max_error_px
                             << " px, ratio " << settings.morph_ratio << ", eye "
                             << view.eye_world.transpose());
                const std::vector<TriangleDemand> demands = random_demands(random);
                const TerrainMesh expected = cpu.update(residence.resident(), view, demands);
                const Result<TerrainMesh> updated = gpu.update(residence.resident(), view, demands);
                ASSERT_TRUE(updated.has_value()) << updated.error().message;
                const Result<TerrainMesh> read = gpu.read();
                ASSERT_TRUE(read.has_value()) << read.error().message;
                EXPECT_TRUE(is_bound(expected.error_px, read->error_px) &&
                            is_bound(expected.refinable_error_px, read->refinable_error_px) &&
                            is_bound(expected.finest_error_m, read->finest_error_m))
                    << "error " << expected.error_px << " or " << read->error_px << ", refinable "
                    << expected.refinable_error_px << " or " << read->refinable_error_px
                    << ", finest " << expected.finest_error_m << " or " << read->finest_error_m;
                TerrainMesh mesh = *read;
                mesh.error_px = expected.error_px;
                ASSERT_EQ(find_difference(expected, mesh), "");
                ASSERT_EQ(mesh.demand_threshold_px, expected.demand_threshold_px);
                ASSERT_EQ(mesh.demand_triangles, expected.demand_triangles);
                std::size_t wanted = 0;
                for (const TriangleDemand& demand : demands) wanted += demand.triangles;
                granted += mesh.demand_triangles > 0;
                refused += mesh.demand_triangles < wanted;
                for (const WorldPos& place : random_places(random, world, view, expected)) {
                    const bool is_above = internal::is_above_drawn_ground(expected, place);
                    ASSERT_EQ(gpu.is_above_ground(place).value(), is_above) << place.transpose();
                    ++(is_above ? above : not_above);
                }
                ++counted;
            }
        }
    }
    EXPECT_EQ(counted, kWorlds * kFlights * kFrames);
    EXPECT_GT(above, counted / 4);
    EXPECT_GT(not_above, counted / 4);
    EXPECT_GT(granted, counted / 8);
    EXPECT_GT(refused, counted / 8);
}

TEST(GpuTriangulator, DrawsThePicturesOfTheCpu) {
    GlContext context = GlContext::create(GlChecks::on).value();
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const TriangulatorSettings settings{.triangle_budget = 20'000, .max_error_px = 0.5};
    Triangulator cpu = Triangulator::create(*source, settings).value();
    GpuTriangulator gpu = GpuTriangulator::create(context, *source, settings).value();
    RendererSettings of_renderer;
    of_renderer.shadow_distance = 2000.0;
    TerrainRenderer renderer = TerrainRenderer::create(context, 320, 200, of_renderer).value();
    const auto mark_of = [](const MeshChunk& chunk) {
        const float share = 0.1f * static_cast<float>(chunk.chunk->key.level);
        return GroundMark{.colour = {share, 0.5f, 0.2f}, .opacity = 0.3f};
    };
    for (int frame = 0; frame < 4; ++frame) {
        const WorldPos eye(0.0, 100.0 * frame, 900.0);
        CameraNeed camera;
        camera.view =
            look_at(eye, eye + Eigen::Vector3d(300.0 * frame, 4000.0, -700.0), 1.0, 320, 200)
                .value();
        pager.update({&camera, 1}, {}, frame);
        pager.finish();
        const TerrainMesh expected = cpu.update(pager.resident(), camera.view);
        // light maps take some pictures to follow the eye
        Image from_cpu, before;
        for (int i = 0; i < 60 && (i < 2 || from_cpu.rgb != before.rgb); ++i) {
            ASSERT_TRUE(renderer.draw(expected, camera.view).has_value());
            before = std::exchange(from_cpu, renderer.read());
        }
        const TerrainMesh mesh = gpu.update(pager.resident(), camera.view).value();
        EXPECT_EQ(mesh.triangle_count, expected.triangle_count);
        const Result<void> drawn = renderer.draw(mesh, camera.view);
        ASSERT_TRUE(drawn.has_value()) << drawn.error().message;
        const Image from_gpu = renderer.read();
        std::size_t different = 0;
        for (std::size_t i = 0; i < from_cpu.rgb.size(); ++i)
            different += from_cpu.rgb[i] != from_gpu.rgb[i];
        // blended marks differ at edges that two chunks share, with the order in which these are drawn
        EXPECT_LE(different, frame < 3 ? 0u : from_cpu.rgb.size() / 1000) << "frame " << frame;
        if (frame == 2) renderer.set_ground_marks(mark_of);
    }
}

}  // namespace gpu_triangulator_test
}  // namespace terrane::test
