// SPDX-License-Identifier: MIT
#include "edit/edited_volumes.h"

#include "edit/chunk_files.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace terrane::internal {
namespace {

/// Bytes of a SolidSurface for each square spacing of the boxes around a volume's pieces: measured 110 to 280 for tubes
/// and spheres.
constexpr double kBytesPerSquare = 320.0;
/// For what is cut of the heightfield.
constexpr double kLeastBytes = 0x1p18;
/// Most area of a surface, in areas of the box that it lies in: many volumes in one place overlap. A chunk that needs
/// more is a failed load, whose retry claims what it has turned out to need.
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
    auto made = make_tiles(volumes_, *chunk, version);
    if (!made) return tl::unexpected(made.error());
    const std::shared_ptr<const ChunkTiles> tiles = std::move(*made);
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
    // A change may have come into force meanwhile: then the tiles serve as a beginning.
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

}  // namespace terrane::internal
