// SPDX-License-Identifier: MIT
#include "volume/edited_world.h"

#include <terrane/volume/volume_tile.h>

#include <gtest/gtest.h>

#include <cstring>

namespace terrane::test {
namespace {

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

std::string name_of(const ChunkKey& key) {
    return "chunk (" + std::to_string(key.x) + ", " + std::to_string(key.y) + ")";
}

}  // namespace

Lattice dig_lattice() { return Lattice{.finest_level = 2}; }

EditedWorld::EditedWorld(bool has_tunnel)
    : hills(std::make_shared<WaveHeights>(dig_lattice(), 20.0, 200.0)) {
    if (has_tunnel) {
        base.push_back({.op = VolumeOp::remove,
                        .shape = VolumeTube{{{150.0, 240.0, 0.0}, {350.0, 270.0, -5.0}}, 4.0},
                        .voxel = 1.0});
    }
    source = VolumeHeights::create(hills, volumes_with({})).value();
}

Volumes EditedWorld::volumes_with(const std::vector<VolumeOperation>& edits) const {
    std::vector<VolumeOperation> all = base;
    all.insert(all.end(), edits.begin(), edits.end());
    return Volumes::create(dig_lattice(), all, {.level = dig_lattice().finest_level}).value();
}

VolumeOperation random_edit(Random& random, const WaveHeights& hills) {
    VolumeOperation edit{.op = random.below(3) == 0 ? VolumeOp::add : VolumeOp::remove,
                         .voxel = 1.0};
    const double x = 256.0 + random.between(-60.0, 60.0), y = 256.0 + random.between(-60.0, 60.0);
    edit.world_from_shape = at(x, y, hills.height(x, y) + random.between(-12.0, 6.0));
    edit.world_from_shape.rotation = random.rotation();
    switch (random.below(4)) {
        case 0:
            edit.shape = VolumeCapsule{random.between(1.0, 3.0), random.between(0.0, 8.0)};
            break;
        case 1:
            edit.shape = VolumeBox{{random.between(1.0, 5.0), random.between(1.0, 5.0), 2.0}};
            break;
        case 2:
            edit.shape = VolumeTube{{{0, 0, 0}, {8, 2, 0}, {10, 9, 3}}, random.between(1.0, 2.5)};
            break;
        default:
            edit.shape = VolumeSphere{random.between(1.0, 6.0)};
    }
    return edit;
}

Pose at(double x, double y, double z) { return Pose{.translation = {x, y, z}}; }

std::uint32_t apply(VolumeEditor& editor, const VolumeOperation& operation) {
    const auto number = operation.op == VolumeOp::remove
                            ? editor.dig(operation.shape, operation.world_from_shape)
                            : editor.fill(operation.shape, operation.world_from_shape);
    EXPECT_TRUE(number) << number.error().message;
    return number.value_or(0);
}

WholePager whole_world(const std::shared_ptr<const HeightSource>& source, int worker_count,
                       std::size_t memory_bytes) {
    return {
        Pager::create(source, {.memory_bytes = memory_bytes, .worker_count = worker_count}).value(),
        whole_extent(source->lattice())};
}

void settle(Pager& pager) {
    static double time_s = 0.0;
    for (int i = 0; i < 5; ++i) {
        pager.update({}, {}, time_s += 0.1);
        pager.finish();
    }
}

std::string difference(const SolidSurface* a, const SolidSurface* b) {
    if ((a == nullptr) != (b == nullptr)) return "one has a solid, the other none";
    if (a == nullptr) return {};
    const SolidTriangles &x = a->triangles(), &y = b->triangles();
    if (!same_bytes(x.vertices_world, y.vertices_world)) return "vertices";
    if (!same_bytes(x.triangles, y.triangles)) return "triangles";
    if (!same_bytes(x.parts, y.parts)) return "parts";
    if (!same_bytes(x.replaced, y.replaced)) return "replaced triangles";
    if (!same_bytes(x.kept_neighbours, y.kept_neighbours)) return "kept neighbours";
    if (x.error_m != y.error_m || x.hidden_error_m != y.hidden_error_m) return "errors";
    if (!same_bytes(x.error_boxes, y.error_boxes)) return "errors of boxes";
    if (!same_bytes(x.error_box_of, y.error_box_of)) return "boxes of triangles";
    return {};
}

std::string difference(const ResidentSet& set, const Volumes& volumes) {
    for (const ResidentChunk& chunk : set.chunks()) {
        if (chunk->key.level != volumes.level()) continue;
        const auto expected = make_chunk_solid(volumes, *chunk).value();
        const std::string found = difference(chunk->solid.get(), expected.get());
        if (!found.empty()) return name_of(chunk->key) + ": " + found;
    }
    return {};
}

std::string difference(const ResidentSet& a, const ResidentSet& b) {
    if (a.chunks().size() != b.chunks().size()) return "numbers of chunks";
    for (const ResidentChunk& chunk : a.chunks()) {
        const Chunk* const other = b.find_chunk(chunk->key);
        if (other == nullptr) return name_of(chunk->key) + " is in one of them";
        const std::string found = difference(chunk->solid.get(), other->solid.get());
        if (!found.empty()) return name_of(chunk->key) + ": " + found;
    }
    return {};
}

}  // namespace terrane::test
