// SPDX-License-Identifier: MIT
// Each check must detect a mesh with the defect that it looks for.
#include "mesh_checks.h"

#include "support/grounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace terrane::test {
namespace mesh_checks_test {

constexpr int kSide = kChunkCells;

Lattice one_root() { return {}; }

//  3---2     the root square with its centre: a fan of four is whole
//  | 4 |
//  0---1
std::vector<SoupTriangle> fan() {
    const std::array<SoupVertex, 5> v{SoupVertex{{0, 0}, 1}, SoupVertex{{kSide, 0}, 2},
                                      SoupVertex{{kSide, kSide}, 3}, SoupVertex{{0, kSide}, 4},
                                      SoupVertex{{kSide / 2, kSide / 2}, 5, 0.75f}};
    return {{v[0], v[1], v[4]}, {v[1], v[2], v[4]}, {v[2], v[3], v[4]}, {v[3], v[0], v[4]}};
}

std::string flaw_of(const std::vector<SoupTriangle>& soup) { return find_flaw(soup, one_root()); }

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

using Soup = std::vector<SoupTriangle>;

TEST(FindFlaw, PassesAWholeFanAndTakesTheTwoZerosForOne) {
    Soup soup = fan();
    EXPECT_EQ(flaw_of(soup), "");
    for (SoupTriangle& triangle : soup) triangle[2].offset = 0.0f;
    soup[1][2].offset = -0.0f;
    EXPECT_EQ(flaw_of(soup), "");
}

TEST(FindFlaw, FindsATJunction) {
    Soup soup = fan();
    // merging two of the four triangles into a big one leaves the centre on its diagonal
    soup = {{soup[0][0], soup[0][1], soup[2][1]}, soup[1], soup[2]};
    EXPECT_TRUE(has(flaw_of(soup), "is used 1 times")) << flaw_of(soup);
}

TEST(FindFlaw, FindsACrackOfOneQuantum) {
    Soup soup = fan();
    ++soup[0][2].height;
    EXPECT_TRUE(has(flaw_of(soup), "two heights")) << flaw_of(soup);
}

TEST(FindFlaw, FindsEachOtherFlaw) {
    struct Case {
        const char* name;
        const char* message_part;
        void (*spoil)(Soup& soup);
    };
    const std::vector<Case> cases{
        // the southern triangle is divided at the border, the centre's western edge on one side only
        {"T-junction in a covered world", "is used 1 times",
         [](Soup& soup) {
             const SoupVertex middle{{kSide / 4, kSide / 4}, 3};
             const SoupTriangle south = soup[0];
             soup[0] = {south[0], south[1], middle};
             soup.push_back({middle, south[1], south[2]});
         }},
        {"hole", "is used 1 times", [](Soup& soup) { soup.erase(soup.begin() + 2); }},
        {"triangle twice", "is used", [](Soup& soup) { soup.push_back(soup[1]); }},
        {"triangle turned over", "not counter-clockwise",
         [](Soup& soup) { std::swap(soup[0][1], soup[0][2]); }},
        {"triangle without area", "not counter-clockwise",
         [](Soup& soup) {
             soup.push_back({soup[0][0], soup[0][1], soup[0][1]});
         }},
        {"one bit of an offset", "two offsets",
         [](Soup& soup) { soup[2][2].offset = std::nextafter(soup[2][2].offset, 1.0f); }},
        {"offset that is no number", "not finite",
         [](Soup& soup) {
             for (SoupTriangle& t : soup) t[2].offset = std::numeric_limits<float>::quiet_NaN();
         }},
        {"nothing", "cover 0", [](Soup& soup) { soup.clear(); }},
        {"vertex outside the world", "outside the world",
         [](Soup& soup) {
             soup.push_back({SoupVertex{{kSide, 0}, 2}, SoupVertex{{kSide + 1, 0}, 0},
                             SoupVertex{{kSide, kSide}, 3}});
         }},
    };
    for (const Case& tested : cases) {
        SCOPED_TRACE(tested.name);
        Soup soup = fan();
        tested.spoil(soup);
        EXPECT_TRUE(has(flaw_of(soup), tested.message_part)) << flaw_of(soup);
    }
}

TEST(FindFlaw, FindsAMissingRootAndATriangleThatIsLargerThanARoot) {
    Lattice lattice{.root_count_x = 2};
    Soup soup = fan();
    EXPECT_NE(find_flaw(soup, lattice), "");
    for (SoupTriangle& t : soup) {
        for (SoupVertex& v : t) v.point.x *= 2;
    }
    EXPECT_TRUE(has(find_flaw(soup, lattice), "larger than a root")) << find_flaw(soup, lattice);
}

TEST(FindFlaw, AddsUpAreasThatNoDoubleHolds) {
    Lattice lattice{.finest_level = 24};
    const std::int64_t side = lattice.chunk_side(0);
    const SoupVertex sw{{0, 0}, 0}, se{{side, 0}, 0}, ne{{side, side}, 0}, nw{{0, side}, 0};
    EXPECT_EQ(find_flaw({{sw, se, ne}, {sw, ne, nw}}, lattice), "");
    EXPECT_NE(find_flaw({{sw, se, ne}}, lattice), "");
}

// A root chunk at height 0 and what a frame would draw of it: hand-made.
class HandMade {
public:
    HandMade() {
        Lattice lattice{.quantum = 0x1p-4};
        const WaveHeights flat(lattice, 0.0, 1000.0);
        chunk_ = make_chunk(flat, {0, 0, 0}).value();
        mesh_.resident = std::make_shared<const ResidentSet>(
            lattice, flat.extent(), std::vector<std::shared_ptr<const Chunk>>{chunk_}, 1);
        const auto at = [](int column, int row) {
            return static_cast<std::uint16_t>(sample_index(column, row));
        };
        const std::uint16_t sw = at(0, 0), se = at(kSide, 0), ne = at(kSide, kSide),
                            nw = at(0, kSide), middle = at(kSide / 2, kSide / 2);
        indices_ = {sw, se, middle, se, ne, middle, ne, nw, middle, nw, sw, middle};
        // drawn in two parts, as if they were two chunks
        offsets_.assign(2, std::vector<float>(chunk_->heights.size(), 0.0f));
        for (std::vector<float>& offsets : offsets_) offsets[middle] = 2.5f;
        parts_ = {{chunk_.get(), 0, 6, offsets_[0].data()},
                  {chunk_.get(), 6, 6, offsets_[1].data()}};
        middle_ = middle;
    }

