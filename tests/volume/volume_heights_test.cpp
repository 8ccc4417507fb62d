// SPDX-License-Identifier: MIT
//
// Volumes as a source of a pager: what is loaded, what it claims, and what answers.
#include "support/grounds.h"
#include "volume/volume_scenes.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/scatter.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::volume_heights_test {

using namespace test;

/// Four levels of 1 m to 8 m, one root of 1024 m.
Lattice small_lattice() { return Lattice{.finest_level = 3}; }

std::shared_ptr<const HeightSource> hills() {
    return std::make_shared<const WaveHeights>(small_lattice(), 30.0, 300.0);
}

VolumeOperation tunnel(double from_x, double to_x, double y, double z, double radius = 4.0) {
    return place(VolumeTube{{{from_x, y, z}, {to_x, y, z}}, radius}, WorldPos::Zero());
}

std::shared_ptr<const VolumeHeights> with_volumes(const std::vector<VolumeOperation>& operations) {
    const auto volumes =
        Volumes::create(small_lattice(), operations, {.level = small_lattice().finest_level});
    return VolumeHeights::create(hills(), volumes.value()).value();
}

Pager make_pager(const std::shared_ptr<const HeightSource>& source, std::size_t memory_bytes) {
    return Pager::create(source, {.memory_bytes = memory_bytes, .worker_count = 0}).value();
}

TEST(VolumeHeights, RefusesVolumesOfAnotherLatticeOrLevel) {
    const std::vector<VolumeOperation> operations{tunnel(100.0, 900.0, 500.0, -60.0)};
    Lattice other = small_lattice();
    other.origin_x = 1.0;
    const auto refusal = [](const Result<Volumes>& volumes) {
        const auto made = VolumeHeights::create(hills(), volumes.value());
        return made ? std::string() : made.error().message;
    };
    EXPECT_NE(refusal(Volumes::create(other, operations, {.level = 3})).find("another lattice"),
              std::string::npos);
    EXPECT_NE(refusal(Volumes::create(small_lattice(), operations, {.level = 2})).find("got 2"),
              std::string::npos);
}

TEST(VolumeHeights, IntervalsEncloseVolumesAndStayElsewhere) {
    const auto source = with_volumes({tunnel(300.0, 500.0, 500.0, -200.0)});
    const WorldRect inside{390.0, 490.0, 410.0, 510.0}, far{800.0, 100.0, 820.0, 120.0};
    EXPECT_LE(source->interval(inside).low, -204.0);
    EXPECT_EQ(source->interval(far).low, source->heights().interval(far).low);
    EXPECT_LE(source->interval({-1e300, -1e300, 1e300, 1e300}).low, -204.0);
}

TEST(VolumeHeights, AVolumeThatTouchesNothingAddsNothing) {
    VolumeOperation above = tunnel(300.0, 500.0, 500.0, 400.0);
    const auto source = with_volumes({above});
    EXPECT_FALSE(source->solid_extent({0, 0, 0}).has_value());
    above.op = VolumeOp::add;
    EXPECT_TRUE(with_volumes({above})->solid_extent({0, 0, 0}).has_value());
    VolumeOperation below = tunnel(300.0, 500.0, 500.0, -400.0);
    below.op = VolumeOp::add;
    EXPECT_FALSE(with_volumes({below})->solid_extent({0, 0, 0}).has_value());
}

TEST(VolumeHeights, BodiesInATunnelHaveItsChunksResident) {
    const auto source = with_volumes({tunnel(100.0, 900.0, 500.0, -60.0)});
    Pager pager = make_pager(source, std::size_t{256} << 20);
    BodyNeed body{
        .centre_world = {500.0, 500.0, -61.0}, .velocity = {10.0, 0.0, 0.0}, .radius = 2.0};
    for (int i = 0; i < 5; ++i) pager.update({}, {&body, 1}, 0.1 * i);
    const Ground ground = pager.ground();
    const HeightAnswer floor = ground.height_below(500.0, 500.0, -60.0);
    ASSERT_EQ(floor.status, QueryStatus::ok);
    EXPECT_NEAR(floor.height, -64.0, 0.1);
    EXPECT_EQ(pager.stats().failed, 0u) << pager.last_failure();
}

