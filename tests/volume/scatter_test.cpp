// SPDX-License-Identifier: MIT
//
// Objects that are scattered over ground with volumes.
#include "support/heights/wave_heights.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/scatter.h>
#include <terrane/volume/volume_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

namespace terrane {
namespace volume_scatter_test {

// One root of 256 m, 1 m spacing: two by two chunks of the finest level.
Lattice small_lattice() {
    Lattice lattice;
    lattice.finest_level = 1;
    return lattice;
}

std::shared_ptr<const HeightSource> hills(double amplitude) {
    return std::make_shared<const test::WaveHeights>(small_lattice(), amplitude, 150.0);
}

VolumeOperation operation(VolumeOp op, const VolumeShape& shape, const WorldPos& place) {
    VolumeOperation made{.op = op, .shape = shape};
    made.world_from_shape.translation = place;
    made.voxel = 1.0;
    return made;
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
    return {operation(VolumeOp::remove, VolumeSphere{12.0}, at(60.0, 70.0, 2.0)),
            operation(VolumeOp::remove, VolumeTube{{{0.0, 0.0, 0.0}, {100.0, 20.0, 0.0}}, 5.0},
                      at(90.0, 120.0, 0.0)),
            operation(VolumeOp::add, VolumeSphere{15.0}, at(200.0, 60.0, -5.0)),
            operation(VolumeOp::add, VolumeBox{{20.0, 20.0, 2.0}}, at(60.0, 200.0, 40.0)),
            operation(VolumeOp::remove, VolumeSphere{15.0}, at(200.0, 200.0, -60.0))};
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
        const std::array<int, 2> place = {column / kChunkCells, row / kChunkCells};
        auto& chunk = chunks_[place];
        if (!chunk) chunk = make_chunk(source_, {place[0], place[1], 1}).value();
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
        with_volumes(ground, {operation(VolumeOp::add, VolumeSphere{5.0}, {128.0, 128.0, 200.0})});
    EXPECT_EQ(all_objects(far).size(), before.size()) << "a volume above stands on no ground";
}

}  // namespace volume_scatter_test
}  // namespace terrane
