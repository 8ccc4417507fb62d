// SPDX-License-Identifier: MIT
#include "light/light_levels.h"
#include "render/render_scene.h"
#include "support/grounds.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

namespace terrane::internal {
namespace slope_map_test {

const Chunk& chunk_at(const ResidentSet& resident, const ChunkKey& key) {
    return *resident.chunks()[static_cast<std::size_t>(resident.find(key))];
}

std::vector<std::int16_t> map_of(const ResidentSet& resident, const ChunkKey& key) {
    return make_slope_map(resident, chunk_at(resident, key), find_side_levels(resident, key));
}

// x and y of a sample of a layer.
std::array<int, 2> slope(const std::vector<std::int16_t>& map, int layer, int column, int row) {
    const auto at = 2 * (static_cast<std::size_t>(slope_layer_row(layer) + row) * kSlopeMapWidth +
                         static_cast<std::size_t>(column));
    return {map[at], map[at + 1]};
}

TEST(SlopeMap, FindsTheFinestChunkOnEachSideThatIsNoFiner) {
    const test::Scene scene = test::make_scene();
    EXPECT_EQ(find_side_levels(*scene.resident, {0, 0, 0}), (SideLevels{-1, 0, -1, -1}));
    EXPECT_EQ(find_side_levels(*scene.resident, {1, 1, 1}), (SideLevels{0, 0, 0, -1}));
}

TEST(SlopeMap, NeighboursOfALevelAgreeOnTheirSharedEdgeInEveryLayer) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> west = map_of(*scene.resident, {0, 0, 0});
    const std::vector<std::int16_t> east = map_of(*scene.resident, {1, 0, 0});
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int last = kChunkCells >> layer;
        for (int row = 0; row <= last; ++row) {
            ASSERT_EQ(slope(west, layer, last, row), slope(east, layer, 0, row))
                << "layer " << layer << " row " << row;
        }
    }
}

TEST(SlopeMap, ALayerOfAChunkIsTheFinerLayerOfItsParent) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> parent = map_of(*scene.resident, {0, 0, 0});
    const std::vector<std::int16_t> child = map_of(*scene.resident, {1, 1, 1});
    for (int layer = 1; layer < kSlopeLayers; ++layer) {
        const int last = kChunkCells >> layer;
        for (int row = 0; row <= last; ++row) {
            for (int column = 0; column <= last; ++column) {
                ASSERT_EQ(slope(child, layer, column, row),
                          slope(parent, layer - 1, last + column, last + row))
                    << "layer " << layer << " column " << column << " row " << row;
            }
        }
    }
}

// Bend at a sample of a layer.
int bend(const std::vector<std::int16_t>& map, int layer, int column, int row) {
    return map[static_cast<std::size_t>(slope_layer_row(layer) + row) * kSlopeMapWidth +
               static_cast<std::size_t>(column)];
}

TEST(BendMap, HoldsTheHeightOfTheSurroundingsAndHasNoSeams) {
    const test::Scene scene = test::make_scene();
    const auto bends_of = [&](const ChunkKey& key) {
        return make_bend_map(*scene.resident, chunk_at(*scene.resident, key),
                             find_side_levels(*scene.resident, key));
    };
    const std::vector<std::int16_t> parent = bends_of({0, 0, 0}), east = bends_of({1, 0, 0});
    const std::vector<std::int16_t> child = bends_of({1, 1, 1});
    int hollows = 0, tops = 0;
    for (int layer = 0; layer < kSlopeLayers; ++layer) {
        const int last = kChunkCells >> layer;
        for (int row = 0; row <= last; ++row) {
            ASSERT_EQ(bend(parent, layer, last, row), bend(east, layer, 0, row));
            for (int column = 0; layer > 0 && column <= last; ++column) {
                ASSERT_EQ(bend(child, layer, column, row),
                          bend(parent, layer - 1, last + column, last + row));
            }
        }
    }
    for (int row = 1; row < kChunkCells; row += 5) {
        for (int column = 1; column < kChunkCells; column += 5) {
            const double x = 2.0 * column, y = 2.0 * row;
            const double mean = 0.25 * (scene.height(x + 2.0, y) + scene.height(x - 2.0, y) +
                                        scene.height(x, y + 2.0) + scene.height(x, y - 2.0));
            const double wanted = (mean - scene.height(x, y)) / 2.0;
            ASSERT_NEAR(bend(parent, 0, column, row) / 32767.0, wanted, 3e-4);
            (wanted > 0.0 ? hollows : tops) += 1;
        }
    }
    EXPECT_GT(std::min(hollows, tops), 100);
}