TEST(VolumeHeights, ACameraHasDistantVolumesLoaded) {
    // The heightfield itself is almost flat: only the tunnel needs fine chunks.
    const auto flat = std::make_shared<const WaveHeights>(small_lattice(), 0.01, 300.0);
    const auto volumes =
        Volumes::create(small_lattice(), std::vector{tunnel(100.0, 900.0, 500.0, -10.0)},
                        {.level = small_lattice().finest_level});
    const auto source = VolumeHeights::create(flat, volumes.value()).value();
    const auto count_solids = [&](double eye_z) {
        Pager pager = make_pager(source, std::size_t{256} << 20);
        CameraNeed camera;
        camera.view.eye_world = {500.0, -200.0, eye_z};
        camera.view.forward = Eigen::Vector3d(0.0, 1.0, -0.2).normalized();
        camera.view.up = Eigen::Vector3d(0.0, 0.2, 1.0).normalized();
        pager.update({&camera, 1}, {}, 0.0);
        int count = 0;
        for (const auto& chunk : pager.resident()->chunks()) count += chunk->solid ? 1 : 0;
        return count;
    };
    EXPECT_EQ(count_solids(100.0), 8);
    EXPECT_EQ(count_solids(1e6), 0);
}

// A claim that is too small is a failed load, whose retry claims what the chunk needs; the ceiling holds throughout.
TEST(VolumeHeights, ClaimsWhatChunksNeed) {
    std::vector<VolumeOperation> operations;
    for (int i = 0; i < 3; ++i) {
        operations.push_back(tunnel(10.0, 1000.0, 490.0 + 8.0 * i, -60.0, 3.0));
    }
    const auto source = with_volumes(operations);
    const std::size_t ceiling = 48'000'000;
    Pager pager = make_pager(source, ceiling);
    BodyNeed body{.velocity = {50.0, 0.0, 0.0}, .radius = 2.0};
    for (int i = 0; i < 200; ++i) {
        body.centre_world = {20.0 + 4.8 * i, 500.0, -60.0};
        pager.update({}, {&body, 1}, 0.1 * i);
        ASSERT_LE(pager.stats().peak_bytes, ceiling);
        const Ground ground = pager.ground();
        const HeightAnswer below = ground.height_below(body.centre_world.x(), 500.0, 0.0);
        ASSERT_EQ(below.status, QueryStatus::ok) << i << ": " << pager.last_failure();
    }
    EXPECT_GT(pager.stats().evicted, 0u);
}

}  // namespace terrane::volume_heights_test

// The ground over chunks with volumes, against formulas: heights, the next surface down, and rays.

