// SPDX-License-Identifier: MIT
#include "edit/edit.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {
namespace {

// What an edit adds over a chunk.
std::optional<ChunkExtent> extent_over(const HeightSource& heights, const Volumes& volumes,
                                       const ChunkKey& key, const Edit& edit) {
    std::optional<ChunkExtent> extent;
    for (int i = 0; i < kChunkTiles; ++i) {
        const auto part =
            std::ranges::lower_bound(edit.parts, tile_of(key, i), {}, &VolumeTilePart::key);
        if (part == edit.parts.end() || part->key != tile_of(key, i)) continue;
        extent = united(extent, extent_of(heights, volumes, edit.placed.op(), *part));
    }
    return extent;
}

}  // namespace

Edit::Edit(std::uint32_t edit_number, VolumeOperation of, PlacedVolume volume)
    : number(edit_number),
      operation(std::move(of)),
      placed(std::move(volume)),
      parts(placed.tiles()) {}

bool Edit::touches(const VolumeTileKey& tile) const {
    return std::ranges::binary_search(parts, tile, {}, &VolumeTilePart::key);
}

std::vector<ChunkKey> Edit::chunks(int level) const {
    std::vector<ChunkKey> keys;
    for (const VolumeTilePart& part : parts) {
        const ChunkKey key = chunk_of(part.key, level);
        if (keys.empty() || keys.back() != key) keys.push_back(key);
    }
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
}

bool begins_with(const EditList& list, const EditList& first) {
    return first.empty() || (first.size() <= list.size() && list[first.size() - 1] == first.back());
}

std::optional<std::size_t> ChunkEdits::count_at(std::uint32_t position) const {
    for (const UndoneEdit& each : undone) {
        if (each.edit <= position && position < each.undo) return std::nullopt;
    }
    const auto end = std::ranges::upper_bound(edits, position, {}, &Edit::number);
    return static_cast<std::size_t>(end - edits.begin());
}

const EditList& ChunkVersion::list() const {
    static const EditList none;
    return edits ? edits->edits : none;
}

std::shared_ptr<const ChunkEdits> with_edit(const HeightSource& heights, const Volumes& volumes,
                                            const ChunkKey& key, const ChunkEdits& before,
                                            const std::shared_ptr<const Edit>& edit) {
    auto after = std::make_shared<ChunkEdits>(before);
    after->changed = edit->number;
    after->edits.push_back(edit);
    after->extent = united(before.extent, extent_over(heights, volumes, key, *edit));
    return after;
}

std::shared_ptr<const ChunkEdits> without_last(const HeightSource& heights, const Volumes& volumes,
                                               const ChunkKey& key, const ChunkEdits& before,
                                               std::uint32_t undo) {
    auto after = std::make_shared<ChunkEdits>(before);
    after->changed = undo;
    after->undone.push_back({before.edits.back()->number, undo});
    after->edits.pop_back();
    after->extent = extent_with(heights, volumes, key, *after);
    return after;
}

std::optional<ChunkExtent> extent_with(const HeightSource& heights, const Volumes& volumes,
                                       const ChunkKey& key, const ChunkEdits& edits) {
    std::optional<ChunkExtent> extent = edits.base_extent;
    for (const auto& edit : edits.edits)
        extent = united(extent, extent_over(heights, volumes, key, *edit));
    return extent;
}

std::vector<const PlacedVolume*> operations_of(const Volumes& volumes, const EditList& edits,
                                               std::size_t edit_count, const VolumeTileKey& tile) {
    std::vector<const PlacedVolume*> operations = operations_of(volumes, tile);
    for (std::size_t e = 0; e < edit_count; ++e) {
        if (edits[e]->touches(tile)) operations.push_back(&edits[e]->placed);
    }
    return operations;
}

Result<std::shared_ptr<const ChunkTiles>> make_tiles(const Volumes& volumes, const Chunk& chunk,
                                                     const ChunkVersion& version) {
    const EditList& edits = version.list();
    const ChunkTiles* const from = version.tiles.get();
    auto tiles = std::make_shared<ChunkTiles>();
    for (int i = 0; i < kChunkTiles; ++i) {
        const VolumeTileKey key = tile_of(chunk.key, i);
        const auto at = static_cast<std::size_t>(i);
        std::vector<const Edit*> touching;
        for (std::size_t e = from ? version.tile_edits : 0; e < edits.size(); ++e) {
            if (edits[e]->touches(key)) touching.push_back(edits[e].get());
        }
        if (from && touching.empty()) {
            (*tiles)[at] = (*from)[at];
            continue;
        }
        if (touching.empty() && volumes.operations_at(key).empty()) continue;
        const auto make = [&]() -> Result<VolumeTile> {
            if (from && (*from)[at]) return (*from)[at]->level_set.copy();
            return VolumeTile::create(volumes, key, tile_heights(chunk, i));
        };
        Result<VolumeTile> tile = make();
        if (!tile) return tl::unexpected(tile.error());
        for (const Edit* edit : touching) tile->apply(edit->placed);
        (*tiles)[at] = std::make_shared<const TileSolid>(
            std::move(*tile), operations_of(volumes, edits, edits.size(), key));
    }
    return std::shared_ptr<const ChunkTiles>(std::move(tiles));
}

std::shared_ptr<const Chunk> with_tiles(const Lattice& lattice, const Chunk& chunk,
                                        const ChunkTiles& tiles, SolidLevels levels,
                                        std::uint32_t change) {
    auto made = std::make_shared<Chunk>(chunk);
    made->solid = make_solid(lattice, chunk, tiles, levels);
    made->change = change;
    return made;
}

}  // namespace terrane::internal
