// SPDX-License-Identifier: MIT
//
// Keys and threshold against slow oracles in random worlds, resident sets, fades and views: every own key raised to the
// parents' keys one vertex at a time, and a threshold from all keys sorted.
#include "lod/selection.h"

#include "lod/frame_mesh.h"
#include "support/random_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <vector>

namespace terrane::internal::selection_test {

constexpr std::uint64_t kSeed = 20261201;

struct Frame {
    explicit Frame(const test::RandomWorld& of)
        : world(&of), keys(of.source(), best_simd_level(), 4), selection(1) {}

    void compute(const ResidentSet& resident, const View& view, float floor, float guess) {
        screen = std::make_unique<ScreenError>(view, world->source(), 0.0);
        selection.begin(floor, guess);
        keys.compute(resident, *screen, pins, floor, selection, team);
    }

    const test::RandomWorld* world;
    VertexKeys keys;
    Selection selection;
    SolidPins pins;
    WorkerTeam team{1};
    std::unique_ptr<ScreenError> screen;
};

// Calls use(column, row, area, kind, square) for a chunk's own vertices in its open areas.
template <typename Use>
void for_vertices(const OpenChunk& chunk, const Use& use) {
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < kChunkCells;
             column += row % 2 == 0 ? 2 : 1) {
            const auto [area, kind, square] = AreaVertices::address_of(column, row);
            if (chunk.is_open(static_cast<int>(area))) use(column, row, area, kind, square);
        }
    }
}

// The larger key of the parents of a chunk's own vertex: kNever where the chunk of a parent is not open.
float parents_of(const OpenChunk& chunk, int column, int row) {
    const auto wrap = [](int i) { return (i + kChunkCells) % kChunkCells; };
    const auto centre = [&](int x, int y) {
        const Side side = x < 0 ? west : south;
        if (x >= 0 && y >= 0) return chunk.key_at(x, y);
        if (chunk.at_world_border[side]) return 0.0f;
        const OpenChunk* const owner = chunk.neighbour[side];
        return owner == nullptr ? OpenChunk::kNever : owner->key_at(wrap(x), wrap(y));
    };
    if (row % 2 == 0) return std::max(centre(column, row - 1), centre(column, row + 1));
    if (column % 2 == 0) return std::max(centre(column - 1, row), centre(column + 1, row));
    // the corners of the square that its diagonal does not join, as samples of the coarser spacing
    const OpenChunk& owner = chunk.is_root() ? chunk : *chunk.parent;
    const ChunkKey& key = chunk.chunk->key;
    const int scale = chunk.is_root() ? 2 : 1;
    const int x = column / 2 + (!chunk.is_root() && (key.x & 1) != 0 ? kChunkSquares : 0);
    const int y = row / 2 + (!chunk.is_root() && (key.y & 1) != 0 ? kChunkSquares : 0);
    const auto corner = [&](int to_x, int to_y) {
        return owner.key_at(scale * (x + to_x), scale * (y + to_y));
    };
    return (column / 2 + row / 2) % 2 == 0 ? std::max(corner(1, 0), corner(0, 1))
                                           : std::max(corner(0, 0), corner(1, 1));
}

float fade_of(const OpenChunk& chunk, int column, int row) {
    const OpenChunk* const beyond = row == 0 ? chunk.neighbour[south] : chunk.neighbour[west];
    return (column > 0 && row > 0) || beyond == nullptr
               ? chunk.fade_factor
               : std::max(chunk.fade_factor, beyond->fade_factor);
}

