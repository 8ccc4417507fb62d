// SPDX-License-Identifier: MIT
// The checks of the benchmark find what they look for.
#include "replay.h"

#include "benchmark/mesh_measure.h"
#include "support/random.h"

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

namespace terrane::bench {
namespace replay_test {

/// A source whose heights are not those that it samples: what it certifies is wrong.
class Shifted final : public ForwardedHeights {
public:
    Shifted(std::shared_ptr<const HeightSource> base, double shift)
        : ForwardedHeights(std::move(base)), shift_(shift) {}
    double height(double x, double y) const override { return heights().height(x, y) + shift_; }

private:
    double shift_;
};

class Replay : public testing::Test {
protected:
    void SetUp() override {
        ground.name = "test";
        ground.source =
            FractalHeights::create(
                {.seed = 5, .amplitude = 60.0, .wavelength_log2 = 9, .root_size_log2 = 11})
                .value();
        ground.far_m = 2000.0;
        frames = fly(ground, plan, settings, std::size_t{1} << 30, Clock::wall);
        ASSERT_EQ(frames.size(), 6u);
    }

    TerrainMesh mesh_of(std::size_t frame, Triangulator& triangulator) const {
        return triangulator.update(frames[frame].resident, frames[frame].view);
    }
    ReplayReport play() const { return replay(ground, settings, frames, {.points = 500}); }

    BenchmarkGround ground;
    FlightPlan plan{4, 2};
    TriangulatorSettings settings{.triangle_budget = 3000, .max_error_px = 1e-3};
    std::vector<FlightFrame> frames;
};

TEST_F(Replay, LooksAtEveryFrame) {
    const ReplayReport report = play();
    EXPECT_EQ(report.frames, 6);
    EXPECT_EQ(report.checked, 6);
    EXPECT_GT(report.points, 2500u);
    EXPECT_EQ(report.over_budget, 0);
    EXPECT_EQ(report.flawed, 0) << report.first_fault;
    EXPECT_EQ(report.not_reproduced, 0) << report.first_fault;
    EXPECT_EQ(report.uncertified, 0) << report.first_fault;
    EXPECT_GT(report.worst_ratio, 0.0);
    EXPECT_GT(report.worst_move_px, 0.0);
}

TEST_F(Replay, FindsAnErrorAboveItsCertificate) {
    ground.source = std::make_shared<const Shifted>(ground.source, 500.0);
    const ReplayReport report = play();
    EXPECT_EQ(report.uncertified, 6);
    EXPECT_EQ(report.violations(), 6);
    EXPECT_NE(report.first_fault.find("frame 0: measured"), std::string::npos);
}

TEST_F(Replay, FindsAMeshThatIsNotTheTimedOne) {
    frames[3].error_px += 0.5;
    const ReplayReport report = play();
    EXPECT_EQ(report.not_reproduced, 1);
    EXPECT_NE(report.first_fault.find("frame 3"), std::string::npos);
}

// From a frame with all that was loaded to one with the roots alone and back.
TEST_F(Replay, MeasuresMovement) {
    const double before = play().worst_move_px;
    const ResidentSet& all = *frames[2].resident;
    std::vector<std::shared_ptr<const Chunk>> roots;
    for (const auto& chunk : all.chunks()) {
        if (chunk->key.level == 0) roots.push_back(chunk);
    }
    frames[2].resident =
        std::make_shared<const ResidentSet>(all.lattice(), all.extent(), roots, 1'000'000);
    EXPECT_GT(play().worst_move_px, 2.0 * before);
}

TEST_F(Replay, LocatorFindsEveryTriangleAndMissesTheOneThatIsGone) {
    Triangulator triangulator = Triangulator::create(*ground.source, settings).value();
    MeshCopy copy(mesh_of(0, triangulator));
    const Lattice& lattice = ground.source->lattice();
    const auto middle_of = [&](const MeshChunk& part, std::uint32_t first) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint16_t sample = copy.indices[first + k];
            sum += Eigen::Vector3d(
                lattice.x(part.chunk->corner.x + (sample % kChunkSamples) * part.chunk->step),
                lattice.y(part.chunk->corner.y + (sample / kChunkSamples) * part.chunk->step),
                part.displayed_height(sample, lattice.quantum));
        }
        return Eigen::Vector3d(sum / 3.0);
    };
    std::size_t count = 0;
    {
        const MeshLocator locator(copy.view(), lattice);
        EXPECT_EQ(locator.stray_count(), 0u);
        for (const MeshChunk& part : copy.parts) {
            for (std::uint32_t i = 0; i < part.index_count; i += 3, ++count) {
                const Eigen::Vector3d middle = middle_of(part, part.first_index + i);
                const auto found = locator.displayed_height(middle.x(), middle.y());
                ASSERT_TRUE(found.has_value());
                EXPECT_NEAR(*found, middle.z(), 1e-6);
            }
        }
        EXPECT_EQ(count, copy.view().triangle_count);
    }
    MeshChunk& last = copy.parts.back();
    const Eigen::Vector3d gone = middle_of(last, last.first_index + last.index_count - 3);
    last.index_count -= 3;
    EXPECT_FALSE(MeshLocator(copy.view(), lattice).displayed_height(gone.x(), gone.y()));
    // twice the same triangle, and one that is no half of a square
    for (std::uint32_t k = 0; k < 3; ++k) {
        copy.indices[last.first_index + k] = copy.indices[last.first_index + 3 + k];
    }
    copy.indices[last.first_index + 6] = copy.indices[last.first_index + 7];
    EXPECT_EQ(MeshLocator(copy.view(), lattice).stray_count(), 2u);
}

