// SPDX-License-Identifier: MIT
//
// Light where chunks of different levels meet. On rough ground seen from above, the difference from a picture lit by
// coarse chunks only measures how fine the slopes of the light are.
#include "render/gl_test.h"
#include "render/scene.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace terrane {
namespace terrain_light_test {

using test::make_rough_scene;
using test::Scene;

constexpr int kWidth = 480;
constexpr int kHeight = 160;
constexpr int kBand = 16;  // pixel columns

constexpr std::array<ChunkKey, 8> kAllFine{ChunkKey{0, 0, 1}, ChunkKey{1, 0, 1}, ChunkKey{0, 1, 1},
                                           ChunkKey{1, 1, 1}, ChunkKey{2, 0, 1}, ChunkKey{3, 0, 1},
                                           ChunkKey{2, 1, 1}, ChunkKey{3, 1, 1}};
constexpr std::array<ChunkKey, 4> kWesternFine{ChunkKey{0, 0, 1}, ChunkKey{1, 0, 1},
                                               ChunkKey{0, 1, 1}, ChunkKey{1, 1, 1}};

class TerrainLightTest : public test::GlTest {
protected:
    TerrainRenderer make() {
        Result<TerrainRenderer> made = TerrainRenderer::create(*context_, kWidth, kHeight, {});
        EXPECT_TRUE(made) << made.error().message;
        return std::move(*made);
    }

    // Straight down on the centre of the two roots, 1 m per pixel.
    static Image draw(TerrainRenderer& renderer, const Scene& scene) {
        const double height = kHeight / (2.0 * std::tan(0.15));
        const View view =
            *look_at({256.0, 128.0, height}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight);
        const Result<void> drawn = renderer.draw(scene.mesh(), view);
        EXPECT_TRUE(drawn) << drawn.error().message;
        return renderer.read();
    }

    Image draw_coarse() {
        TerrainRenderer renderer = make();
        return draw(renderer, make_rough_scene({}, {}));
    }
};

// Mean difference from the picture lit by coarse chunks only, in each band of columns.
std::vector<double> contrasts(const Image& image, const Image& coarse) {
    std::vector<double> found;
    for (int band = 0; band < kWidth / kBand; ++band) {
        double sum = 0.0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = band * kBand; x < (band + 1) * kBand; ++x) {
                const auto at = 3 * static_cast<std::size_t>(y * kWidth + x);
                sum += std::abs(int{image.rgb[at]} - int{coarse.rgb[at]});
            }
        }
        found.push_back(sum / (kHeight * kBand));
    }
    return found;
}

std::vector<double> brightnesses(const Image& image) {
    std::vector<double> found;
    for (int band = 0; band < kWidth / kBand; ++band) {
        double sum = 0.0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = band * kBand; x < (band + 1) * kBand; ++x) {
                sum += image.rgb[3 * static_cast<std::size_t>(y * kWidth + x)];
            }
        }
        found.push_back(sum / (kHeight * kBand));
    }
    return found;
}

double largest_step(const std::vector<double>& values, std::size_t first, std::size_t last) {
    double largest = 0.0;
    for (std::size_t i = first; i < last; ++i) {
        largest = std::max(largest, std::abs(values[i + 1] - values[i]));
    }
    return largest;
}

double mean(const std::vector<double>& values, std::size_t first, std::size_t last) {
    return std::accumulate(values.begin() + static_cast<std::ptrdiff_t>(first),
                           values.begin() + static_cast<std::ptrdiff_t>(last), 0.0) /
           static_cast<double>(last - first);
}

constexpr std::size_t kBands = kWidth / kBand;
constexpr std::size_t kMiddle = kBands / 2;