    TerrainMesh mesh() {
        mesh_.chunks = parts_;
        mesh_.indices = indices_;
        mesh_.triangle_count = indices_.size() / 3;
        return mesh_;
    }
    std::vector<MeshChunk>& parts() { return parts_; }
    std::vector<std::uint16_t>& indices() { return indices_; }
    float& offset_of_middle(std::size_t part) { return offsets_[part][middle_]; }

private:
    std::shared_ptr<const Chunk> chunk_;
    TerrainMesh mesh_;
    std::vector<std::uint16_t> indices_;
    std::vector<std::vector<float>> offsets_;
    std::vector<MeshChunk> parts_;
    std::size_t middle_ = 0;
};

TEST(FindFlawOfAFrame, PassesOneThatIsWhole) {
    HandMade made;
    EXPECT_EQ(find_flaw(made.mesh()), "");
    EXPECT_EQ(find_flaw(make_soup(made.mesh()), Lattice{}), "");
}

TEST(FindFlawOfAFrame, FindsOneBitOfAnOffsetBetweenChunksAndAChunkWithoutOffsets) {
    HandMade made;
    made.offset_of_middle(1) = std::nextafter(2.5f, 0.0f);
    EXPECT_TRUE(has(find_flaw(made.mesh()), "two offsets")) << find_flaw(made.mesh());
    made.parts()[1].offsets = nullptr;
    EXPECT_TRUE(has(find_flaw(made.mesh()), "two offsets")) << find_flaw(made.mesh());
}

TEST(FindFlawOfAFrame, FindsWrongCountsAndIndices) {
    HandMade made;
    TerrainMesh mesh = made.mesh();
    mesh.triangle_count = 5;
    EXPECT_NE(find_flaw(mesh), "");
    made.indices()[3] = kChunkSamples * kChunkSamples;
    EXPECT_NE(find_flaw(made.mesh()), "");
    HandMade other;
    other.parts()[1].index_count = 9;
    EXPECT_NE(find_flaw(other.mesh()), "");
}

TEST(MeasureErrorPx, MeasuresWhatIsDisplayed) {
    HandMade made;
    const WaveHeights flat(Lattice{}, 0.0, 1000.0);
    const View view = look_at({64, 64, 502.5}, {64, 64, 0}, 0.2, 100, 100).value();
    const std::vector<SoupTriangle> soup = make_soup(made.mesh());
    EXPECT_EQ(displayed(soup[0][2], Lattice{}).z(), 2.5);
    // the 2.5 m peak is 502.5 m below the eye; the sample points only come near it
    const double whole = 2.5 * view.pixels_per_radian() / 502.5;
    const double net = measure_error_px_everywhere(soup, flat, view, 8);
    EXPECT_LT(net, whole);
    EXPECT_GT(net, 0.99 * whole);
    const double thrown = measure_error_px(soup, flat, view, 2000);
    EXPECT_LT(thrown, whole);
    EXPECT_GT(thrown, 0.9 * whole);
    made.parts()[0].offsets = made.parts()[1].offsets = nullptr;
    EXPECT_EQ(measure_error_px_everywhere(make_soup(made.mesh()), flat, view, 8), 0.0);
}

TEST(MeasureErrorPx, LooksInsideTheSidePlanesOnlyAndDoesNotLetANumberThatIsNonePass) {
    HandMade made;
    const WaveHeights flat(Lattice{}, 0.0, 1000.0);
    const View down = look_at({64, 64, 500}, {64, 64, 0}, 0.2, 100, 100).value();
    const View away = look_at({64, 64, 500}, {64, 64, 1000}, 0.2, 100, 100).value();
    EXPECT_EQ(measure_error_px(make_soup(made.mesh()), flat, away, 50), 0.0);
    EXPECT_EQ(measure_error_px_everywhere(make_soup(made.mesh()), flat, away, 4), 0.0);
    made.offset_of_middle(0) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(measure_error_px(make_soup(made.mesh()), flat, down, 50) <= 1e9);
}

}  // namespace mesh_checks_test
}  // namespace terrane::test
