// SPDX-License-Identifier: MIT
// A check that cannot fail proves nothing.
#include "support/mesh_checks.h"

#include <gtest/gtest.h>

namespace terrane::test {
namespace {

constexpr int kSide = kChunkCells;

Lattice one_root() { return {}; }

//  3---2     the root square with its centre: a fan of four is whole
//  | 4 |
//  0---1
std::vector<SoupTriangle> fan() {
    const std::array<SoupVertex, 5> v{SoupVertex{{0, 0}, 1}, SoupVertex{{kSide, 0}, 2},
                                      SoupVertex{{kSide, kSide}, 3}, SoupVertex{{0, kSide}, 4},
                                      SoupVertex{{kSide / 2, kSide / 2}, 5}};
    return {{v[0], v[1], v[4]}, {v[1], v[2], v[4]}, {v[2], v[3], v[4]}, {v[3], v[0], v[4]}};
}

TEST(FindFlaw, PassesAWholeFan) { EXPECT_EQ(find_flaw(fan(), one_root()), ""); }

TEST(FindFlaw, FindsATJunction) {
    std::vector<SoupTriangle> soup = fan();
    // two of the four joined into one big triangle leave the centre hanging on the diagonal
    soup = {{soup[0][0], soup[0][1], soup[2][1]}, soup[1], soup[2]};
    EXPECT_NE(find_flaw(soup, one_root()), "");
}

TEST(FindFlaw, FindsAHole) {
    std::vector<SoupTriangle> soup = fan();
    soup.pop_back();
    EXPECT_NE(find_flaw(soup, one_root()), "");
}

TEST(FindFlaw, FindsATriangleThatIsThereTwice) {
    std::vector<SoupTriangle> soup = fan();
    soup.push_back(soup[1]);
    EXPECT_NE(find_flaw(soup, one_root()), "");
}

TEST(FindFlaw, FindsATriangleThatIsTurnedOver) {
    std::vector<SoupTriangle> soup = fan();
    std::swap(soup[0][1], soup[0][2]);
    EXPECT_NE(find_flaw(soup, one_root()), "");
}

TEST(FindFlaw, FindsACrackOfOneQuantum) {
    std::vector<SoupTriangle> soup = fan();
    ++soup[0][2].height;
    EXPECT_NE(find_flaw(soup, one_root()), "");
}

TEST(FindFlaw, FindsThatPartOfTheWorldIsMissing) {
    Lattice two_roots;
    two_roots.root_count_x = 2;
    EXPECT_NE(find_flaw(fan(), two_roots), "");
}

}  // namespace
}  // namespace terrane::test
