// SPDX-License-Identifier: MIT
#include "chunk/chunk_outline.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/resident_set.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <tuple>

namespace terrane::resident_set_test {

using Chunks = std::vector<std::shared_ptr<const Chunk>>;
using namespace test;

// The four roots and two children of the first, not in the order of a set.
Chunks some_chunks(const HeightSource& source) {
    Chunks chunks;
    const ChunkKey first{-1, -1, 0};
    for (const ChunkKey& key : {first.child(3), ChunkKey{0, 0, 0}, first, first.child(0),
                                ChunkKey{0, -1, 0}, ChunkKey{-1, 0, 0}}) {
        chunks.push_back(make_chunk(source, key).value());
    }
    return chunks;
}

TEST(ResidentSet, KnowsWhetherAnyChunkHasASolid) {
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const Chunks plain = some_chunks(source);
    Chunks with = plain;
    Chunk changed(*plain[3]);
    changed.solid = std::make_shared<const SolidSurface>(SolidTriangles{});
    with[3] = std::make_shared<const Chunk>(changed);
    const ResidentSet without(source.lattice(), source.extent(), plain, 1);
    const ResidentSet one(source.lattice(), source.extent(), with, 1);
    EXPECT_FALSE(without.has_solids());
    EXPECT_TRUE(one.has_solids());
    const std::vector<ChunkKey> key{plain[3]->key};
    const std::vector<float> fades(plain.size(), 1.0f);
    const ResidentSet gone(one, key, {}, std::vector<float>(plain.size() - 1, 1.0f), 2,
                           one.window());
    EXPECT_FALSE(gone.has_solids());
    EXPECT_TRUE(ResidentSet(gone, {}, {with[3]}, fades, 3, gone.window()).has_solids());
    EXPECT_FALSE(ResidentSet(one, key, {plain[3]}, fades, 2, one.window()).has_solids());
    EXPECT_TRUE(ResidentSet(without, key, {with[3]}, fades, 2, one.window()).has_solids());
}

TEST(ResidentSet, SharesItsChunksWithASetOfOtherFades) {
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const Chunks chunks = some_chunks(source);
    auto first = std::make_shared<const ResidentSet>(source.lattice(), source.extent(), chunks, 1);
    std::vector<float> fades(chunks.size(), 0.5f);
    fades[4] = 0.25f;
    const ResidentSet second(*first, fades, 2);
    EXPECT_TRUE(second.has_same_chunks(*first));
    EXPECT_EQ(second.chunks().data(), first->chunks().data());
    EXPECT_EQ(second.epoch(), 2u);
    EXPECT_EQ(second.fade(4), 0.25f);
    EXPECT_EQ(second.fade(0), 0.5f);
    EXPECT_EQ(first->fade(4), 1.0f);
    const ResidentSet apart(source.lattice(), source.extent(), chunks, 1);
    EXPECT_FALSE(apart.has_same_chunks(*first));

    first.reset();  // the shared part outlives the first set
    EXPECT_TRUE(second.has_roots());
    EXPECT_EQ(second.links(static_cast<std::size_t>(second.find({-2, -2, 1}))).parent,
              second.find({-1, -1, 0}));
}

// Undrawn chunks against an ordered map, through sets derived from each other, while older sets live.
TEST(ResidentSet, HoldsTheUndrawnChunksThatItWasGiven) {
    constexpr std::uint64_t kSeed = 5;
    SeededRandom random(kSeed);
    const test::WaveHeights source(test::small_world(2, 1.0), 20.0, 70.0);
    const auto plain = make_chunk(source, {0, 0, 1}).value();
    Chunk changed(*plain);
    changed.solid = std::make_shared<const SolidSurface>(SolidTriangles{});
    const auto solid = std::make_shared<const Chunk>(changed);
    const auto outline = std::make_shared<const internal::ChunkOutline>(
        internal::make_outline(*plain, 2, source.lattice().quantum));
    const Chunks drawn = some_chunks(source);
    const auto draw_key = [&](int side) {
        return ChunkKey{random.below(side) - side / 2, random.below(side) - side / 2,
                        static_cast<std::uint8_t>(1 + random.below(3))};
    };
    using Map = std::map<ChunkKey, UndrawnChunk>;
    struct State {
        std::shared_ptr<const ResidentSet> set;
        Map map;
    };
    std::vector<State> states{
        {std::make_shared<const ResidentSet>(source.lattice(), source.extent(), drawn, 1), {}}};
    std::size_t most = 0;
    for (int round = 0; round < 400; ++round) {
        State next = states.back();
        std::vector<ChunkKey> removed;
        std::vector<UndrawnChunk> added;
        // grows, then shrinks
        const bool grows = round < 200;
        const int side = round % 3 == 0 ? 4 : 60;
        for (int i = random.below(40); i > 0 && !next.map.empty() && (!grows || i % 4 == 0); --i) {
            auto found = next.map.lower_bound(draw_key(60));
            if (found == next.map.end()) found = next.map.begin();
            removed.push_back(found->first);
            next.map.erase(found);
        }
        for (int i = random.below(grows ? 60 : 4); i > 0; --i) {
            const ChunkKey key = draw_key(side);
            const bool is_new = std::ranges::none_of(
                added, [&](const UndrawnChunk& chunk) { return chunk.key == key; });
            if (!is_new || std::ranges::find(removed, key) != removed.end()) continue;
            const int what = random.below(8);
            added.push_back({key,
                             what == 0  ? solid
                             : what < 4 ? plain
                                        : nullptr,
                             what < 4 ? nullptr : outline});
            next.map[key] = added.back();
        }
        next.set =
            std::make_shared<const ResidentSet>(*next.set, removed, added, next.set->epoch() + 1);
        most = std::max(most, next.map.size());
        states.push_back(std::move(next));
        if (states.size() > 4) states.erase(states.begin());
        for (const State& state : states) {
            ASSERT_EQ(state.set->undrawn_count(), state.map.size()) << "round " << round;
            ASSERT_TRUE(state.set->has_same_chunks(*states.front().set));
            bool has_solid = false;
            for (const auto& [key, held] : state.map) {
                const UndrawnChunk* const found = state.set->find_undrawn(key);
                ASSERT_NE(found, nullptr);
                ASSERT_EQ(found->key, key);
                ASSERT_EQ(found->chunk, held.chunk);
                ASSERT_EQ(found->outline, held.outline);
                if (state.set->find(key) == ResidentSet::kNone) {
                    ASSERT_EQ(state.set->find_ground(key), held.chunk.get());
                    ASSERT_EQ(state.set->share_ground(key), held.chunk);
                    ASSERT_EQ(state.set->find_chunk(key), nullptr);
                }
                has_solid = has_solid || held.chunk == solid;
            }
            ASSERT_EQ(state.set->has_solids(), has_solid);
            for (int i = 0; i < 20; ++i) {
                const ChunkKey key = draw_key(80);
                ASSERT_EQ(state.set->find_undrawn(key) != nullptr, state.map.contains(key));
            }
        }
    }
    EXPECT_GT(most, 1000u);
    EXPECT_LT(states.back().map.size(), 500u);
    for (const auto& chunk : drawn) {
        EXPECT_EQ(states.back().set->find_ground(chunk->key), chunk.get());
        EXPECT_EQ(states.back().set->share_ground(chunk->key), chunk);
    }
}

// Reference model of a set: an ordered map from keys to chunks and fades.
struct Held {
    std::shared_ptr<const Chunk> chunk;
    float fade = 1.0f;
};
struct GoesBefore {  // independent of ResidentSet::Order
    bool operator()(const ChunkKey& a, const ChunkKey& b) const {
        return std::tie(a.level, a.y, a.x) < std::tie(b.level, b.y, b.x);
    }
};
using Expected = std::map<ChunkKey, Held, GoesBefore>;

std::shared_ptr<const Chunk> fake_chunk(const ChunkKey& key) {
    auto chunk = std::make_shared<Chunk>();
    chunk->key = key;
    return chunk;
}

std::vector<float> fades_of(const Expected& expected) {
    std::vector<float> fades;
    for (const auto& [key, held] : expected) fades.push_back(held.fade);
    return fades;
}

ResidentSet from_scratch(const Lattice& lattice, const Expected& expected, Random& random) {
    std::vector<ChunkKey> keys;
    for (const auto& [key, held] : expected) keys.push_back(key);
    for (std::size_t i = keys.size(); i > 1; --i) {
        std::swap(keys[i - 1], keys[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    }
    Chunks chunks;
    std::vector<float> fades;
    for (const ChunkKey& key : keys) {
        chunks.push_back(expected.at(key).chunk);
        fades.push_back(expected.at(key).fade);
    }
    return {lattice, test::whole_extent(lattice), std::move(chunks), fades, 7};
}

// Describes the first difference; "" if there is none.
std::string difference(const ResidentSet& set, const Lattice& lattice, const Expected& expected) {
    if (!(set.lattice() == lattice)) return "lattice";
    const WorldRect extent = test::whole_extent(lattice);
    if (set.extent().west != extent.west || set.extent().north != extent.north) return "extent";
    if (set.chunks().size() != expected.size()) return "number of chunks";
    if (set.fades().size() != expected.size()) return "number of fades";
    std::map<ChunkKey, std::int32_t> index_by_key;
    for (const auto& [key, held] : expected) {
        index_by_key.emplace(key, static_cast<std::int32_t>(index_by_key.size()));
    }
    const auto index_of = [&](const ChunkKey& key) {
        const auto found = index_by_key.find(key);
        return found == index_by_key.end() ? ResidentSet::kNone : found->second;
    };
    std::size_t i = 0;
    std::int64_t root_count = 0;
    for (const auto& [key, held] : expected) {
        const std::string name = " of " + std::to_string(key.x) + ", " + std::to_string(key.y) +
                                 ", level " + std::to_string(key.level);
        const std::shared_ptr<const Chunk>& owner = set.chunks()[i];
        if (owner != held.chunk || set.chunks()[i]->key != key) return "chunk" + name;
        if (set.fade(i) != held.fade || set.fades()[i] != held.fade) return "fade" + name;

        // relatives in the tree, and neighbours in order
        std::vector<ChunkKey> near{key,
                                   {key.x - 1, key.y, key.level},
                                   {key.x + 1, key.y, key.level},
                                   {key.x, key.y - 1, key.level},
                                   {key.x, key.y + 1, key.level},
                                   {key.y, key.x, key.level},
                                   {-key.x, key.y, key.level}};
        for (int quadrant = 0; quadrant < 4; ++quadrant) near.push_back(key.child(quadrant));
        for (int level = 0; level < 4; ++level) {
            near.push_back({key.x, key.y, static_cast<std::uint8_t>(key.level + level)});
        }
        for (const ChunkKey& other : near) {
            if (set.find(other) != index_of(other)) return "what is found near" + name;
        }

        const ResidentSet::Links& links = set.links(i);
        const std::int32_t parent = key.level == 0 ? ResidentSet::kNone : index_of(key.parent());
        if (links.parent != parent) return "parent" + name;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            const std::int32_t child = index_of(key.child(quadrant));
            if (links.child[static_cast<std::size_t>(quadrant)] != child) return "child" + name;
        }
        for (std::size_t side = 0; side < 4; ++side) {
            const std::int32_t neighbour = index_of(near[side + 1]);
            if (links.neighbour[side] != neighbour) return "neighbour" + name;
        }
        root_count += key.level == 0 ? 1 : 0;
        ++i;
    }
    const bool has_roots = root_count == std::int64_t{lattice.root_count_x} * lattice.root_count_y;
    if (set.has_roots() != has_roots) return "has_roots";
    return "";
}

// Builds a change of a set and its expected result.
struct Step {
    std::vector<ChunkKey> gone;
    Chunks come;

    void remove(Expected& expected, const ChunkKey& key) {
        gone.push_back(key);
        expected.erase(key);
    }
    void add(Expected& expected, const ChunkKey& key, float fade) {
        come.push_back(fake_chunk(key));
        expected[key] = {come.back(), fade};
    }
    ResidentSet make(const ResidentSet& before, const Expected& expected) const {
        return {before, gone, come, fades_of(expected), before.epoch() + 1, before.window()};
    }
};

bool has_child(const Expected& expected, const ChunkKey& key) {
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        if (expected.contains(key.child(quadrant))) return true;
    }
    return false;
}

class RandomChange {
public:
    RandomChange(std::uint64_t seed, const Lattice& lattice) : random_(seed), lattice_(lattice) {}