TEST(Keys, BelowTheFloorAreOwnKeysRaisedToTheParentsKeys) {
    test::SeededRandom random(kSeed);
    long below = 0, above = 0;
    for (int w = 0; w < 12; ++w) {
        const test::RandomWorld world(random, 12);
        test::RandomResidence residence(world);
        Frame frame(world);
        for (int i = 0; i < 8; ++i) {
            const View view = residence.fly(random, nullptr);
            const auto floor = static_cast<float>(test::random_magnitude(random, 1e2, 1e10));
            frame.compute(*residence.resident(), view, floor, 0.0f);
            std::array<std::array<float, AreaVertices::kSquares>, 3> own{};
            std::size_t of_area = OpenChunk::kAreas;
            for (const OpenChunk* const chunk : frame.keys.open()) {
                of_area = OpenChunk::kAreas;
                for_vertices(*chunk, [&](int column, int row, std::size_t area, std::size_t kind,
                                         std::size_t square) {
                    if (area != of_area) {
                        of_area = area;
                        for (std::size_t k = 0; k < 3; ++k) {
                            frame.keys.own_keys(*chunk, static_cast<int>(area),
                                                static_cast<AreaVertices::Kind>(k), own[k].data());
                        }
                    }
                    const float key = chunk->keys_of(static_cast<int>(area))[kind][square];
                    const float wanted = std::max(own[kind][square] * fade_of(*chunk, column, row),
                                                  parents_of(*chunk, column, row));
                    (wanted < floor ? below : above) += 1;
                    if (wanted < floor) {
                        ASSERT_EQ(key, wanted) << world.describe() << ", " << column << ", " << row;
                    } else {
                        ASSERT_GE(key, floor) << world.describe() << ", " << column << ", " << row;
                    }
                });
            }
        }
    }
    std::printf("%ld keys below the floor, %ld above\n", below, above);
    EXPECT_GT(below, 50'000);
    EXPECT_GT(above, 50'000);
}

// The keys of all open vertices and their numbers of triangles.
std::vector<WeightedKey> all_keys(const Frame& frame) {
    std::vector<WeightedKey> all;
    for (const OpenChunk* const chunk : frame.keys.open()) {
        const auto add = [&](float key, bool is_border) {
            all.push_back({key, is_border ? 1u : 2u});
        };
        for_vertices(*chunk, [&](int column, int row, std::size_t area, std::size_t kind,
                                 std::size_t square) {
            add(chunk->keys_of(static_cast<int>(area))[kind][square],
                (column == 0 && chunk->at_world_border[west]) ||
                    (row == 0 && chunk->at_world_border[south]));
        });
        for (std::size_t i = 0; i < chunk->east_keys.size(); ++i) {
            if (chunk->at_world_border[east]) add(chunk->east_keys[i], true);
            if (chunk->at_world_border[north]) add(chunk->north_keys[i], true);
        }
        if (!chunk->is_root()) continue;
        for (int row = 0; row <= kChunkCells; row += 2) {
            for (int column = 0; column <= kChunkCells; column += 2) {
                const bool is_last_column = column == kChunkCells, is_last_row = row == kChunkCells;
                // otherwise the vertex is the neighbour's
                if (is_last_column && !chunk->at_world_border[east]) continue;
                if (is_last_row && !chunk->at_world_border[north]) continue;
                add(chunk->coarse_key(column, row),
                    is_last_column || is_last_row ||
                        (column == 0 && chunk->at_world_border[west]) ||
                        (row == 0 && chunk->at_world_border[south]));
            }
        }
    }
    return all;
}

float sorted_threshold(std::vector<WeightedKey> all, float floor, std::size_t budget) {
    std::ranges::sort(all, {}, &WeightedKey::key);
    std::size_t used = 0;
    for (auto group = all.begin(); group != all.end() && group->key < floor;) {
        const float key = group->key;
        for (; group != all.end() && group->key == key; ++group) used += group->weight;
        if (used > budget) return key;
    }
    return floor;
}

TEST(Selection, FindsTheThresholdOfAllKeysSortedAndItsVertices) {
    test::SeededRandom random(kSeed + 1);
    int inside = 0, by_floor = 0;
    for (int w = 0; w < 12; ++w) {
        const test::RandomWorld world(random, 12);
        test::RandomResidence residence(world);
        Frame frame(world);
        float last = 0.0f;
        for (int i = 0; i < 24; ++i) {
            const View view = residence.fly(random, nullptr);
            const auto floor = static_cast<float>(test::random_magnitude(random, 1e2, 1e10));
            const auto budget = static_cast<std::size_t>(test::random_magnitude(random, 1.0, 3e4));
            // none, the last threshold, or the right one
            float guess = random.below(3) == 0 ? 0.0f : std::min(last, floor);
            frame.compute(*residence.resident(), view, floor, guess);
            const std::vector<WeightedKey> all = all_keys(frame);
            const float wanted = sorted_threshold(all, floor, budget);
            if (random.below(3) == 0) {
                guess = wanted * static_cast<float>(random.between(0.97, 1.03));
                frame.compute(*residence.resident(), view, floor, std::min(guess, floor));
            }
            const float threshold =
                frame.selection.find(frame.keys.open(), frame.keys.kernels(), budget, frame.team);
            ASSERT_EQ(threshold, wanted) << world.describe() << ", floor " << floor << ", budget "
                                         << budget << ", guess " << guess;
            (threshold < floor ? inside : by_floor) += 1;
            last = threshold;
            std::size_t triangles = root_triangles(world.lattice()), drawn = 0;
            for (const WeightedKey& each : all) triangles += each.key < wanted ? each.weight : 0;
            for (OpenChunk* const chunk : frame.keys.open()) {
                mark_active(*chunk, frame.keys.kernels(), threshold);
                std::size_t centres = 0, midpoints = 0;
                for_vertices(*chunk, [&](int column, int row, std::size_t area, std::size_t kind,
                                         std::size_t square) {
                    const bool is_active = (chunk->bits[area].of(kind) >> square & 1) != 0;
                    ASSERT_EQ(is_active,
                              chunk->keys_of(static_cast<int>(area))[kind][square] < threshold)
                        << world.describe() << ", " << column << ", " << row;
                    (kind == AreaVertices::centre ? centres : midpoints) += is_active ? 1 : 0;
                });
                ASSERT_EQ(chunk->centre_count, centres);
                ASSERT_EQ(chunk->midpoint_count, midpoints);
            }
            for (const OpenChunk* const chunk : frame.keys.open()) {
                drawn += count_triangles(*chunk, threshold);
            }
            ASSERT_EQ(drawn, triangles) << world.describe();
        }
    }
    std::printf("%d thresholds below the floor, %d at the floor\n", inside, by_floor);
    EXPECT_GT(inside, 50);
    EXPECT_GT(by_floor, 50);
}

}  // namespace terrane::internal::selection_test