TEST(SlopeMap, HoldsTheNormalOfTheSurface) {
    const test::Scene scene = test::make_scene();
    const std::vector<std::int16_t> map = map_of(*scene.resident, {0, 0, 0});
    for (int row = 1; row < kChunkCells; row += 7) {
        for (int column = 1; column < kChunkCells; column += 7) {
            const double x = 2.0 * column, y = 2.0 * row;
            const double east = (scene.height(x + 2.0, y) - scene.height(x - 2.0, y)) / 4.0;
            const double north = (scene.height(x, y + 2.0) - scene.height(x, y - 2.0)) / 4.0;
            const double length = std::sqrt(east * east + north * north + 1.0);
            const std::array<int, 2> packed = slope(map, 0, column, row);
            // one quantum of height over four metres, and half a step of the quantized normal
            EXPECT_NEAR(packed[0] / 32767.0, -east / length, 1.5e-4);
            EXPECT_NEAR(packed[1] / 32767.0, -north / length, 1.5e-4);
        }
    }
}

}  // namespace slope_map_test

namespace light_levels_test {

using test::small_world;
using test::WaveHeights;
using Chunks = std::vector<std::shared_ptr<const Chunk>>;

std::shared_ptr<const Chunk> make(const WaveHeights& source, const ChunkKey& key) {
    Result<std::shared_ptr<const Chunk>> chunk = make_chunk(source, key);
    EXPECT_TRUE(chunk) << (chunk ? "" : chunk.error().message);
    return chunk ? std::move(*chunk) : nullptr;
}

void add_roots(const WaveHeights& source, Chunks& chunks) {
    const Lattice& lattice = source.lattice();
    for (int i = 0; i < lattice.root_count_x * lattice.root_count_y; ++i) {
        chunks.push_back(make(source, {lattice.first_root_x + i % lattice.root_count_x,
                                       lattice.first_root_y + i / lattice.root_count_x, 0}));
    }
}

std::shared_ptr<const ResidentSet> make_set(const WaveHeights& source, const Chunks& chunks) {
    return std::make_shared<const ResidentSet>(source.lattice(), source.extent(), chunks, 1);
}

// A field of view so small that every chunk is lit.
View view_from(const WorldPos& eye) {
    View view = *look_at(eye, eye + WorldPos(0.0, 1.0, -1.0), 0.02, 320, 180);
    return view;
}

// The field at a position in a chunk, 0 to 1 along its sides, as in shade.frag.
double level_at(const LitChunk& lit, double x, double y) {
    const int column = std::min(static_cast<int>(2.0 * x), 1);
    const int row = std::min(static_cast<int>(2.0 * y), 1);
    const auto node = [&](int i, int j) {
        return double{lit.nodes[static_cast<std::size_t>(3 * (row + j) + column + i)].level};
    };
    const double u = 2.0 * x - column, v = 2.0 * y - row;
    return (1.0 - v) * ((1.0 - u) * node(0, 0) + u * node(1, 0)) +
           v * ((1.0 - u) * node(0, 1) + u * node(1, 1));
}

// The field of the finest lit chunk at a world position: its limit from the north-east or from the south-west.
double level_at(const LightLevels& levels, const Lattice& lattice, double x, double y,
                bool from_north_east) {
    double finest = -1.0;
    for (const LitChunk& lit : levels.lit()) {
        const double side =
            lattice.spacing * static_cast<double>(lattice.chunk_side(lit.key.level));
        const double u = (x - lattice.x(lattice.corner(lit.key).x)) / side;
        const double v = (y - lattice.y(lattice.corner(lit.key).y)) / side;
        const bool is_inside = from_north_east ? u >= 0.0 && u < 1.0 && v >= 0.0 && v < 1.0
                                               : u > 0.0 && u <= 1.0 && v > 0.0 && v <= 1.0;
        // coarse to fine
        if (is_inside) finest = level_at(lit, u, v);
    }
    return finest;
}

// Largest step across a border, on a grid that contains every border.
double largest_step(const LightLevels& levels, const Lattice& lattice) {
    const double cell = lattice.spacing * static_cast<double>(lattice.chunk_side(4)) / 4.0;
    const auto count = static_cast<int>(
        std::lround(static_cast<double>(lattice.east() - lattice.west()) * lattice.spacing / cell));
    double largest = 0.0;
    for (int row = 1; row < count; ++row) {
        for (int column = 1; column < count; ++column) {
            const double x = lattice.x(lattice.west()) + cell * column;
            const double y = lattice.y(lattice.south()) + cell * row;
            largest = std::max(largest, std::abs(level_at(levels, lattice, x, y, true) -
                                                 level_at(levels, lattice, x, y, false)));
        }
    }
    return largest;
}

TEST(LightLevels, AreContinuousAcrossChunksOfAnyLevelsWhileTheyComeAndGo) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const WaveHeights source(small_world(4, 1.0), 12.0, 900.0);
    const Lattice& lattice = source.lattice();
    LightLevels levels(2048);
    Chunks chunks;
    add_roots(source, chunks);
    std::vector<float> fades(chunks.size(), 1.0f);
    const View view = view_from({10.0, 20.0, 500.0});
    bool has_between = false;
    for (int frame = 0; frame < 24; ++frame) {
        if (frame % 3 == 0) {
            // adds absent children of random chunks
            const std::size_t count = chunks.size();
            for (std::size_t i = 0; i < count; ++i) {
                const ChunkKey key = chunks[i]->key;
                if (key.level == lattice.finest_level) continue;
                const ChunkKey child = key.child(static_cast<int>(random() % 4));
                const bool is_there = std::any_of(chunks.begin(), chunks.end(),
                                                  [&](const auto& c) { return c->key == child; });
                if (is_there || random() % 3 != 0) continue;
                chunks.push_back(make(source, child));
                fades.push_back(1.0f);
            }
        }
        // one chunk in five fades out
        for (std::size_t i = 4; i < fades.size(); i += 5) fades[i] *= 0.9f;
        levels.update(std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, fades,
                                                          static_cast<std::uint64_t>(frame)),
                      view);
        ASSERT_EQ(levels.lit().size(), chunks.size());
        ASSERT_LT(largest_step(levels, lattice), 1e-5) << "frame " << frame;
        for (const LitChunk& lit : levels.lit()) {
            for (const LightNode& node : lit.nodes) {
                ASSERT_LE(node.level, static_cast<float>(lit.key.level));
                has_between = has_between || (node.own > 0.0f && node.own < 1.0f);
            }
        }
    }
    EXPECT_TRUE(has_between);
}