    // Chunks of the previous set are evicted, replaced or get another fade; chunks that have arrived stay.
    Step step(Expected& expected, int change_count) {
        Step step;
        std::vector<ChunkKey> old;
        for (const auto& [key, held] : expected) old.push_back(key);
        for (int change = 0; change < change_count; ++change) {
            const int kind = random_.below(8);
            if (old.empty() || (kind == 0 && !expected.empty())) {
                add(step, expected, some_root());
            } else if (const std::size_t i = below(old.size()); kind < 4) {
                // evicts a leaf or replaces an inner chunk
                const ChunkKey key = old[i];
                const bool is_replaced = has_child(expected, key) || kind == 1;
                step.remove(expected, key);
                if (is_replaced) add(step, expected, key);
                old.erase(old.begin() + static_cast<std::ptrdiff_t>(i));
            } else {
                // several descendants along a random path arrive at once
                ChunkKey key = old[i];
                for (int depth = 1 + random_.below(3); depth > 0; --depth) {
                    if (!expected.contains(key) || key.level == lattice_.finest_level) break;
                    key = key.child(random_.below(4));
                    if (std::find(step.gone.begin(), step.gone.end(), key) != step.gone.end())
                        break;
                    add(step, expected, key);
                }
            }
        }
        for (auto& [key, held] : expected) {
            if (random_.below(4) == 0) held.fade = fade();
        }
        return step;
    }
    Random& random() { return random_; }

private:
    ChunkKey some_root() {
        return {lattice_.first_root_x + random_.below(lattice_.root_count_x),
                lattice_.first_root_y + random_.below(lattice_.root_count_y), 0};
    }
    float fade() { return static_cast<float>(random_.below(256)) / 255.0f; }
    std::size_t below(std::size_t count) {
        return static_cast<std::size_t>(random_.below(static_cast<int>(count)));
    }
    void add(Step& step, Expected& expected, const ChunkKey& key) {
        if (!expected.contains(key)) step.add(expected, key, fade());
    }

