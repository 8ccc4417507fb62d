// SPDX-License-Identifier: MIT
#include "frames/verification.h"
#include "support/grounds.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace verify_test {

// Ground at height 0 everywhere, but for what a test says about its cells.
class FlatHeights final : public HeightSource {
public:
    FlatHeights() : FlatHeights(test::small_world(2, 4.0)) {}
    double height(double, double) const override { return 0.0; }
    Result<void> sample(const SampleGrid&, std::span<double>) const override { return {}; }
    Result<void> vertex_bounds(const SampleGrid&, std::span<float>) const override { return {}; }
    Result<void> cell_bounds(const SampleGrid&, std::span<float>) const override { return {}; }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        const bool is_outside = lattice().x(grid.corner.x) >= outside_from;
        flags_out[0] = is_outside ? cell_outside : cell_ground;
        return {};
    }
    HeightInterval interval(const WorldRect&) const override { return {}; }
    double rise_bound(double) const override { return 0.0; }

    double outside_from = 1e9;  // x

private:
    explicit FlatHeights(const Lattice& lattice)
        : HeightSource(lattice, test::whole_extent(lattice)) {}
};

// A regular triangle mesh over a square around the origin.
std::vector<TriangleHeap::Triangle> make_net(double half_side, int cells, double height) {
    std::vector<TriangleHeap::Triangle> net;
    const double cell = 2.0 * half_side / cells;
    const auto corner = [&](int i, int j) {
        return WorldPos(-half_side + i * cell, -half_side + j * cell, height);
    };
    for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
            net.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
            net.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
        }
    }
    return net;
}

// Moves a vertex in all its triangles; how many these are.
int raise(std::vector<TriangleHeap::Triangle>& net, const WorldPos& place, double z) {
    int raised = 0;
    for (TriangleHeap::Triangle& t : net) {
        for (WorldPos* corner : {&t.a, &t.b, &t.c}) {
            if (*corner != place) continue;
            corner->z() = z;
            ++raised;
        }
    }
    return raised;
}

View from_above(double height) {
    return look_at(WorldPos(0.0, 0.0, height), WorldPos(0.0, 10.0, 0.0), 1.0, 800, 600).value();
}