class LightLevelsTest : public testing::Test {
protected:
    LightLevelsTest() { add_roots(source_, roots_); }

    // The root at the origin with all its children.
    Chunks with_children() {
        Chunks chunks = roots_;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            chunks.push_back(make(source_, ChunkKey{0, 0, 0}.child(quadrant)));
        }
        return chunks;
    }
    // Level at the corner shared by the children.
    static double middle(const LightLevels& levels) {
        return double{levels.lit().back().nodes[0].level};
    }

    WaveHeights source_{small_world(2, 1.0), 12.0, 900.0};
    Chunks roots_;
    View view_ = view_from({100.0, 200.0, 500.0});
};

TEST_F(LightLevelsTest, TheFirstFrameShowsEverything) {
    LightLevels levels(64);
    levels.update(make_set(source_, with_children()), view_);
    EXPECT_EQ(middle(levels), 1.0);
}

TEST_F(LightLevelsTest, ChunksThatArriveFadeInAndThoseWhoseFadeFallsFadeOut) {
    LightLevels levels(64);
    levels.update(make_set(source_, roots_), view_);
    const Chunks chunks = with_children();
    std::shared_ptr<const ResidentSet> set = make_set(source_, chunks);
    double last = 0.0;
    for (int frame = 1; frame <= LightLevels::kFadeFrames; ++frame) {
        levels.update(set, view_);
        EXPECT_NEAR(middle(levels), last + 1.0 / LightLevels::kFadeFrames, 1e-6);
        last = middle(levels);
    }
    EXPECT_EQ(last, 1.0);
    std::vector<float> fades(chunks.size(), 1.0f);
    for (int frame = 1; frame <= LightLevels::kFadeFrames; ++frame) {
        for (std::size_t i = 4; i < 8; ++i) fades[i] *= 0.9f;
        set = std::make_shared<const ResidentSet>(*set, fades, static_cast<std::uint64_t>(frame));
        levels.update(set, view_);
        EXPECT_NEAR(middle(levels), last - 1.0 / LightLevels::kFadeFrames, 1e-6);
        last = middle(levels);
    }
    EXPECT_NEAR(last, 0.0, 1e-6);
}

