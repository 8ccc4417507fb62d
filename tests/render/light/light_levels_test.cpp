// SPDX-License-Identifier: MIT
#include "light/light_levels.h"

#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace terrane::internal {
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
