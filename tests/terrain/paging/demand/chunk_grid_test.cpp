// SPDX-License-Identifier: MIT
#include "paging/demand/contact_needs.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane::internal {
namespace chunk_grid_test {

using test::Random;

Lattice random_lattice(Random& random) {
    Lattice lattice;
    lattice.finest_level = random.below(5);
    lattice.spacing = random.below(2) == 0 ? 0.25 : random.between(0.01, 40.0);
    lattice.origin_x = random.between(-1e7, 1e7);
    lattice.origin_y = random.between(-1.0, 1.0);
    lattice.first_root_x = random.below(200'000) - 100'000;
    lattice.first_root_y = -1;
    lattice.root_count_x = 1 + random.below(3);
    return lattice;
}

TEST(ChunkGrid, HasTheEdgesOfTheLattice) {
    constexpr std::uint64_t kSeed = 31;
    Random random(kSeed);
    for (int run = 0; run < 200; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const Lattice lattice = random_lattice(random);
        const int level = random.below(lattice.finest_level + 1);
        const ChunkGrid grid(lattice, level);
        const std::int64_t side = lattice.chunk_side(level);
        EXPECT_EQ(grid.x.world.first * side, lattice.west());
        EXPECT_EQ((grid.x.world.last + 1) * side, lattice.east());
        EXPECT_EQ(grid.y.world.first * side, lattice.south());
        EXPECT_EQ((grid.y.world.last + 1) * side, lattice.north());
        for (std::int64_t i = grid.x.world.first; i <= grid.x.world.last + 1; ++i) {
            ASSERT_EQ(grid.x.edge(i), lattice.x(i * side));
        }
    }
}

TEST(ChunkGrid, FindsTheChunksThatShareAPointWithAnInterval) {
    constexpr std::uint64_t kSeed = 32;
    Random random(kSeed);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (int run = 0; run < 2000; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        const Lattice lattice = random_lattice(random);
        const ChunkAxis axis = ChunkGrid(lattice, random.below(lattice.finest_level + 1)).x;
        const auto place = [&] {
            const int chunks = static_cast<int>(axis.world.last - axis.world.first) + 1;
            const std::int64_t index = axis.world.first - 1 + random.below(chunks + 3);
            switch (random.below(5)) {
                case 0:
                    return random.below(2) == 0 ? -kInfinity : kInfinity;
                case 1:
                    return axis.edge(index);
                case 2:
                    return std::nextafter(axis.edge(index), -kInfinity);
                case 3:
                    return std::nextafter(axis.edge(index), kInfinity);
                default:
                    return axis.edge(index) + random.between(0.0, axis.side);
            }
        };
        const double low = place(), high = place();
        const ChunkSpan found = axis.touched(low, high, axis.world);
        for (std::int64_t i = axis.world.first; i <= axis.world.last; ++i) {
            ASSERT_EQ(i >= found.first && i <= found.last,
                      axis.edge(i) <= high && axis.edge(i + 1) >= low)
                << low << " to " << high;
        }
        EXPECT_GE(found.first, axis.world.first);
        EXPECT_LE(found.last, axis.world.last);
    }
}

}  // namespace chunk_grid_test
}  // namespace terrane::internal