TEST_F(LightLevelsTest, ChunksShowAtOnceWhereTheEyeJumpsAndWithTheirParents) {
    LightLevels levels(64);
    levels.update(make_set(source_, roots_), view_);
    levels.update(make_set(source_, with_children()), view_from({5000.0, 200.0, 500.0}));
    EXPECT_EQ(middle(levels), 1.0);

    LightLevels other(64);
    other.update(make_set(source_, {roots_[0], roots_[1]}), view_);
    other.update(make_set(source_, with_children()), view_);
    // the root at the origin is the last of the four
    EXPECT_EQ(middle(other), 1.0);
}

TEST_F(LightLevelsTest, KeepsItsLevelAtTheEdgeOfTheWorld) {
    LightLevels levels(64);
    levels.update(make_set(source_, with_children()), view_);
    // its north-eastern corner is that of the world
    EXPECT_EQ(levels.lit().back().nodes[8].level, 1.0f);
    // the root to the south-west has no children
    EXPECT_EQ(levels.lit()[4].nodes[0].level, 0.0f);
}

TEST_F(LightLevelsTest, LeavesOutChunksThatAreFinerThanPixels) {
    LightLevels levels(64);
    View wide = view_;
    wide.vertical_fov = 1.5;
    wide.eye_world.z() = 50'000.0;
    levels.update(make_set(source_, with_children()), wide);
    EXPECT_EQ(levels.lit().size(), 4u);
}

TEST_F(LightLevelsTest, ChunksWithoutALayerAreAbsentAndLeaveNoStep) {
    LightLevels levels(6);
    const Chunks chunks = with_children();
    levels.update(make_set(source_, chunks), view_);
    EXPECT_EQ(levels.lit().size(), 6u);
    for (const LitChunk& lit : levels.lit()) EXPECT_TRUE(lit.layer >= 0 && lit.layer < 6);
    // the corner shared by the two lit children and the two others
    EXPECT_EQ(levels.lit()[4].nodes[8].level, 0.0f);
    EXPECT_EQ(levels.lit()[4].nodes[4].level, 1.0f);
}

}  // namespace light_levels_test
}  // namespace terrane::internal

// Light where chunks of different levels meet. On rough ground seen from above, the difference from a picture lit by
// coarse chunks only measures how fine the slopes of the light are.

namespace terrane {
namespace terrain_light_test {

using test::make_rough_scene;
using test::pixel;
using test::Scene;

constexpr int kWidth = 480;
constexpr int kHeight = 160;
constexpr int kBand = 16;  // pixel columns

constexpr std::array<ChunkKey, 8> kAllFine{ChunkKey{0, 0, 1}, ChunkKey{1, 0, 1}, ChunkKey{0, 1, 1},
                                           ChunkKey{1, 1, 1}, ChunkKey{2, 0, 1}, ChunkKey{3, 0, 1},
                                           ChunkKey{2, 1, 1}, ChunkKey{3, 1, 1}};
constexpr std::array<ChunkKey, 4> kWesternFine{ChunkKey{0, 0, 1}, ChunkKey{1, 0, 1},
                                               ChunkKey{0, 1, 1}, ChunkKey{1, 1, 1}};

class TerrainLightTest : public test::PictureTest<kWidth, kHeight> {
protected:
    // Straight down on the centre of the two roots, 1 m per pixel.
    static Image draw(TerrainRenderer& renderer, const Scene& scene) {
        const double height = kHeight / (2.0 * std::tan(0.15));
        return test::draw(renderer, scene.mesh(),
                          view_from({256.0, 128.0, height}, {256.0, 128.0, 0.0}, 0.3));
    }

    Image draw_coarse() {
        TerrainRenderer renderer = make();
        return draw(renderer, make_rough_scene({}, {}));
    }
};

// The mean of value(x, y) in each band of columns.
template <class Value>
std::vector<double> means(const Value& value) {
    std::vector<double> found;
    for (int band = 0; band < kWidth / kBand; ++band) {
        double sum = 0.0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = band * kBand; x < (band + 1) * kBand; ++x) sum += value(x, y);
        }
        found.push_back(sum / (kHeight * kBand));
    }
    return found;
}

// Differences of red from the picture lit by coarse chunks only.
std::vector<double> contrasts(const Image& image, const Image& coarse) {
    return means(
        [&](int x, int y) { return std::abs(pixel(image, x, y)[0] - pixel(coarse, x, y)[0]); });
}

std::vector<double> brightnesses(const Image& image) {
    return means([&](int x, int y) { return int{pixel(image, x, y)[0]}; });
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