    Random random_;
    Lattice lattice_;
};

Lattice random_lattice(Random& random) {
    Lattice lattice = test::small_world(random.below(25), 1.0);
    lattice.first_root_x = random.below(9) - 6;
    lattice.first_root_y = random.below(9) - 6;
    lattice.root_count_x = 1 + random.below(4);
    lattice.root_count_y = 1 + random.below(3);
    return lattice;
}

TEST(ResidentSet, EqualsTheSetConstructedFromScratchAfterAnyChange) {
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        SeededRandom first(seed);
        const Lattice lattice = random_lattice(first);
        RandomChange change(seed, lattice);
        Expected expected;
        ResidentSet set(lattice, test::whole_extent(lattice), {}, 7);
        ASSERT_EQ(difference(set, lattice, expected), "");
        for (int round = 0; round < 20; ++round) {
            const Expected expected_before = expected;
            const int change_count = change.random().below(round % 4 == 3 ? 200 : 8);
            const Step step = change.step(expected, change_count);
            const ResidentSet changed = step.make(set, expected);
            ASSERT_EQ(difference(changed, lattice, expected), "") << "round " << round;
            ASSERT_EQ(changed.epoch(), 7u + static_cast<std::uint64_t>(round) + 1);
            ASSERT_FALSE(changed.has_same_chunks(set));
            ASSERT_EQ(difference(set, lattice, expected_before), "") << "the set before";
            const ResidentSet scratch = from_scratch(lattice, expected, change.random());
            ASSERT_EQ(difference(scratch, lattice, expected), "") << "from scratch";
            set = changed;
        }
    }
}

