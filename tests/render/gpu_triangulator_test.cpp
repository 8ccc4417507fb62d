// SPDX-License-Identifier: MIT
//
// The device's triangles against the CPU's, bit for bit, in random states: worlds, resident sets, fades, views, budgets
// and error targets. 180 states; 10,020 in long runs.
#include "support/mesh_checks.h"
#include "support/random_world.h"

#include <terrane/render/gpu_triangulator.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <sstream>
#include <utility>

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

std::string difference(const TerrainMesh& a, const TerrainMesh& b) {
    std::ostringstream out;
    if (a.triangle_count != b.triangle_count || a.chunks.size() != b.chunks.size()) {
        out << a.triangle_count << " triangles of " << a.chunks.size() << " chunks or "
            << b.triangle_count << " of " << b.chunks.size();
        return out.str();
    }
    if (a.threshold_px != b.threshold_px) {
        out << "threshold " << a.threshold_px << " or " << b.threshold_px;
        return out.str();
    }
    // the device's error is an upper bound
    const auto is_bound = [](double cpu, double gpu) {
        return cpu == gpu || (cpu <= gpu && gpu <= 1.001 * cpu);
    };
    if (!is_bound(a.error_px, b.error_px) ||
        !is_bound(a.refinable_error_px, b.refinable_error_px) ||
        !is_bound(a.finest_error_m, b.finest_error_m) || a.status != b.status) {
        out.precision(12);
        out << "error " << a.error_px << " or " << b.error_px << ", refinable "
            << a.refinable_error_px << " or " << b.refinable_error_px << ", finest "
            << a.finest_error_m << " or " << b.finest_error_m << ", " << name_of(a.status) << " or "
            << name_of(b.status);
        return out.str();
    }
    if (!std::ranges::equal(a.indices, b.indices)) return "indices";
    for (std::size_t i = 0; i < a.chunks.size(); ++i) {
        const MeshChunk &x = a.chunks[i], &y = b.chunks[i];
        if (x.chunk != y.chunk || x.first_index != y.first_index || x.index_count != y.index_count)
            return "chunks";
        if ((x.offsets == nullptr) != (y.offsets == nullptr)) return "presence of offsets";
        if (x.offsets == nullptr) continue;
        for (std::uint32_t k = 0; k < x.index_count; ++k) {
            const std::uint16_t at = a.indices[x.first_index + k];
            if (std::bit_cast<std::uint32_t>(x.offsets[at]) !=
                std::bit_cast<std::uint32_t>(y.offsets[at])) {
                out << "offset " << x.offsets[at] << " or " << y.offsets[at] << " at sample "
                    << at % 129 << ", " << at / 129 << " of level " << int{x.chunk->key.level};
                return out.str();
            }
        }
    }
    return "";
}

TEST(GpuTriangulator, HasTheBitsOfTheCpuInRandomStates) {
    const GlContext context = GlContext::create(GlChecks::on).value();
    Random random(7);
    int counted = 0;
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
                const bool is_jump = frame == 0 || random.below(6) == 0;
                if (is_jump) {
                    residence.jump(random);
                } else if (random.below(3) != 0) {
                    residence.step(random);
                }
                view = is_jump || random.below(8) == 0 ? random_view(random, world)
                                                       : moved_view(random, world, view);
                SCOPED_TRACE(testing::Message()
                             << "world " << w << " (" << world.describe() << "), flight " << flight
                             << ", frame " << frame << ", budget " << settings.triangle_budget
                             << ", target " << settings.max_error_px << " px, ratio "
                             << settings.morph_ratio << ", eye " << view.eye_world.transpose());
                const TerrainMesh expected = cpu.update(residence.resident(), view);
                const Result<TerrainMesh> updated = gpu.update(residence.resident(), view);
                ASSERT_TRUE(updated.has_value()) << updated.error().message;
                const Result<TerrainMesh> read = gpu.read();
                ASSERT_TRUE(read.has_value()) << read.error().message;
                ASSERT_EQ(difference(expected, *read), "");
                ++counted;
            }
        }
    }
    EXPECT_EQ(counted, kWorlds * kFlights * kFrames);
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