TEST_F(TerrainLightTest, HasNoBorderWhereACoarseChunkDrawsBesideAFineOne) {
    TerrainRenderer renderer = make();
    const Image fine = draw(renderer, make_rough_scene(kAllFine, kAllFine));
    // the root draws the east, though its children are resident
    const Image mixed = draw(renderer, make_rough_scene(kAllFine, kWesternFine));
    const Image coarse = draw_coarse();
    const std::vector<double> of_fine = contrasts(fine, coarse);
    const std::vector<double> of_mixed = contrasts(mixed, coarse);
    ASSERT_GT(mean(of_fine, 0, kBands), 4.0);
    // bands differ no more than those of the fine picture
    const double usual = largest_step(of_fine, 0, kBands - 1);
    ASSERT_LT(usual, 0.3 * mean(of_fine, 0, kBands));
    EXPECT_LE(largest_step(of_mixed, 0, kBands - 1), 1.3 * usual);
    EXPECT_LE(largest_step(brightnesses(mixed), 0, kBands - 1),
              1.3 * largest_step(brightnesses(fine), 0, kBands - 1) + 0.5);
    for (std::size_t i = 0; i < kBands; ++i) {
        EXPECT_NEAR(of_mixed[i], of_fine[i], 0.1 * of_fine[i]) << "band " << i;
    }
}

TEST_F(TerrainLightTest, FadesToCoarseLightTowardsAbsentChunks) {
    TerrainRenderer renderer = make();
    const std::vector<double> found =
        contrasts(draw(renderer, make_rough_scene(kWesternFine, kWesternFine)), draw_coarse());
    const double inside = mean(found, 0, kMiddle - 5), beyond = mean(found, kMiddle, kBands);
    ASSERT_GT(inside, 4.0);
    EXPECT_LT(beyond, 0.1 * inside);
    // the transition is 64 m wide: four bands
    EXPECT_LE(largest_step(found, 0, kBands - 1), 0.45 * (inside - beyond));
}

TEST_F(TerrainLightTest, FadesInWithoutABorderWhereChunksArrive) {
    TerrainRenderer renderer = make();
    const Scene before = make_rough_scene(kWesternFine, {});
    Scene after = make_rough_scene(kAllFine, {});
    const std::shared_ptr<const ResidentSet> made = after.resident;
    // the earlier chunks are the same objects: only the eastern four arrive
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const std::shared_ptr<const Chunk>& chunk : made->chunks()) {
        const std::int32_t held = before.resident->find(chunk->key);
        chunks.push_back(held == ResidentSet::kNone
                             ? chunk
                             : std::shared_ptr<const Chunk>(
                                   before.resident->chunks()[static_cast<std::size_t>(held)]));
    }
    after.resident = std::make_shared<const ResidentSet>(before.resident->lattice(),
                                                         before.resident->extent(), chunks, 2);
    for (MeshChunk& drawn : after.chunks) {
        drawn.chunk = after.resident->find_chunk(drawn.chunk->key);
    }
    const Image coarse = draw_coarse();
    const std::vector<double> first = contrasts(draw(renderer, before), coarse);
    std::vector<std::vector<double>> frames{first};
    for (int frame = 0; frame < 20; ++frame) {
        frames.push_back(contrasts(draw(renderer, after), coarse));
    }
    const std::vector<double>& last = frames.back();
    const double gain = mean(last, kMiddle + 2, kBands) - mean(first, kMiddle + 2, kBands);
    ASSERT_GT(gain, 2.0);
    const double usual = largest_step(last, 0, kBands - 1);
    for (std::size_t frame = 1; frame < frames.size(); ++frame) {
        // continuous in time
        for (std::size_t i = 0; i < kBands; ++i) {
            EXPECT_LE(std::abs(frames[frame][i] - frames[frame - 1][i]), 0.2 * gain)
                << "frame " << frame << ", band " << i;
        }
        // continuous in space
        EXPECT_LE(largest_step(frames[frame], 0, kBands - 1), 0.45 * gain + usual)
            << "frame " << frame;
    }
}

}  // namespace terrain_light_test
}  // namespace terrane