TEST(ResidentSet, SurvivesTheEvictionAndReturnOfThousandsOfChunks) {
    constexpr std::uint64_t kSeed = 5;
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    Lattice lattice = test::small_world(16, 1.0);
    RandomChange change(kSeed, lattice);
    Expected expected;
    ResidentSet set(lattice, test::whole_extent(lattice), {}, 7);
    while (expected.size() < 5000) {
        const Step step = change.step(expected, 900);
        set = step.make(set, expected);
        ASSERT_EQ(difference(set, lattice, expected), "") << expected.size() << " chunks";
    }

    // evicts all chunks but the roots, then the roots, and inserts all of them again
    const Expected all = expected;
    Step fall;
    for (const auto& [key, held] : all) {
        if (key.level > 0) fall.remove(expected, key);
    }
    const ResidentSet roots = fall.make(set, expected);
    ASSERT_EQ(difference(roots, lattice, expected), "");
    Step end;
    for (const auto& [key, held] : all) {
        if (key.level == 0) end.remove(expected, key);
    }
    const ResidentSet none = end.make(roots, expected);
    EXPECT_EQ(none.chunks().size(), 0u);
    EXPECT_FALSE(none.has_roots());
    ASSERT_EQ(difference(none, lattice, expected), "");
    Step again;
    for (const auto& [key, held] : all) again.add(expected, key, held.fade);
    EXPECT_EQ(difference(again.make(none, expected), lattice, expected), "");
    EXPECT_EQ(difference(set, lattice, all), "");
}

