// SPDX-License-Identifier: MIT
//
// What the pager knows of absent chunks: from their parents, and from the chunks beside them.
#include "paging/chunk_tree.h"

#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal::chunk_tree_test {

using test::SeededRandom;

constexpr int kFinest = 4;
constexpr int kContactLevel = 3;

/// Waves north of y = 0, and flat ground in the south, which deviates from no triangle.
class HalfFlatHeights final : public HeightSource {
public:
    explicit HalfFlatHeights(const Lattice& lattice)
        : HeightSource(lattice, test::whole_extent(lattice)), waves_(lattice, 20.0, 64.0) {}

    double height(double x, double y) const override { return y > 0.0 ? waves_.height(x, y) : 0.0; }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                heights_out[i] = height(lattice().x(grid.corner.x + column * grid.step),
                                        lattice().y(grid.corner.y + row * grid.step));
            }
        }
        return {};
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (auto done = waves_.vertex_bounds(grid, bounds_out); !done) return done;
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                // that of the vertex and its descendants
                const int reach = (row & column & 1) != 0 ? 3 : 2;
                if (grid.corner.y + (row + reach) * grid.step <= 0) bounds_out[i] = 0.0f;
            }
        }
        return {};
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (auto done = waves_.cell_bounds(grid, bounds_out); !done) return done;
        const auto width = static_cast<std::size_t>(grid.columns - 1);
        for (int row = 0; row + 1 < grid.rows; ++row) {
            if (grid.corner.y + (row + 1) * grid.step > 0) continue;
            std::fill_n(bounds_out.begin() + static_cast<std::ptrdiff_t>(width) * row, width, 0.0f);
        }
        return {};
    }
    HeightInterval interval(const WorldRect& rect) const override {
        return rect.north > 0.0 ? waves_.interval(rect) : HeightInterval{0.0, 0.0};
    }
    double rise_bound(double distance) const override { return waves_.rise_bound(distance); }

private:
    test::WaveHeights waves_;
};

const HalfFlatHeights& ground() {
    static const HalfFlatHeights heights(test::small_world(kFinest, 1.0));
    return heights;
}

std::shared_ptr<const Chunk> chunk_of(const ChunkKey& key) {
    static std::map<ChunkKey, std::shared_ptr<const Chunk>> made;
    std::shared_ptr<const Chunk>& chunk = made[key];
    if (!chunk) chunk = make_chunk(ground(), key).value();
    return chunk;
}

void outline(ChunkTree& tree, ChunkTree::Index index) {
    tree.replace(index, std::make_shared<const ChunkOutline>(make_outline(
                            *tree[index].chunk, kContactLevel, ground().lattice().quantum)));
}

/// A tree with the same chunks and outlines, inserted by level.
ChunkTree rebuilt(const ChunkTree& tree) {
    std::vector<ChunkTree::Index> nodes;
    for (ChunkTree::Index i = 0; i < tree.capacity(); ++i) {
        if (!tree[i].is_free()) nodes.push_back(i);
    }
    std::sort(nodes.begin(), nodes.end(), [&](ChunkTree::Index a, ChunkTree::Index b) {
        return ResidentSet::Order()(tree[a].key, tree[b].key);
    });
    ChunkTree made(ground().lattice(), chunks_of(ground()));
    for (const ChunkTree::Index i : nodes) {
        const ChunkTree::Index index = made.insert(chunk_of(tree[i].key));
        if (tree[i].chunk == nullptr) outline(made, index);
    }
    return made;
}

void expect_same_quadrants(const ChunkTree& a, const ChunkTree& b) {
    for (ChunkTree::Index i = 0; i < a.capacity(); ++i) {
        if (a[i].is_free() || a[i].key.level == kFinest) continue;
        const ChunkTree::Quadrants& of_a = a.quadrants(i);
        const ChunkTree::Quadrants& of_b = b.quadrants(b.find(a[i].key));
        EXPECT_EQ(of_a.bounds, of_b.bounds);
        for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
            EXPECT_EQ(of_a.boxes[quadrant].low, of_b.boxes[quadrant].low);
            EXPECT_EQ(of_a.boxes[quadrant].high, of_b.boxes[quadrant].high);
        }
    }
}

TEST(ChunkTree, QuadrantsDependOnWhatIsResidentAlone) {
    SeededRandom random(61);
    ChunkTree tree(ground().lattice(), chunks_of(ground()));
    std::vector<ChunkKey> roots = tree.roots();
    for (int step = 0; step < 1500; ++step) {
        ChunkKey key =
            roots[static_cast<std::size_t>(random.below(static_cast<int>(roots.size())))];
        while (key.level < kFinest && tree.find(key) != ChunkTree::kNone && random.below(6) > 0)
            key = key.child(random.below(4));
        const ChunkTree::Index index = tree.find(key);
        if (index == ChunkTree::kNone) {
            tree.insert(chunk_of(key));
        } else if (tree[index].child_count == 0 && random.below(2) == 0) {
            tree.erase(index);
        } else if (tree[index].chunk == nullptr || random.below(2) == 0) {
            tree.replace(index, chunk_of(key));
        } else if (key.level > 0 && key.level < kContactLevel) {
            outline(tree, index);
        }
        if (step % 50 == 49) expect_same_quadrants(tree, rebuilt(tree));
    }
    EXPECT_GT(tree.size(), 20u);
}

TEST(ChunkTree, AMidpointBesideAnAbsentChunkRaisesItsBound) {
    ChunkTree tree(ground().lattice(), chunks_of(ground()));
    const ChunkKey north{0, 0, 0}, south{0, -1, 0};
    tree.insert(chunk_of(south));
    const auto of_south = [&] { return tree.quadrants(tree.find(south)); };
    const double of_flat = ground().lattice().quantum;  // the rounding of heights
    EXPECT_LE(of_south().bounds[2], of_flat);
    tree.insert(chunk_of(north));
    EXPECT_LE(of_south().bounds[2], of_flat);
    const ChunkTree::Index child = tree.insert(chunk_of(north.child(0)));
    EXPECT_GT(of_south().bounds[2], 1.0);
    EXPECT_LE(of_south().bounds[3], of_flat);
    EXPECT_GE(of_south().boxes[2].high.z(),
              ground().lattice().quantum * chunk_of(north.child(0))->high);
    tree.erase(child);
    EXPECT_LE(of_south().bounds[2], of_flat);
}

TEST(ChunkTree, MeshesBesideFlatGroundGetAllChunksThatTheyNeed) {
    SeededRandom random(62);
    Pager pager = Pager::create(std::make_shared<HalfFlatHeights>(ground().lattice()), {}).value();
    Triangulator triangulator =
        Triangulator::create(ground(), {.triangle_budget = 400'000, .max_error_px = 1.0}).value();
    for (int i = 0; i < 8; ++i) {
        const WorldPos eye(random.between(-1500, 1500), random.between(-3000, 500),
                           random.between(50, 1500));
        const View view =
            look_at(eye, {random.between(-500, 500), 0.0, 0.0}, 1.0, 640, 480).value();
        TerrainMesh mesh;
        for (int round = 0; round < 6; ++round) {
            const std::array cameras{CameraNeed{.view = view, .threshold_px = 0.5}};
            pager.update(cameras, {}, 100.0 * i + round);
            pager.finish();
            mesh = triangulator.update(pager.resident(), view);
        }
        EXPECT_EQ(pager.stats().late_chunks, 0u);
        EXPECT_NE(mesh.status, MeshStatus::not_resident) << mesh.error_px;
    }
}

}  // namespace terrane::internal::chunk_tree_test