namespace terrane::chunk_solid_test {

using namespace test;

double hill(double x, double y) { return 30.0 * std::sin(0.02 * x) + 3.0 * std::cos(0.21 * y); }

struct Scene {
    Ground ground;
    Volumes volumes;
};

/// A tunnel along x through a hill, over the border of two chunks, with a hall, a shaft and an arch on the hill.
std::vector<VolumeOperation> make_operations() {
    return {place(VolumeTube{{{20.0, 64.0, 2.0}, {230.0, 70.0, 2.0}}, 5.0}, WorldPos::Zero()),
            place(VolumeSphere{14.0}, {128.0, 67.0, 4.0}),
            place(VolumeCapsule{4.0, 30.0}, {60.0, 65.0, 30.0}),
            place(VolumeOp::add, VolumeSphere{6.0}, {90.0, 100.0, hill(90.0, 100.0) + 2.0})};
}

Scene make_scene() {
    std::optional<Volumes> volumes;
    TableGroundSettings settings{.roots = 2};
    settings.solid = [&](const Chunk& chunk) -> std::shared_ptr<const SolidSurface> {
        if (!volumes) {
            Lattice lattice{.quantum = settings.quantum};
            lattice.root_count_x = lattice.root_count_y = settings.roots;
            volumes = Volumes::create(lattice, make_operations()).value();
        }
        return make_chunk_solid(*volumes, chunk).value();
    };
    Ground ground = make_test_ground(hill, settings);
    return {std::move(ground), *volumes};
}

AnalyticSolid make_oracle() {
    const Ground plain = make_test_ground(hill, 1.0, 2);
    return {make_operations(), [plain](double x, double y) { return plain.height(x, y).height; }};
}

TEST(ChunkSolid, SurfacesBelowEachOtherDivideSolidFromAir) {
    const Scene scene = make_scene();
    const AnalyticSolid oracle = make_oracle();
    Random random(5);
    SCOPED_TRACE("seed 5");
    int compared = 0;
    for (int i = 0; i < 3000; ++i) {
        const double x = random.between(10.0, 240.0);
        const double y = i % 2 == 0 ? random.between(55.0, 80.0) : random.between(80.0, 115.0);
        // From the highest surface downwards: below a surface whose normal points up is solid, until the next one.
        double z = 1000.0;
        bool was_solid = false;
        for (int count = 0; count < 20; ++count) {
            const HeightAnswer surface = scene.ground.height_below(x, y, z);
            const double bottom = surface.status == QueryStatus::ok ? surface.height : z - 20.0;
            const Eigen::Vector3d middle(x, y, 0.5 * (std::min(z, 100.0) + bottom));
            const bool is_clear = oracle.distance_to_shapes(middle) > 1.2 &&
                                  std::abs(middle.z() - oracle.height(x, y)) > 1e-6;
            if (is_clear) {
                ASSERT_EQ(oracle.is_solid(middle), was_solid) << middle.transpose();
                ++compared;
            }
            if (surface.status != QueryStatus::ok) break;
            // Ceilings are below solid, floors below air.
            ASSERT_EQ(surface.normal.z() < 0.0, was_solid) << x << ", " << y << ", " << bottom;
            was_solid = !was_solid;
            z = surface.height - 1e-9;  // answers are exact to rounding
        }
        ASSERT_TRUE(was_solid) << "it ends in solid";
    }
    EXPECT_GT(compared, 3000);
}

TEST(ChunkSolid, RaysInATunnelMeetItsWallAtItsRadius) {
    const Scene scene = make_scene();
    Random random(6);
    SCOPED_TRACE("seed 6");
    const Eigen::Vector3d from(20.0, 64.0, 2.0), along(210.0, 6.0, 0.0);
    for (int i = 0; i < 2000; ++i) {
        const double share = random.between(0.25, 0.35);
        const WorldPos middle = from + share * along;
        Eigen::Vector3d n = random.direction();
        n -= along.normalized() * along.normalized().dot(n);
        const RayAnswer answer = scene.ground.ray(middle, middle + 8.0 * n.normalized());
        ASSERT_EQ(answer.status, QueryStatus::ok);
        ASSERT_NEAR((answer.point_world - middle).norm(), 5.0, 0.1);
        ASSERT_LT(answer.normal.dot(n.normalized()), -0.7);
        ASSERT_GE(answer.error_m, std::abs((answer.point_world - middle).norm() - 5.0));
    }
    // Along the axis, over the border of the chunks and out of the mouth in the far side of the hill; and back, to the
    // blind end.
    const WorldPos inside = from + 0.3 * along, outside = from + 1.0 * along;
    EXPECT_EQ(scene.ground.ray(inside, outside).status, QueryStatus::miss);
    const RayAnswer back = scene.ground.ray(outside, from - 0.2 * along);
    ASSERT_EQ(back.status, QueryStatus::ok);
    EXPECT_NEAR((back.point_world - from).norm(), 5.0, 0.1);
}

TEST(ChunkSolid, NothingSlipsThroughTheSeamWithTheHeightfield) {
    // Neither spacing nor origin is a short binary fraction, so that coordinates round.
    TableGroundSettings settings{.spacing = 0.3, .roots = 2, .origin_x = 123456.7};
    Lattice lattice{
        .origin_x = settings.origin_x, .spacing = settings.spacing, .quantum = settings.quantum};
    lattice.root_count_x = lattice.root_count_y = settings.roots;
    const auto rough = [](double x, double y) { return std::sin(0.7 * x) + std::cos(0.9 * y); };
    // Over the border of two chunks.
    VolumeOperation dig = place(VolumeSphere{3.0}, {123456.7 + 38.4, 19.2, 0.5});
    dig.voxel = settings.spacing;
    const Volumes volumes = Volumes::create(lattice, std::vector{dig}).value();
    std::vector<std::shared_ptr<const SolidSurface>> solids;
    settings.solid = [&](const Chunk& chunk) {
        std::shared_ptr<const SolidSurface> solid = make_chunk_solid(volumes, chunk).value();
        if (solid != nullptr) solids.push_back(solid);
        return solid;
    };
    const Ground ground = make_test_ground(rough, settings);
    ASSERT_EQ(solids.size(), 2u);
    Random random(7);
    SCOPED_TRACE("seed 7");
    int count = 0;
    for (const auto& solid : solids) {
        const SolidTriangles& own = solid->triangles();
        ASSERT_FALSE(own.kept_neighbours.empty());
        for (const auto& triangle : own.kept_neighbours) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Eigen::Vector3d &a = own.vertices_world[triangle[k]],
                                      &b = own.vertices_world[triangle[(k + 1) % 3]];
                for (int i = 0; i < 8; ++i) {
                    const WorldPos target = a + random.between(0.0, 1.0) * (b - a);
                    Eigen::Vector3d n = random.direction();
                    n.z() = std::abs(n.z()) + 3.0;  // steeper than the ground: it passes through
                    const RayAnswer answer = ground.ray(target + 0.2 * n, target - 0.2 * n);
                    ASSERT_EQ(answer.status, QueryStatus::ok) << target.transpose();
                    const HeightAnswer height = ground.height(target.x(), target.y());
                    ASSERT_EQ(height.status, QueryStatus::ok);
                    ASSERT_NEAR(height.height, target.z(), 1e-6);
                    ++count;
                }
            }
        }
    }
    EXPECT_GT(count, 2000);
}

