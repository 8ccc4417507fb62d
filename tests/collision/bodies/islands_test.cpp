// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "world/island_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace terrane::internal {
namespace islands_test {

// Flood fill: the lowest body that each one is connected with.
std::vector<std::uint32_t> flood(std::span<const BodyPair> links,
                                 std::span<const std::uint8_t> moves) {
    std::vector<std::uint32_t> lowest(moves.size());
    for (std::uint32_t i = 0; i < lowest.size(); ++i) lowest[i] = i;
    for (bool changed = true; changed;) {
        changed = false;
        for (const BodyPair& link : links) {
            if (moves[link.a] == 0 || moves[link.b] == 0) continue;
            const std::uint32_t least = std::min(lowest[link.a], lowest[link.b]);
            changed = changed || lowest[link.a] != least || lowest[link.b] != least;
            lowest[link.a] = lowest[link.b] = least;
        }
    }
    return lowest;
}

TEST(Islands, AreWhatTouchesThroughBodiesThatMove) {
    constexpr std::uint64_t kSeed = 4;
    test::Random random(kSeed);
    Islands islands;  // reused: no state of a build may affect the next
    for (int run = 0; run < 2000; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const int count = 1 + random.below(30);
        std::vector<std::uint8_t> moves;
        for (int i = 0; i < count; ++i) moves.push_back(random.below(5) != 0);
        std::vector<BodyPair> links;
        for (std::uint32_t a = 0; a < moves.size(); ++a) {
            for (std::uint32_t b = a + 1; b < moves.size(); ++b) {
                const bool some_moves = moves[a] != 0 || moves[b] != 0;
                if (some_moves && random.below(count + 5) < 2) links.push_back({a, b});
            }
        }
        islands.build(links, moves);

        const std::vector<std::uint32_t> lowest = flood(links, moves);
        std::vector<std::uint32_t> moving;
        for (std::uint32_t i = 0; i < moves.size(); ++i) {
            if (moves[i] != 0) moving.push_back(i);
        }
        std::vector<std::uint32_t> bodies;
        std::size_t link_count = 0;
        std::uint32_t before = 0;
        for (std::size_t island = 0; island < islands.count(); ++island) {
            const auto members = islands.bodies(island);
            ASSERT_FALSE(members.empty());
            EXPECT_TRUE(std::is_sorted(members.begin(), members.end()));
            EXPECT_TRUE(island == 0 || members.front() > before);
            before = members.front();
            for (const std::uint32_t member : members) EXPECT_EQ(lowest[member], members.front());
            for (const std::uint32_t link : islands.links(island)) {
                const std::uint32_t mover =
                    moves[links[link].a] != 0 ? links[link].a : links[link].b;
                EXPECT_EQ(lowest[mover], members.front());
            }
            bodies.insert(bodies.end(), members.begin(), members.end());
            link_count += islands.links(island).size();
        }
        std::sort(bodies.begin(), bodies.end());
        EXPECT_EQ(bodies, moving);
        EXPECT_EQ(link_count, links.size());
    }
}

}  // namespace islands_test
}  // namespace terrane::internal