TEST(Verifier, AgreesWithAnAnalyticCase) {
    // 1 m too high everywhere: the nearest ground in view has the largest screen error
    const FlatHeights ground;
    Verifier verifier(ground);
    const View view =
        look_at(WorldPos(0.0, 0.0, 100.0), WorldPos(0.0, 200.0, 0.0), 0.6, 640, 480).value();
    const Measurement measured = verifier.measure(TriangleHeap(make_net(1000.0, 50, 1.0)), view);
    const double down = std::atan(0.5) + 0.3;  // of the lower edge, in the middle
    const double nearest = 100.0 / std::sin(down);
    EXPECT_GE(measured.points, 100'000u);
    EXPECT_EQ(measured.holes, 0u);
    EXPECT_LE(measured.error_px, view.pixels_per_radian() / nearest + 1e-9);
    EXPECT_GE(measured.error_px, 0.99 * view.pixels_per_radian() / nearest);
}

TEST(Verifier, NeverCountsLessThanTheNearDistance) {
    const FlatHeights ground;
    Verifier verifier(ground, 20'000);
    View view = from_above(1.0);
    view.near_distance = 50.0;
    const Measurement measured = verifier.measure(TriangleHeap(make_net(100.0, 20, 0.5)), view);
    EXPECT_NEAR(measured.error_px, 0.5 * view.pixels_per_radian() / 50.0, 1e-9);
}

TEST(Verifier, FindsOneRaisedVertex) {
    const FlatHeights ground;
    std::vector<TriangleHeap::Triangle> net = make_net(500.0, 100, 0.0);
    const View view = from_above(300.0);
    EXPECT_EQ(Verifier(ground).measure(TriangleHeap(net), view).error_px, 0.0);

    const WorldPos place(40.0, 100.0, 0.0);
    ASSERT_EQ(raise(net, place, 3.0), 6);
    const double whole = 3.0 * view.pixels_per_radian() / (place - view.eye_world).norm();
    const double found = Verifier(ground).measure(TriangleHeap(net), view).error_px;
    EXPECT_GT(found, 0.5 * whole);
    EXPECT_LE(found, 1.02 * whole);
}

TEST(Verifier, FindsAHoleAndCountsANaNHeightAsOne) {
    const FlatHeights ground;
    const std::vector<TriangleHeap::Triangle> net = make_net(500.0, 20, 0.0);
    std::vector<TriangleHeap::Triangle> torn = net, nan = net;
    std::erase_if(torn, [](const TriangleHeap::Triangle& t) {
        return t.a == WorldPos(0.0, 50.0, 0.0) && t.b == WorldPos(50.0, 50.0, 0.0);
    });
    ASSERT_GT(raise(nan, {0.0, 50.0, 0.0}, std::nan("")), 0);
    for (const auto& [triangles, has_holes] : {std::pair(net, false), {torn, true}, {nan, true}}) {
        const std::size_t holes =
            Verifier(ground).measure(TriangleHeap(triangles), from_above(300.0)).holes;
        EXPECT_EQ(holes > 0, has_holes);
    }
}

TEST(Verifier, SkipsPointsOutsideTheGround) {
    FlatHeights ground;
    ground.outside_from = 0.0;
    std::vector<TriangleHeap::Triangle> net = make_net(500.0, 20, 0.0);
    for (TriangleHeap::Triangle& t : net) {
        for (WorldPos* corner : {&t.a, &t.b, &t.c}) {
            if (corner->x() > 0.0) corner->z() = 99.0;
        }
    }
    EXPECT_EQ(Verifier(ground).measure(TriangleHeap(net), from_above(300.0)).error_px, 0.0);
}

TEST(Verifier, MeasuresMovementUnderFixedPoints) {
    const FlatHeights ground;
    Verifier verifier(ground);
    View view = from_above(300.0);
    EXPECT_EQ(verifier.measure(TriangleHeap(make_net(1000.0, 20, 0.0)), view).max_pop_px, 0.0);
    view.eye_world.y() += 1.0;
    const Measurement moved = verifier.measure(TriangleHeap(make_net(1000.0, 20, 0.25)), view);
    const double nearest = 300.0;  // straight below is in view
    EXPECT_LE(moved.max_pop_px, 0.25 * view.pixels_per_radian() / nearest + 1e-9);
    EXPECT_GE(moved.max_pop_px, 0.25 * view.pixels_per_radian() / (1.02 * nearest));
    EXPECT_EQ(moved.max_pop_elsewhere_px, 0.0);
    // a jump of the eye does not count as a pop
    view.eye_world.y() += 200.0;
    const Measurement jumped = verifier.measure(TriangleHeap(make_net(1000.0, 20, 0.0)), view);
    EXPECT_EQ(jumped.max_pop_px, 0.0);
    EXPECT_GT(jumped.max_pop_elsewhere_px, 0.0);
}

TEST(Verifier, AppliesTheLimitOnlyToFramesWithASmallCertifiedError) {
    const FlatHeights ground;
    const View view = from_above(300.0);
    const double pop = 0.25 * view.pixels_per_radian() / 300.0;
    for (const double certified_px : {1.5, 1.6}) {
        Verifier verifier(ground, 20'000);
        // the bound of the previous frame does not matter
        verifier.measure(TriangleHeap(make_net(1000.0, 20, 0.0)), view, 50.0);
        const Measurement moved =
            verifier.measure(TriangleHeap(make_net(1000.0, 20, 0.25)), view, certified_px);
        const bool has_limit = certified_px <= 1.5;
        EXPECT_NEAR(has_limit ? moved.max_pop_px : moved.max_pop_elsewhere_px, pop, 0.01 * pop);
        EXPECT_EQ(has_limit ? moved.max_pop_elsewhere_px : moved.max_pop_px, 0.0);
    }
}

TEST(Verifier, FindsTheMovementOfASingleVertexExactly) {
    const FlatHeights ground;
    const View view = from_above(300.0);
    const std::vector<TriangleHeap::Triangle> flat = make_net(500.0, 100, 0.0);
    std::vector<TriangleHeap::Triangle> raised = flat;
    const WorldPos place(40.0, 100.0, 0.0);
    ASSERT_EQ(raise(raised, place, 0.5), 6);
    const double whole = 0.5 * view.pixels_per_radian() / (place - view.eye_world).norm();
    for (const bool comes : {true, false}) {
        Verifier verifier(ground, 1'000);
        verifier.measure(TriangleHeap(comes ? flat : raised), view);
        const Measurement moved = verifier.measure(TriangleHeap(comes ? raised : flat), view);
        EXPECT_NEAR(moved.max_pop_px, whole, 1e-9 * whole);
    }
    // a vertex that disappears: its position is then inside a triangle
    Verifier verifier(ground, 1'000);
    verifier.measure(TriangleHeap(raised), view);
    EXPECT_NEAR(verifier.measure(TriangleHeap(make_net(500.0, 3, 0.0)), view).max_pop_px, whole,
                1e-9 * whole);
}

TEST(TriangleHeap, FindsHeightsAmongTrianglesOfAllSizes) {
    std::vector<TriangleHeap::Triangle> net;
    for (double size = 1.0; size < 2000.0; size *= 2.0) {
        const WorldPos corner(size, size, size);
        net.push_back(
            {corner, corner + WorldPos(size, 0.0, 0.0), corner + WorldPos(0.0, size, 0.0)});
    }
    const TriangleHeap heap(net);
    for (double size = 1.0; size < 2000.0; size *= 2.0) {
        EXPECT_EQ(heap.height(1.25 * size, 1.25 * size), size);
        EXPECT_EQ(heap.height(size, size), size) << "a corner belongs to its triangle";
        EXPECT_FALSE(heap.height(1.8 * size, 1.8 * size));
    }
}

TEST(TriangleHeap, ListsEveryVertexOnce) {
    EXPECT_EQ(TriangleHeap(make_net(100.0, 7, 1.0)).vertices().size(), 64u);
    EXPECT_TRUE(TriangleHeap(std::vector<TriangleHeap::Triangle>{}).vertices().empty());
    EXPECT_FALSE(TriangleHeap(std::vector<TriangleHeap::Triangle>{}).height(1.0, 2.0));
}

TEST(TriangleHeap, AgreesWithATestOfEveryTriangle) {
    // random triangles of random sizes
    test::Random random(5);
    std::vector<TriangleHeap::Triangle> net;
    for (int i = 0; i < 400; ++i) {
        const double size = std::exp2(random.between(-3.0, 7.0));
        const auto corner = [&] {
            return WorldPos(random.between(-1.0, 1.0) * size, random.between(-1.0, 1.0) * size,
                            random.between(0.0, 10.0));
        };
        net.push_back({corner(), corner(), corner()});
    }
    const TriangleHeap heap(net);
    for (int i = 0; i < 2000; ++i) {
        const double reach = std::exp2(random.between(-4.0, 8.0));
        const double x = random.between(-reach, reach), y = random.between(-reach, reach);
        std::optional<double> highest;
        for (const TriangleHeap::Triangle& t : net) {
            if (const std::optional<double> z = TriangleHeap({t}).height(x, y)) {
                highest = std::max(highest.value_or(*z), *z);
            }
        }
        ASSERT_EQ(heap.height(x, y), highest) << "seed 5, point " << x << ", " << y;
    }
}

TEST(TriangleHeap, TakesDisplayedHeights) {
    Lattice lattice;
    const test::WaveHeights source(lattice, 3.0, 500.0);
    const std::shared_ptr<const Chunk> chunk = make_chunk(source, {0, 0, 0}).value();
    std::vector<float> offsets(chunk->heights.size(), 0.0f);
    const auto corner = static_cast<std::uint16_t>(sample_index(kChunkCells, 0));
    offsets[corner] = 1.5f;
    const std::vector<std::uint16_t> indices{
        0, corner, static_cast<std::uint16_t>(sample_index(kChunkCells, kChunkCells))};
    const std::vector<MeshChunk> parts{{chunk.get(), 0, 3, offsets.data()}};
    TerrainMesh mesh;
    mesh.resident = std::make_shared<const ResidentSet>(
        lattice, source.extent(), std::vector<std::shared_ptr<const Chunk>>{chunk}, 1);
    mesh.chunks = parts;
    mesh.indices = indices;
    mesh.triangle_count = 1;
    const double x = lattice.x(kChunkCells);
    EXPECT_EQ(TriangleHeap::from(mesh).height(x, 0.0),
              parts[0].displayed_height(corner, lattice.quantum));
}

}  // namespace verify_test
}  // namespace terrane::tools
