// SPDX-License-Identifier: MIT
#include "edit/chunk_files.h"

#include <terrane/store/bytes.h>
#include <terrane/terrain/number_text.h>

#include <unistd.h>

#include <new>
#include <utility>

namespace terrane::internal {
namespace {

constexpr SealedKind kKind{{'T', 'D', 'I', 'G'}, 1};
/// Sizes in a file are not trusted for allocations.
constexpr std::uint64_t kMostTileBytes = std::uint64_t{1} << 30;

struct TileRecord {
    std::uint64_t offset = 0, stored_bytes = 0, content_bytes = 0;
    std::array<std::uint64_t, 2> hash{};  // of the content
};

struct Directory {
    std::array<std::uint64_t, 2> volumes{}, heights{};  // heights: of the tiles that have records
    ChunkKey key;
    std::uint32_t position = 0;
    std::uint64_t log_hash = 0;
    std::array<TileRecord, kChunkTiles> tiles{};
};

std::array<std::uint64_t, 2> pair_of(const ContentHash& hash) { return {hash.low, hash.high}; }

void add(ContentHasher& hasher, std::span<const std::int32_t> heights) {
    ByteWriter bytes;
    bytes.put_each(heights);
    hasher.add(bytes.bytes());
}

std::vector<std::uint8_t> directory_bytes(const Directory& directory) {
    ByteWriter out;
    for (const auto& hash : {directory.volumes, directory.heights})
        out.put_each(std::span<const std::uint64_t>(hash));
    out.put(directory.key.x);
    out.put(directory.key.y);
    out.put(directory.key.level);
    out.put(directory.position);
    out.put(directory.log_hash);
    for (const TileRecord& tile : directory.tiles) {
        out.put(tile.offset);
        out.put(tile.stored_bytes);
        out.put(tile.content_bytes);
        out.put_each(std::span<const std::uint64_t>(tile.hash));
    }
    return out.bytes();
}

std::optional<Directory> directory_of(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    Directory directory;
    in.get_each(std::span<std::uint64_t>(directory.volumes));
    in.get_each(std::span<std::uint64_t>(directory.heights));
    directory.key.x = in.get<std::int32_t>();
    directory.key.y = in.get<std::int32_t>();
    directory.key.level = in.get<std::uint8_t>();
    directory.position = in.get<std::uint32_t>();
    directory.log_hash = in.get<std::uint64_t>();
    for (TileRecord& tile : directory.tiles) {
        tile.offset = in.get<std::uint64_t>();
        tile.stored_bytes = in.get<std::uint64_t>();
        tile.content_bytes = in.get<std::uint64_t>();
        in.get_each(std::span<std::uint64_t>(tile.hash));
        if (tile.stored_bytes > kMostTileBytes || tile.content_bytes > kMostTileBytes)
            return std::nullopt;
    }
    if (!in.is_done()) return std::nullopt;
    return directory;
}

/// The content of a tile's record, whole.
Result<std::vector<std::uint8_t>> read_tile(const SealedReader& file, const TileRecord& tile) {
    const auto damaged = [&] {
        return fail(ErrorCode::bad_data, "\"" + file.path() + "\" has a damaged tile");
    };
    if (tile.stored_bytes > file.bytes()) return damaged();
    std::vector<std::uint8_t> stored(static_cast<std::size_t>(tile.stored_bytes));
    if (auto ok = file.read(tile.offset, stored); !ok) return tl::unexpected(ok.error());
    std::vector<std::uint8_t> content(static_cast<std::size_t>(tile.content_bytes));
    const auto size = decompress(stored, content);
    if (!size || *size != content.size() || pair_of(hash_of(content)) != tile.hash)
        return damaged();
    return content;
}

}  // namespace

ChunkFiles::ChunkFiles(std::string folder, const Volumes& volumes)
    : folder_(std::move(folder)), volumes_(volumes) {}

void ChunkFiles::add_position(std::uint32_t number, std::uint64_t log_hash) {
    const std::scoped_lock lock(mutex_);
    log_hashes_[number] = log_hash;
}

std::optional<std::uint64_t> ChunkFiles::log_hash(std::uint32_t number) const {
    const std::scoped_lock lock(mutex_);
    const auto found = log_hashes_.find(number);
    if (found == log_hashes_.end()) return std::nullopt;
    return found->second;
}

std::string ChunkFiles::path_of(const ChunkKey& key) const {
    return folder_ + "/chunk_" + number_text(key.x) + "_" + number_text(key.y) + ".dig";
}

ChunkFiles::Counts ChunkFiles::counts() const {
    const std::scoped_lock lock(mutex_);
    return counts_;
}

std::optional<ChunkFiles::Read> ChunkFiles::read(const Chunk& chunk,
                                                 const ChunkEdits& edits) const {
    if (access(path_of(chunk.key).c_str(), F_OK) != 0) return std::nullopt;
    auto read = try_read(chunk, edits);
    const std::scoped_lock lock(mutex_);
    if (!read) {
        ++counts_.refused;
        counts_.last_refusal = read.error().message;
        return std::nullopt;
    }
    counts_.read += *read ? 1u : 0u;
    return std::move(*read);
}

Result<std::optional<ChunkFiles::Read>> ChunkFiles::try_read(const Chunk& chunk,
                                                             const ChunkEdits& edits) const {
    const std::string path = path_of(chunk.key);
    auto file = SealedReader::open(path, kKind);
    if (!file) return tl::unexpected(file.error());
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, "\"" + path + "\" " + what);
    };
    const auto directory = directory_of(file->directory());
    if (!directory) return bad("has a damaged directory");
    if (directory->volumes != volumes_.fingerprint()) return bad("is of other volumes");
    if (directory->key != chunk.key) return bad("is of another chunk");
    ContentHasher heights;
    for (int i = 0; i < kChunkTiles; ++i) {
        if (directory->tiles[static_cast<std::size_t>(i)].stored_bytes > 0)
            add(heights, tile_heights(chunk, i));
    }
    if (directory->heights != pair_of(heights.value())) return bad("is of other heights");
    if (log_hash(directory->position) != directory->log_hash) return bad("is of another log");
    const auto count = edits.count_at(directory->position);
    if (!count) return std::optional<Read>();  // it has an edit that was undone
    auto tiles = std::make_shared<ChunkTiles>();
    for (int i = 0; i < kChunkTiles; ++i) {
        const TileRecord& record = directory->tiles[static_cast<std::size_t>(i)];
        if (record.stored_bytes == 0) continue;
        const auto content = read_tile(*file, record);
        if (!content) return tl::unexpected(content.error());
        auto tile =
            VolumeTile::decode(volumes_, tile_of(chunk.key, i), tile_heights(chunk, i), *content);
        if (!tile) return bad("cannot be read: " + tile.error().message);
        (*tiles)[static_cast<std::size_t>(i)] = std::make_shared<const TileSolid>(
            std::move(*tile), operations_of(volumes_, edits.edits, *count, tile_of(chunk.key, i)));
    }
    return std::optional<Read>(Read{std::move(tiles), *count});
}

Result<void> ChunkFiles::write(const ChunkKey& key, const ChunkTiles& tiles,
                               std::uint32_t position) const {
    const auto hash = log_hash(position);
    if (!hash)
        return fail(ErrorCode::invalid_argument, "the log has no change " + number_text(position));
    auto file = SealedWriter::create(path_of(key), kKind);
    if (!file) return tl::unexpected(file.error());
    Directory directory{volumes_.fingerprint(), {}, key, position, *hash, {}};
    ContentHasher heights;
    for (int i = 0; i < kChunkTiles; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (!tiles[at]) continue;
        const std::vector<std::uint8_t> content = tiles[at]->level_set.encoded();
        const std::vector<std::uint8_t> stored = compress(content);
        const auto offset = file->append(stored);
        if (!offset) return tl::unexpected(offset.error());
        directory.tiles[at] = {*offset, stored.size(), content.size(), pair_of(hash_of(content))};
        add(heights, tiles[at]->level_set.heights());
    }
    directory.heights = pair_of(heights.value());
    if (auto done = file->commit(directory_bytes(directory)); !done) return done;
    const std::scoped_lock lock(mutex_);
    ++counts_.written;
    return {};
}

}  // namespace terrane::internal