TEST(ChunkSolid, FindsTheTrianglesWhoseBoxesOverlapABox) {
    const Scene scene = make_scene();
    ASSERT_TRUE(scene.ground.has_solids());
    EXPECT_FALSE(make_test_ground(hill, 1.0, 2).has_solids());
    EXPECT_EQ(scene.ground.solid(50, 200), nullptr);
    const SolidSurface* const solid = scene.ground.solid(50, 60);
    ASSERT_NE(solid, nullptr);
    const std::size_t all =
        solid->triangles().triangles.size() + solid->triangles().kept_neighbours.size();
    Random random(8);
    SCOPED_TRACE("seed 8");
    std::size_t most = 0;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d low(random.between(20.0, 110.0), random.between(55.0, 75.0),
                                  random.between(-5.0, 8.0));
        const Eigen::Vector3d size(random.between(0.0, 6.0), random.between(0.0, 6.0),
                                   random.between(0.0, 6.0));
        const Aabb box{low, low + size};
        std::vector<std::uint32_t> expected;
        for (std::uint32_t t = 0; t < all; ++t) {
            const auto v = solid->corners_world(t);
            const Eigen::Vector3d from = v[0].cwiseMin(v[1]).cwiseMin(v[2]),
                                  to = v[0].cwiseMax(v[1]).cwiseMax(v[2]);
            if ((from - box.high).maxCoeff() <= 0.0 && (box.low - to).maxCoeff() <= 0.0) {
                expected.push_back(t);
            }
        }
        std::vector<std::uint32_t> found;
        std::array<std::uint32_t, 7> some;
        std::uint32_t cursor = 0;
        for (std::size_t count = some.size(); count == some.size();) {
            count = solid->find_overlaps(box, cursor, some);
            found.insert(found.end(), some.begin(),
                         some.begin() + static_cast<std::ptrdiff_t>(count));
        }
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found, expected);
        most = std::max(most, found.size());
    }
    EXPECT_GT(most, 50u);
}

TEST(ChunkSolid, OfAChunkWithoutVolumesIsNull) {
    const Scene scene = make_scene();
    // The northern chunks have none.
    EXPECT_EQ(scene.ground.height(50.5, 200.5).height,
              make_test_ground(hill, 1.0, 2).height(50.5, 200.5).height);
    Chunk chunk;
    chunk.key = {0, 1, std::uint8_t{0}};
    EXPECT_EQ(make_chunk_solid(scene.volumes, chunk).value(), nullptr);
    chunk.key = {0, 0, std::uint8_t{3}};
    const auto refused = make_chunk_solid(scene.volumes, chunk);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
}

}  // namespace terrane::chunk_solid_test

// Objects that are scattered over ground with volumes.