TEST_F(Replay, FindsTheDifferenceOfOneBit) {
    Triangulator triangulator = Triangulator::create(*ground.source, settings).value();
    const TerrainMesh mesh = mesh_of(1, triangulator);
    MeshCopy copy(mesh);
    EXPECT_EQ(find_difference(mesh, copy.view()), "");
    std::uint16_t& index = copy.indices[copy.parts.back().first_index];
    index ^= 1u;
    EXPECT_NE(find_difference(mesh, copy.view()), "");
    index ^= 1u;
    EXPECT_EQ(find_difference(mesh, copy.view()), "");
    MeshChunk& part = copy.parts.back();
    if (part.offsets == nullptr) {
        copy.offsets.back().assign(std::size_t{kChunkSamples} * kChunkSamples, 0.0f);
    }
    part.offsets = copy.offsets.back().data();
    EXPECT_EQ(find_difference(mesh, copy.view()), "");
    float& offset = copy.offsets.back()[index];
    offset = std::nextafter(offset, 1.0f);
    EXPECT_NE(find_difference(mesh, copy.view()), "");
}

TEST_F(Replay, DenseMeasureFindsASpikeOfTheTruth) {
    Triangulator triangulator = Triangulator::create(*ground.source, settings).value();
    const TerrainMesh mesh = mesh_of(0, triangulator);
    const Measured found = measure_densely(mesh, *ground.source, frames[0].view, true);
    EXPECT_GT(found.points, 50'000u);
    EXPECT_LE(found.error_px, mesh.error_px);
    EXPECT_GT(found.error_px, 0.1 * mesh.error_px);
    const Shifted shifted(ground.source, 500.0);
    EXPECT_GT(measure_densely(mesh, shifted, frames[0].view, true).error_px, mesh.error_px);
}

TEST(MeasureSamples, IsTheErrorOfTheSamples) {
    const auto table = std::make_shared<const test::TableHeights>(test::make_fbm_table(129));
    std::vector<std::shared_ptr<const Chunk>> chunks{make_chunk(*table, {0, 0, 0}).value()};
    const auto set =
        std::make_shared<const ResidentSet>(table->lattice(), table->extent(), chunks, 1);
    const View view = look_at({64, 64, 300}, {70, 64, 0}, 1.0, 640, 360).value();
    Triangulator coarse =
        Triangulator::create(*table, {.triangle_budget = 2, .max_error_px = 1.0}).value();
    const TerrainMesh mesh = coarse.update(set, view);
    const auto height = [&](int x, int y) { return static_cast<double>(table->padded().at(x, y)); };
    double worst = 0.0;  // of the square's two triangles, cut to the north-east
    for (int y = 0; y <= 128; ++y) {
        for (int x = 0; x <= 128; ++x) {
            const double u = x / 128.0, v = y / 128.0;
            const double by_east =
                u * (height(128, 0) - height(0, 0)) + v * (height(128, 128) - height(128, 0));
            const double by_north =
                v * (height(0, 128) - height(0, 0)) + u * (height(128, 128) - height(0, 128));
            worst = std::max(worst,
                             std::abs(height(0, 0) + (x >= y ? by_east : by_north) - height(x, y)));
        }
    }
    EXPECT_NEAR(measure_samples(mesh, *table), worst, 0.001);
}

}  // namespace replay_test
}  // namespace terrane::bench
