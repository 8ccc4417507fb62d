// SPDX-License-Identifier: MIT
//
// Frames with volumes whose triangles of the heightfield are the device's, against those of the CPU, bit for bit.
#include "render/render_scene.h"
#include "support/random_world.h"
#include "volume/joined_mesh.h"
#include "volume/volume_frames.h"

#include <terrane/render/gpu_triangulator.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>

namespace terrane::gpu_volumes_test {

using namespace test;

constexpr int kSets = 4, kFrames = 3;  // of a scene; of a set

int scene_count() { return few_or_many(12, 500); }

bool is_same(const MeshSolid& a, const MeshSolid& b) {
    const auto is_same_span = [](const MeshSolid::Triangles& x, const MeshSolid::Triangles& y) {
        return x.size() == y.size() && (x.empty() || x.data() == y.data());
    };
    return a.chunk == b.chunk && is_same_span(a.triangles, b.triangles) &&
           std::equal(a.caps.begin(), a.caps.end(), b.caps.begin(), is_same_span);
}

std::shared_ptr<const HeightSource> random_source(Random& random, int corner) {
    const auto ground = random_hills(random);
    for (;;) {
        const auto volumes = Volumes::create(
            ground->lattice(), random_operations(random, *ground, corner), {.level = kFinest});
        // volumes beyond the world are refused
        if (volumes) return VolumeHeights::create(ground, *volumes).value();
    }
}

TriangulatorSettings random_settings(Random& random) {
    TriangulatorSettings settings;
    const int most = random.below(3) == 0 ? 5'000 : 100'000;
    settings.triangle_budget = static_cast<std::size_t>(2 + random.below(most));
    settings.max_error_px = std::exp(random.between(-3.0, 3.0));
    settings.morph_ratio = random.below(2) == 0 ? 1.0 : random.between(1.0, 2.0);
    return settings;
}

TEST(GpuVolumes, LeaveTheBitsOfTheCpuInRandomStates) {
    const GlContext context = GlContext::create(GlChecks::on).value();
    int frames = 0, drawn = 0, replacing = 0, omitted = 0, with_caps = 0;
    for (int seed = 1; seed <= scene_count(); ++seed) {
        Random random(static_cast<std::uint64_t>(seed));
        const int corner = random.below(3) == 0 ? 8 : 4;  // on the world's border
        const auto source = random_source(random, corner);
        Chunks chunks(*source);
        const TriangulatorSettings settings = random_settings(random);
        Triangulator cpu = Triangulator::create(*source, settings).value();
        GpuTriangulator gpu = GpuTriangulator::create(context, *source, settings).value();
        for (int set = 0; set < kSets; ++set) {
            const auto resident = random_residents(random, chunks, *source, corner);
            for (int frame = 0; frame < kFrames; ++frame) {
                SCOPED_TRACE("seed " + std::to_string(seed) + ", set " + std::to_string(set) +
                             ", frame " + std::to_string(frame));
                const double distance = random_magnitude(random, 5.0, frame == 0 ? 1e4 : 200.0);
                const View view = random_view(random, distance, corner);
                const TriangleDemand demand = {
                    .threshold_px = random_magnitude(random, 0.1, 100.0),
                    .triangles = static_cast<std::uint32_t>(random.below(1000))};
                const TerrainMesh expected = cpu.update(resident, view, {&demand, 1});
                const Result<TerrainMesh> updated = gpu.update(resident, view, {&demand, 1});
                ASSERT_TRUE(updated.has_value()) << updated.error().message;
                TerrainMesh mesh = gpu.read().value();
                EXPECT_LE(expected.error_px, mesh.error_px);
                EXPECT_LE(mesh.error_px, 1.001 * expected.error_px);
                EXPECT_LE(mesh.triangle_count, settings.triangle_budget);
                mesh.error_px = expected.error_px;
                ASSERT_EQ(find_difference(expected, mesh), "");
                ASSERT_TRUE(std::ranges::equal(expected.solids, mesh.solids, is_same));
                ASSERT_EQ(mesh.demand_triangles, expected.demand_triangles);
                ASSERT_EQ(FrameMesh(mesh).find_flaw(mesh), "");
                ++frames;
                drawn += mesh.solids.empty() ? 0 : 1;
                omitted += mesh.solids.size() < resident->solids().size() ? 1 : 0;
                for (const MeshSolid& solid : mesh.solids) {
                    replacing += solid.chunk->solid->triangles().replaced.empty() ? 0 : 1;
                    for (const auto& cap : solid.caps) with_caps += cap.empty() ? 0 : 1;
                }
            }
        }
    }
    EXPECT_EQ(frames, scene_count() * kSets * kFrames);
    EXPECT_GT(drawn, frames / 8);
    EXPECT_GT(replacing, frames / 16);
    EXPECT_GT(omitted, frames / 8);
    EXPECT_GT(with_caps, 0);
}

constexpr int kWidth = 320, kHeight = 200;
class GpuVolumePicture : public PictureTest<kWidth, kHeight> {};

TEST_F(GpuVolumePicture, IsThatOfTheCpu) {
    TerrainRenderer renderer = make({.shadow_distance = 500.0});
    int replacing = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Random random(seed);
        const auto source = random_source(random, 4);
        Chunks chunks(*source);
        const auto resident = random_residents(random, chunks, *source);
        const TriangulatorSettings settings{.triangle_budget = 50'000, .max_error_px = 0.5};
        Triangulator cpu = Triangulator::create(*source, settings).value();
        GpuTriangulator gpu = GpuTriangulator::create(*context_, *source, settings).value();
        const View view = view_from({470.0, 470.0, 60.0}, {512.0, 512.0, 0.0});
        const TerrainMesh expected = cpu.update(resident, view);
        // light maps take some pictures to follow the eye
        Image from_cpu, before;
        for (int i = 0; i < 60 && (i < 2 || from_cpu.rgb != before.rgb); ++i) {
            ASSERT_TRUE(renderer.draw(expected, view));
            before = std::exchange(from_cpu, renderer.read());
        }
        ASSERT_TRUE(renderer.draw(gpu.update(resident, view).value(), view));
        const Image from_gpu = renderer.read();
        std::size_t different = 0;
        int most = 0;
        for (std::size_t i = 0; i < from_cpu.rgb.size(); ++i) {
            const int by = std::abs(int{from_cpu.rgb[i]} - int{from_gpu.rgb[i]});
            different += by > 0;
            most = std::max(most, by);
        }
        EXPECT_LE(different, from_cpu.rgb.size() / 1000) << "seed " << seed;
        EXPECT_LE(most, 1) << "seed " << seed;
        for (const MeshSolid& solid : expected.solids)
            replacing += solid.chunk->solid->triangles().replaced.empty() ? 0 : 1;
    }
    EXPECT_GT(replacing, 0);
}

}  // namespace terrane::gpu_volumes_test
