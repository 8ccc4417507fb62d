// SPDX-License-Identifier: MIT
#include "chunk/resident_set.h"
#include "pager_scene.h"
#include "paging/demand/contact_needs.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace terrane::internal::chunk_grid_test {

using namespace test;

Lattice random_lattice(Random& random) {
    Lattice lattice{.finest_level = random.below(5)};
    lattice.spacing = random.below(2) == 0 ? 0.25 : random.between(0.01, 40.0);
    lattice.origin_x = random.between(-1e7, 1e7);
    lattice.origin_y = random.between(-1.0, 1.0);
    lattice.first_root_x = random.below(200'000) - 100'000;
    lattice.first_root_y = -1;
    lattice.root_count_x = 1 + random.below(3);
    return lattice;
}

TEST(ChunkGrid, HasTheEdgesOfTheLattice) {
    SeededRandom random(31);
    for (int run = 0; run < 200; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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
    SeededRandom random(32);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (int run = 0; run < 2000; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
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

}  // namespace terrane::internal::chunk_grid_test

namespace terrane::test::root_window {
namespace {

using internal::first_root_window;
using internal::moved_root_window;
using internal::rect_of_roots;

constexpr double kSide = 512.0;  // side of a root square, metres
constexpr int kWindow = 4;

FractalSettings many_roots() {
    return {.seed = 5,
            .amplitude = 30.0,
            .wavelength_log2 = 8,
            .finest_spacing_log2 = 1,
            .root_size_log2 = 9,
            .first_root_x = -4000,
            .first_root_y = -4000,
            .root_count_x = 8000,
            .root_count_y = 8000,
            .root_window = kWindow};
}

std::shared_ptr<const HeightSource> endless() {
    return FractalHeights::create(many_roots()).value();
}

std::array<CameraNeed, 1> camera_over(const HeightSource& ground, double x, double y,
                                      double heading) {
    const WorldPos eye(x, y, ground.height(x, y) + 40.0);
    return {camera_at(
        eye, eye + WorldPos(300.0 * std::cos(heading), 300.0 * std::sin(heading), -40.0), 2.0)};
}

// Column or row, within the window, of the root square that contains a coordinate.
int place_in_window(double place, double origin, std::int32_t first) {
    return static_cast<int>(std::floor((place - origin) / kSide)) - first;
}

// Every chunk's root square is in the window, and all root squares of the window are resident.
void expect_whole(const ResidentSet& set) {
    ASSERT_TRUE(set.has_roots());
    std::int64_t roots = 0;
    for (const auto& chunk : set.chunks()) {
        ASSERT_TRUE(set.window().contains(chunk->key));
        roots += chunk->key.level == 0 ? 1 : 0;
    }
    ASSERT_EQ(roots, std::int64_t{set.window().root_count_x} * set.window().root_count_y);
}

TEST(RootWindow, MovesAsLittleAsKeepsThePlaceInItsMiddle) {
    Random random(1);
    for (int round = 0; round < 2000; ++round) {
        SCOPED_TRACE(testing::Message() << "seed 1, round " << round);
        Lattice world{.finest_level = 2,
                      .root_count_x = 1 + static_cast<int>(random.below(20)),
                      .root_count_y = 1 + static_cast<int>(random.below(20))};
        world.first_root_x = static_cast<int>(random.below(40)) - 20;
        world.root_window = 4 + 2 * static_cast<int>(random.below(5));
        Lattice window = first_root_window(world);
        for (int step = 0; step < 20; ++step) {
            const double far = random.below(10) == 0 ? 1e300 : 2e4;
            const WorldVec2 place(random.between(-far, far), random.between(-far, far));
            const Lattice next = moved_root_window(world, window, place);
            ASSERT_EQ(next.root_window, 0);
            ASSERT_EQ(next.root_count_x, std::min(world.root_count_x, world.root_window));
            ASSERT_GE(next.first_root_x, world.first_root_x);
            ASSERT_LE(next.first_root_x + next.root_count_x,
                      world.first_root_x + world.root_count_x);
            ASSERT_EQ(moved_root_window(world, next, place), next)
                << "a second time changes nothing";
            const double column = std::clamp(std::floor(place.x() / world.root_size()),
                                             static_cast<double>(world.first_root_x),
                                             world.first_root_x + world.root_count_x - 1.0) -
                                  next.first_root_x;
            const int middle = next.root_count_x / 2;
            const bool is_middle = column == middle || column == middle - 1;
            const bool is_at_edge =
                next.first_root_x == world.first_root_x ||
                next.first_root_x + next.root_count_x == world.first_root_x + world.root_count_x;
            ASSERT_TRUE(is_middle || is_at_edge);
            if (next.first_root_x != window.first_root_x && !is_at_edge) {
                const bool is_eastward = next.first_root_x > window.first_root_x;
                ASSERT_EQ(column, is_eastward ? middle : middle - 1)
                    << "it moves no farther than necessary";
            }
            window = next;
        }
    }
}

// Loads inside update(), and simulated storage. In every frame the set has exactly the root squares of its window, the
// window contains the camera, and the mesh is conforming with a certified error.
TEST(RootWindow, FollowsACameraOverAnyNumberOfEdges) {
    const int frames = few_or_many(80, 160);
    const auto ground = endless();
    for (const int storage : {0, 1}) {
        const PagerSettings settings{.worker_count = 0};
        Result<std::unique_ptr<VirtualLoader>> loader =
            VirtualLoader::create({.latency = 0.05, .latency_spread = 1.0},
                                  [&](const ChunkKey& key) { return make_chunk(*ground, key); });
        Pager pager = storage == 0 ? Pager::create(ground, settings).value()
                                   : Pager::create(ground, settings, std::move(*loader)).value();
        Random random(static_cast<std::uint64_t>(7 + storage));
        double x = 100.0, y = -50.0, heading = 0.4;
        std::set<std::pair<std::int32_t, std::int32_t>> windows;
        bool has_begun = false;
        for (int frame = 0; frame < frames; ++frame) {
            SCOPED_TRACE(testing::Message() << "storage " << storage << ", frame " << frame);
            heading += random.between(-0.1, 0.1);
            x += 60.0 * std::cos(heading);
            y += 60.0 * std::sin(heading);
            const auto cameras = camera_over(*ground, x, y, heading);
            pager.update(cameras, {}, 0.05 * frame);
            const auto set = pager.resident();
            has_begun = has_begun || set->has_roots();
            if (!has_begun) continue;
            ASSERT_NO_FATAL_FAILURE(expect_whole(*set));
            ASSERT_TRUE(rect_of_roots(set->window()).contains(x, y));
            windows.insert({set->window().first_root_x, set->window().first_root_y});
            if (storage == 0) {
                const int column = place_in_window(x, 0.0, set->window().first_root_x);
                ASSERT_TRUE(column == 1 || column == 2)
                    << "loaded within update(), it is never behind";
            }
            if (frame % 20 != 0) continue;
            const Frame drawn = draw(set, *ground, cameras[0].view, 4.0);
            ASSERT_NE(drawn.status, MeshStatus::not_resident);
        }
        EXPECT_TRUE(has_begun);
        EXPECT_GT(static_cast<int>(windows.size()), frames / 20);
        EXPECT_EQ(pager.stats().failed, 0u);
    }
}

// The same chunks, and the same bits of a frame, as in a world of these root squares only.
TEST(RootWindow, IsDrawnAsAWorldOfItsRootSquares) {
    const auto ground = endless();
    Pager pager = Pager::create(ground, {.worker_count = 0}).value();
    for (const WorldVec2& place :
         {WorldVec2(0.0, 0.0), WorldVec2(700.0, -3000.0), WorldVec2(1e6, 1.2e6)}) {
        const auto cameras = camera_over(*ground, place.x(), place.y(), 1.0);
        pager.update(cameras, {}, 0.0);
        const auto set = pager.resident();
        FractalSettings alone = many_roots();
        alone.root_window = 0;
        alone.first_root_x = set->window().first_root_x;
        alone.first_root_y = set->window().first_root_y;
        alone.root_count_x = alone.root_count_y = kWindow;
        const auto small = FractalHeights::create(alone).value();
        std::vector<std::shared_ptr<const Chunk>> chunks;
        for (const auto& chunk : set->chunks()) {
            chunks.push_back(make_chunk(*small, chunk->key).value());
            ASSERT_EQ(chunks.back()->heights, chunk->heights);
        }
        const auto same =
            std::make_shared<const ResidentSet>(small->lattice(), small->extent(), chunks, 1);
        Triangulator windowed = Triangulator::create(*ground, {.triangle_budget = 20'000}).value();
        Triangulator bounded = Triangulator::create(*small, {.triangle_budget = 20'000}).value();
        const TerrainMesh a = windowed.update(set, cameras[0].view);
        const TerrainMesh b = bounded.update(same, cameras[0].view);
        EXPECT_GT(a.triangle_count, 10'000u);
        EXPECT_EQ(a.triangle_count, b.triangle_count);
        EXPECT_EQ(a.error_px, b.error_px);
        EXPECT_TRUE(
            std::equal(a.indices.begin(), a.indices.end(), b.indices.begin(), b.indices.end()));
    }
}

TEST(RootWindow, CrossingAnEdgeToAndFroMovesItOnce) {
    const auto ground = endless();
    Pager pager = Pager::create(ground, {.worker_count = 0}).value();
    std::vector<std::int32_t> firsts;
    for (int frame = 0; frame < 40; ++frame) {
        const double x = 2.0 * kSide + (frame % 2 == 0 ? -1.0 : 1.0);
        pager.update(camera_over(*ground, x, 0.0, 0.0), {}, 0.1 * frame);
        ASSERT_NO_FATAL_FAILURE(expect_whole(*pager.resident()));
        std::size_t bytes = 0;
        for (const auto& chunk : pager.resident()->chunks()) bytes += chunk->bytes();
        ASSERT_EQ(pager.stats().resident_bytes, bytes) << "none is loaded twice";
        const std::int32_t first = pager.resident()->window().first_root_x;
        if (firsts.empty() || firsts.back() != first) firsts.push_back(first);
    }
    EXPECT_LE(firsts.size(), 2u);
}

// A pager over simulated storage whose loads fail while `is_failing`.
struct FailingStorage {
    std::shared_ptr<const HeightSource> ground = endless();
    bool is_failing = false;
    Pager pager =
        Pager::create(ground, {},
                      VirtualLoader::create(
                          {.latency = 0.01},
                          [this](const ChunkKey& key) -> Result<std::shared_ptr<const Chunk>> {
                              if (is_failing) {
                                  return fail(ErrorCode::io, "the disk has gone");
                              }
                              return make_chunk(*ground, key);
                          })
                          .value())
            .value();
    double time_s = 0.0;

    // One second of updates with the camera at x.
    std::shared_ptr<const ResidentSet> stay(double x, double threshold_px = 2.0) {
        auto cameras = camera_over(*ground, x, 10.0, 0.0);
        cameras[0].threshold_px = threshold_px;
        for (int i = 0; i < 20; ++i) pager.update(cameras, {}, time_s += 0.05);
        return pager.resident();
    }
};

// While root squares of the next window fail to load, the window stays as long as the camera is inside.
TEST(RootWindow, WaitsForItsRootSquaresUnlessTheCameraHasLeft) {
    FailingStorage storage;
    const auto& ground = storage.ground;
    Pager& pager = storage.pager;
    const Lattice before = storage.stay(10.0)->window();
    storage.is_failing = true;
    EXPECT_EQ(storage.stay(1.5 * kSide)->window(), before);
    EXPECT_TRUE(pager.resident()->has_roots());
    EXPECT_GT(pager.stats().failed, 0u);
    const auto left = storage.stay(50.5 * kSide);
    EXPECT_FALSE(left->has_roots());
    Triangulator triangulator = Triangulator::create(*ground, {}).value();
    EXPECT_EQ(
        triangulator.update(left, camera_over(*ground, 50.5 * kSide, 10.0, 0.0)[0].view).status,
        MeshStatus::not_resident);
    storage.is_failing = false;
    storage.time_s += 60.0;
    ASSERT_NO_FATAL_FAILURE(expect_whole(*storage.stay(50.5 * kSide)));
    EXPECT_EQ(place_in_window(50.5 * kSide, 0.0, pager.resident()->window().first_root_x), 2);
}

// A camera that needs only root squares, and failing storage: loads of the next window fail, yet no chunk counts as
// late, because every frame has the whole current window.
TEST(RootWindow, RootSquaresOfTheNextWindowAreNotLate) {
    constexpr double kAnyError = 1e6;
    FailingStorage storage;
    const Pager& pager = storage.pager;
    ASSERT_TRUE(storage.stay(10.0, kAnyError)->has_roots());
    storage.is_failing = true;
    storage.stay(1.5 * kSide, kAnyError);
    EXPECT_GT(pager.stats().failed, 0u);
    EXPECT_EQ(pager.stats().late_chunks, 0u);
    storage.stay(50.5 * kSide, kAnyError);
    EXPECT_GE(pager.stats().late_chunks, std::size_t{kWindow} * kWindow)
        << "it has left the window";
}

// Without cameras the window follows the first body; without bodies, a region.
TEST(RootWindow, FollowsABodyAndThenARegion) {
    const auto ground = endless();
    Pager pager = Pager::create(ground, {.worker_count = 0}).value();
    double time_s = 0.0;
    for (double x = 0.0; x < few_or_many(15, 40) * kSide; x += 0.3 * kSide) {
        const std::array body{
            BodyNeed{.centre_world = {x, 5.0, ground->height(x, 5.0)}, .radius = 1.0}};
        pager.update({}, body, time_s += 0.1);
        ASSERT_EQ(pager.stats().groundless_bodies, 0u) << x;
        const Ground solid = pager.ground();
        ASSERT_EQ(solid.height(x, 5.0).status, QueryStatus::ok);
        ASSERT_EQ(solid.height(x + 20.0 * kSide, 5.0).status, QueryStatus::not_resident)
            << "ground that is there, and not loaded";
    }
    RequiredRegion required = pager.require({-5000.0, -5000.0, -4990.0, -4990.0}, 0.0);
    const std::array body{BodyNeed{.centre_world = {0.0, 0.0, 0.0}, .radius = 1.0}};
    pager.update({}, body, time_s += 0.1);
    EXPECT_EQ(required.state(), RegionState::loading) << "it is not in the body's window";
    pager.update({}, {}, time_s += 0.1);
    EXPECT_TRUE(required.is_ready());
}

TEST(RootWindow, StaysUnderTheCeilingWhileItMoves) {
    const auto ground = endless();
    const std::size_t least = 2 * kWindow * kWindow * Chunk::max_bytes();
    const auto refused = Pager::create(ground, {.memory_bytes = least - 1});
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("memory_bytes must hold the root squares"),
              std::string::npos);
    Pager pager = Pager::create(ground, {.memory_bytes = least, .worker_count = 0}).value();
    Random random(3);
    for (int frame = 0; frame < 30; ++frame) {
        const double reach = frame % 4 == 0 ? 1e6 : 3e3;
        pager.update(
            camera_over(*ground, random.between(-reach, reach), random.between(-reach, reach), 0.0),
            {}, 0.1 * frame);
        ASSERT_LE(pager.stats().peak_bytes, least) << frame;
        ASSERT_NO_FATAL_FAILURE(expect_whole(*pager.resident())) << frame;
    }
}

TEST(RootWindow, SettingsOutOfRangeAreRefusedByName) {
    const auto message = [](std::int32_t window, std::int32_t count) {
        const auto good = Lattice{.root_count_x = count, .root_window = window}.validate();
        return good ? std::string() : good.error().message;
    };
    for (const std::int32_t window : {-4, 1, 2, 5, 66}) {
        EXPECT_EQ(message(window, 10), "root_window must be 0 or an even number of 4 to 64, got " +
                                           std::to_string(window));
    }
    EXPECT_EQ(message(0, 1025), "root_count_x must be 1 to 1024, got 1025");
    EXPECT_EQ(message(4, 0), "root_count_x must be 1 or more, got 0");
    EXPECT_EQ(message(4, 1025), "");
    EXPECT_EQ(message(64, 1), "");
}

}  // namespace
}  // namespace terrane::test::root_window