// An evicted chunk is freed with the last set that contains it, whatever later sets share with that set.
TEST(ResidentSet, FreesEvictedChunksWithTheLastSetThatContainsThem) {
    const Lattice lattice = test::small_world(12, 1.0);
    RandomChange change(3, lattice);
    Expected expected;
    std::vector<std::shared_ptr<const ResidentSet>> sets{
        std::make_shared<const ResidentSet>(lattice, test::whole_extent(lattice), Chunks{}, 7)};
    for (int round = 0; round < 12; ++round) {
        Step step = change.step(expected, round % 3 == 0 ? 100 : 6);
        sets.push_back(std::make_shared<const ResidentSet>(step.make(*sets.back(), expected)));
        // these are not replaced
        step = {};
        for (const auto& [key, held] : Expected(expected)) {
            if (!has_child(expected, key)) step.remove(expected, key);
        }
        sets.push_back(std::make_shared<const ResidentSet>(step.make(*sets.back(), expected)));
    }
    expected.clear();
    while (!sets.empty()) {
        // alternately destroys the oldest and the newest set
        const bool is_oldest = sets.size() % 2 == 0;
        const auto going = is_oldest ? sets.begin() : std::prev(sets.end());
        std::vector<std::weak_ptr<const Chunk>> chunks;
        for (const std::shared_ptr<const Chunk>& chunk : (*going)->chunks()) {
            chunks.push_back(chunk);
        }
        sets.erase(going);
        for (const std::weak_ptr<const Chunk>& chunk : chunks) {
            const bool is_held = std::any_of(sets.begin(), sets.end(), [&](const auto& set) {
                return std::any_of(set->chunks().begin(), set->chunks().end(),
                                   [&](const std::shared_ptr<const Chunk>& other) {
                                       return other == chunk.lock();
                                   });
            });
            ASSERT_EQ(!chunk.expired(), is_held);
        }
    }
}

#if TERRANE_ASSERTS
TEST(ResidentSetDeathTest, RefusesChangesThatBreakTheTree) {
    const Lattice lattice = test::small_world(3, 1.0);
    const ChunkKey root{-1, -1, 0};
    const ResidentSet set(lattice, test::whole_extent(lattice),
                          {fake_chunk(root), fake_chunk(root.child(0))}, 1);
    const auto make = [&](const std::vector<ChunkKey>& gone, const std::vector<ChunkKey>& keys,
                          std::size_t fade_count) {
        Chunks come;
        for (const ChunkKey& key : keys) come.push_back(fake_chunk(key));
        return ResidentSet(set, gone, come, std::vector<float>(fade_count, 1.0f), 2, set.window());
    };
    EXPECT_EQ(make({root.child(0)}, {root.child(1)}, 2).chunks().size(), 2u);
    EXPECT_DEATH(make({root.child(1)}, {}, 2), "must be resident");
    EXPECT_DEATH(make({root.child(0), root.child(0)}, {}, 1), "go once");
    EXPECT_DEATH(make({root}, {}, 1), "parent");
    EXPECT_DEATH(make({}, {root.child(0).child(0).child(0)}, 3), "parent");
    EXPECT_DEATH(make({}, {root.child(0)}, 3), "twice");
    EXPECT_DEATH(make({}, {root.child(2), root.child(2)}, 4), "twice");
    EXPECT_DEATH(make({}, {root.child(2)}, 2), "fade");
}
#endif

}  // namespace terrane::resident_set_test