namespace terrane::volume_scatter_test {

using test::place;

// One root of 256 m, 1 m spacing: two by two chunks of the finest level.
Lattice small_lattice() { return Lattice{.finest_level = 1}; }

std::shared_ptr<const HeightSource> hills(double amplitude) {
    return std::make_shared<const test::WaveHeights>(small_lattice(), amplitude, 150.0);
}

std::shared_ptr<const VolumeHeights> with_volumes(const std::shared_ptr<const HeightSource>& ground,
                                                  const std::vector<VolumeOperation>& operations) {
    const auto volumes = Volumes::create(ground->lattice(), operations, {.level = 1});
    return VolumeHeights::create(ground, volumes.value()).value();
}

// A dug hole, a tunnel that opens the hillside, a mound, a slab high above the ground, a cave far below it.
std::vector<VolumeOperation> make_operations(const HeightSource& ground) {
    const auto at = [&](double x, double y, double above) {
        return WorldPos(x, y, ground.height(x, y) + above);
    };
    return {place(VolumeOp::remove, VolumeSphere{12.0}, at(60.0, 70.0, 2.0)),
            place(VolumeOp::remove, VolumeTube{{{0.0, 0.0, 0.0}, {100.0, 20.0, 0.0}}, 5.0},
                  at(90.0, 120.0, 0.0)),
            place(VolumeOp::add, VolumeSphere{15.0}, at(200.0, 60.0, -5.0)),
            place(VolumeOp::add, VolumeBox{{20.0, 20.0, 2.0}}, at(60.0, 200.0, 40.0)),
            place(VolumeOp::remove, VolumeSphere{15.0}, at(200.0, 200.0, -60.0))};
}

std::vector<ScatterPoint> all_objects(const std::shared_ptr<const HeightSource>& source) {
    const Scatter scatter = Scatter::create(source, {.per_km2 = 4e5, .seed = 3}).value();
    const ScatterRange all = scatter.squares_within(WorldPos::Zero(), 1e9).value();
    std::vector<ScatterPoint> points;
    for (std::int32_t y = all.low.y; y <= all.high.y; ++y) {
        for (std::int32_t x = all.low.x; x <= all.high.x; ++x) {
            const std::vector<ScatterPoint> of_square = scatter.objects_in({x, y}).value();
            points.insert(points.end(), of_square.begin(), of_square.end());
        }
    }
    return points;
}

// Whether the contact surface lacks a triangle of the heightfield in the cell at a place.
class Contact {
public:
    explicit Contact(const HeightSource& source) : source_(source) {}

    bool is_cell_replaced(const WorldPos& p) {
        const int column = static_cast<int>(std::floor(p.x()));
        const int row = static_cast<int>(std::floor(p.y()));
        const std::array<int, 2> square = {column / kChunkCells, row / kChunkCells};
        auto& chunk = chunks_[square];
        if (!chunk) chunk = make_chunk(source_, {square[0], square[1], 1}).value();
        if (!chunk->solid) return false;
        const std::size_t cell = cell_index(column % kChunkCells, row % kChunkCells);
        return chunk->solid->is_replaced(cell, false) || chunk->solid->is_replaced(cell, true);
    }

private:
    const HeightSource& source_;
    std::map<std::array<int, 2>, std::shared_ptr<const Chunk>> chunks_;
};

TEST(ScatterOverVolumes, ObjectsStandOnGroundThatVolumesLeave) {
    for (const double amplitude : {2.0, 40.0, 150.0}) {
        SCOPED_TRACE(amplitude);
        const auto ground = hills(amplitude);
        const auto source = with_volumes(ground, make_operations(*ground));
        const std::vector<ScatterPoint> points = all_objects(source);
        Contact contact(*source);
        for (const ScatterPoint& point : points) {
            const WorldPos& p = point.position_world;
            ASSERT_FALSE(contact.is_cell_replaced(p)) << p.transpose();
        }
        EXPECT_GT(points.size(), 20'000u);
    }
}

TEST(ScatterOverVolumes, OnlyObjectsAtVolumesAreLeftOutAndTheOthersStayAsTheyWere) {
    const auto ground = hills(40.0);
    const auto source = with_volumes(ground, make_operations(*ground));
    const std::vector<ScatterPoint> before = all_objects(ground), after = all_objects(source);
    Contact contact(*source);
    int left_out = 0, beside = 0;
    auto next = after.begin();
    for (const ScatterPoint& point : before) {
        const WorldPos& p = point.position_world;
        if (next != after.end() && next->position_world == p) {
            EXPECT_EQ(next->scale, point.scale);
            EXPECT_EQ(next->half_turn_sine, point.half_turn_sine);
            ++next;
            continue;
        }
        ++left_out;
        double distance = 1e9;
        for (const PlacedVolume& volume : source->volumes().operations())
            distance = std::min(distance, volume.signed_distance(p));
        ASSERT_LT(distance, 4.0) << p.transpose() << ": farther than across a cell";
        beside += contact.is_cell_replaced(p) ? 0 : 1;
    }
    EXPECT_EQ(next, after.end());
    EXPECT_GT(left_out, 300);
    EXPECT_LT(beside, left_out / 3) << "few objects beside an opening are left out";
    const auto far =
        with_volumes(ground, {place(VolumeOp::add, VolumeSphere{5.0}, {128.0, 128.0, 200.0})});
    EXPECT_EQ(all_objects(far).size(), before.size()) << "a volume above stands on no ground";
}

}  // namespace terrane::volume_scatter_test
