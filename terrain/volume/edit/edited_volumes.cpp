// SPDX-License-Identifier: MIT
#include "edit/edited_volumes.h"

#include "edit/edit_files.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <utility>

namespace terrane::internal {
namespace {

// The extent of an edit over a chunk.
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
        TERRANE_TRY(VolumeTile tile, make());
        for (const Edit* edit : touching) tile.apply(edit->placed);
        (*tiles)[at] = std::make_shared<const TileSolid>(
            std::move(tile), operations_of(volumes, edits, edits.size(), key));
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

namespace {

/// Bytes of a SolidSurface for each square spacing of the boxes around a volume's pieces: measured 110 to 280 for tubes
/// and spheres.
constexpr double kBytesPerSquare = 320.0;
/// Additional bytes for the replaced triangles of the heightfield and their neighbours.
constexpr double kLeastBytes = 0x1p18;
/// Largest surface area that an estimate assumes, in areas of the bounding box: overlapping volumes would add up to
/// more. A chunk that needs more fails to load, and the retry claims its actual size.
constexpr double kMostBoxAreas = 2.0;

}  // namespace

std::optional<ChunkExtent> EditedVolumes::extent_of(const ChunkKey& key) const {
    const std::shared_lock lock(mutex_);
    return extents_.of_chunk(key);
}

std::optional<HeightInterval> EditedVolumes::over(const WorldRect& rect) const {
    const std::shared_lock lock(mutex_);
    return extents_.over(rect);
}

bool EditedVolumes::is_touched(const ChunkKey& key) const {
    const std::shared_lock lock(mutex_);
    return extents_.of_chunk(key).has_value() || entries_.contains(key);
}

std::size_t EditedVolumes::max_bytes(const ChunkKey& key, std::size_t plain_bytes) const {
    const std::shared_lock lock(mutex_);
    const auto found = entries_.find(key);
    const std::size_t known_bytes = found == entries_.end() ? 0 : found->second.chunk_bytes;
    if (known_bytes > 0 && found->second.version.edits) return known_bytes;
    const auto extent = extents_.of_chunk(key);
    if (!extent) return std::max(plain_bytes, known_bytes);
    const double side = volumes_.spacing() * kChunkCells;
    const double height = extent->solid.heights.high - extent->solid.heights.low;
    const double box_area = 2.0 * side * side + 4.0 * side * height;
    const double squares = std::min(extent->area, kMostBoxAreas * box_area) /
                           (volumes_.spacing() * volumes_.spacing());
    const double solid_bytes = kLeastBytes + kBytesPerSquare * squares;
    return std::max(plain_bytes + static_cast<std::size_t>(solid_bytes), known_bytes);
}

bool EditedVolumes::is_current(const Chunk& chunk) const {
    const std::shared_lock lock(mutex_);
    const auto found = entries_.find(chunk.key);
    const std::uint32_t changed = found != entries_.end() && found->second.version.edits
                                      ? found->second.version.edits->changed
                                      : 0;
    return chunk.change == changed;
}

std::uint32_t EditedVolumes::number() const {
    const std::shared_lock lock(mutex_);
    return number_;
}

ChunkVersion EditedVolumes::version_of(const ChunkKey& key) const {
    const std::shared_lock lock(mutex_);
    const auto found = entries_.find(key);
    return found == entries_.end() ? ChunkVersion() : found->second.version;
}

Result<std::shared_ptr<const Chunk>> EditedVolumes::make(std::shared_ptr<const Chunk> chunk) {
    const ChunkKey key = chunk->key;
    ChunkVersion version = version_of(key);
    if (!version.tiles && version.edits) {
        std::shared_ptr<const ChunkFiles> files;
        {
            const std::shared_lock lock(mutex_);
            files = files_;
        }
        if (auto read = files ? files->read(*chunk, *version.edits) : std::nullopt) {
            version.tiles = std::move(read->tiles);
            version.tile_edits = read->edit_count;
        }
    }
    TERRANE_TRY(auto made, make_tiles(volumes_, *chunk, version));
    const std::shared_ptr<const ChunkTiles> tiles = std::move(made);
    const bool is_plain =
        std::ranges::none_of(*tiles, [](const auto& tile) { return tile != nullptr; });
    if (!is_plain || version.edits) {
        chunk = with_tiles(volumes_.lattice(), *chunk, *tiles, SolidLevels::all,
                           version.edits ? version.edits->changed : 0);
    }
    std::vector<std::shared_ptr<const ChunkTiles>> dropped;  // freed after the lock
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(key);
    const ChunkVersion now = found == entries_.end() ? ChunkVersion() : found->second.version;
    // If a change has taken effect meanwhile, the newer version can still start from these tiles.
    const bool is_beginning = begins_with(now.list(), version.list()) &&
                              (!now.tiles || now.tile_edits <= version.list().size());
    if (most_tile_bytes_ > 0 && is_beginning)
        hold(entries_[key], key, tiles, version.list().size());
    if (now.edits == version.edits && chunk->solid) {
        Entry& entry = entries_[key];
        entry.chunk_bytes = std::max(version.edits ? 0 : entry.chunk_bytes, chunk->bytes());
    }
    dropped.swap(dropped_);
    return chunk;
}

void EditedVolumes::keep_tiles(std::size_t most_bytes, std::shared_ptr<const ChunkFiles> files) {
    std::vector<std::shared_ptr<const ChunkTiles>> dropped;
    const std::scoped_lock lock(mutex_);
    most_tile_bytes_ = most_bytes;
    files_ = std::move(files);
    drop_old();
    dropped.swap(dropped_);
}

std::vector<std::shared_ptr<const ChunkTiles>> EditedVolumes::switch_to(
    std::span<const NewVersion> versions, std::uint32_t number) {
    const std::scoped_lock lock(mutex_);
    number_ = number;
    for (const NewVersion& each : versions) {
        Entry& entry = entries_[each.key];
        hold(entry, each.key, each.version.tiles, each.version.tile_edits);
        entry.version.edits = each.version.edits;
        entry.chunk_bytes = each.chunk_bytes;
        extents_.set(each.key, each.version.edits->extent);
    }
    return std::exchange(dropped_, {});
}

void EditedVolumes::hold(Entry& entry, const ChunkKey& key, std::shared_ptr<const ChunkTiles> tiles,
                         std::size_t tile_edits) {
    if (entry.version.tiles) {
        tile_bytes_ -= entry.tile_bytes;
        uses_.erase(entry.use);
        dropped_.push_back(std::move(entry.version.tiles));
    }
    entry.version.tiles = std::move(tiles);
    entry.version.tile_edits = tile_edits;
    if (!entry.version.tiles) return;
    entry.tile_bytes = bytes_of(*entry.version.tiles);
    tile_bytes_ += entry.tile_bytes;
    uses_.push_front(key);
    entry.use = uses_.begin();
    drop_old();
}

void EditedVolumes::drop_old() {
    while (tile_bytes_ > most_tile_bytes_ && !uses_.empty()) {
        Entry& oldest = entries_.at(uses_.back());
        tile_bytes_ -= oldest.tile_bytes;
        dropped_.push_back(std::move(oldest.version.tiles));
        oldest.version.tiles.reset();
        uses_.pop_back();
    }
}

void begin(PreparedChange& prepared, const HeightSource& heights, const Volumes& volumes,
           const EditedVolumes& in_force, std::map<ChunkKey, ChunkVersion> before,
           const std::map<ChunkKey, ChunkVersion>* snapshot) {
    const Change& change = prepared.change;
    prepared.before = std::move(before);
    for (const ChunkKey& key : prepared.touched) {
        const ChunkVersion& old = prepared.before.at(key);
        ChunkEdits none;
        if (!old.edits) none.base_extent = none.extent = in_force.extent_of(key);
        const ChunkEdits& edits = old.edits ? *old.edits : none;
        ChunkVersion version = old;
        if (change.is_undo) {
            version.edits = without_last(heights, volumes, key, edits, change.number);
            if (snapshot) {
                const ChunkVersion& earlier = snapshot->at(key);
                version.tiles = earlier.tiles;
                version.tile_edits = earlier.tile_edits;
            }
            // An undo cannot be applied to level sets, because an operation overwrites the earlier distances.
            if (version.tile_edits > version.list().size()) {
                version.tiles.reset();
                version.tile_edits = 0;
            }
        } else {
            version.edits = with_edit(heights, volumes, key, edits, change.edit);
        }
        prepared.versions[key] = std::move(version);
    }
}

void make_chunk_of(PreparedChange& prepared, const Volumes& volumes, const Chunk& resident) {
    try {
        ChunkVersion& version = prepared.versions.at(resident.key);
        if (!version.is_made()) {
            auto tiles = make_tiles(volumes, resident, version);
            if (!tiles) {
                prepared.failure = tiles.error().message;
                return;
            }
            version.tiles = std::move(*tiles);
            version.tile_edits = version.list().size();
        }
        prepared.chunks[resident.key] = with_tiles(volumes.lattice(), resident, *version.tiles,
                                                   SolidLevels::none, version.edits->changed);
        prepared.failure.clear();
    } catch (const std::bad_alloc&) {
        prepared.failure = "out of memory";
    }
}

}  // namespace terrane::internal
