// SPDX-License-Identifier: MIT
#include "store_records.h"

#include "file_io.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <list>
#include <mutex>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace terrane::internal {
namespace {

HeightInterval joined(const HeightInterval& a, const HeightInterval& b) {
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

}  // namespace

StoreInfo info_of(const Manifest& manifest) {
    StoreInfo info;
    const ShardLayout layout(manifest.world);
    for (std::size_t i = 0; i < manifest.shards.size(); ++i) {
        info.chunk_count +=
            static_cast<std::int64_t>(layout.extent(static_cast<std::int64_t>(i)).chunk_count());
        info.bytes += manifest.shards[i].bytes;
    }
    info.max_error_m = manifest.world.max_error_m;
    info.sha = sha_of(manifest);
    info.note = manifest.world.note;
    return info;
}

namespace {

/// Largest size of a record with at most this much content. Places of records are not trusted.
std::size_t most_stored(std::size_t most_bytes) { return 2 * most_bytes; }

/// Decompresses and checks a record.
RecordContent content_of(std::span<const std::uint8_t> stored, const ContentHash& hash,
                         std::size_t most_bytes) {
    std::vector<std::uint8_t> content(most_bytes);
    const Result<std::size_t> size = decompress(stored, content);
    if (!size) return std::nullopt;
    content.resize(*size);
    if (hash_of(content) != hash) return std::nullopt;
    return content;
}

/// Whether a record can be in a file.
bool is_inside(const StoredRecord& record, const ShardFile& file, std::size_t most_bytes) {
    return record.bytes <= most_stored(most_bytes) && record.offset <= file.bytes &&
           record.bytes <= file.bytes - record.offset;
}

class FileRecords final : public StoreRecords {
public:
    FileRecords(SealedReader file, StoreDirectory directory)
        : file_(std::move(file)), directory_(std::move(directory)) {
        const std::size_t roots = static_cast<std::size_t>(directory_.lattice.root_count_x) *
                                  static_cast<std::size_t>(directory_.lattice.root_count_y);
        range_ = directory_.chunks.front().heights;
        for (std::size_t i = 0; i < roots; ++i)
            range_ = joined(range_, directory_.chunks[i].heights);
    }

    const StoreWorld& world() const override { return directory_; }
    const std::string& place() const override { return file_.path(); }
    Result<RecordContent> chunk(const ChunkKey& key, const std::stop_token&) const override {
        return read(directory_.chunks[directory_.index_of(key)], max_encoded_bytes());
    }
    Result<std::vector<RecordContent>> squares(std::span<const SquareKey> keys,
                                               const std::stop_token&) const override {
        const SquareRange& range = directory_.raster->squares;
        std::vector<RecordContent> contents;
        for (const SquareKey& key : keys) {
            TERRANE_TRY(auto content,
                        read(directory_.squares[range.index_of(key)], max_square_bytes()));
            contents.push_back(std::move(content));
        }
        return contents;
    }
    HeightInterval heights(const ChunkKey& key) const override {
        return directory_.chunks[directory_.index_of(key)].heights;
    }

private:
    Result<RecordContent> read(const StoredRecord& record, std::size_t most_bytes) const {
        if (record.bytes > most_stored(most_bytes)) return std::nullopt;
        std::vector<std::uint8_t> stored(record.bytes);
        TERRANE_TRY(file_.read(record.offset, stored));
        return content_of(stored, record.hash, most_bytes);
    }

    SealedReader file_;
    StoreDirectory directory_;
};

class ShardRecords final : public StoreRecords {
public:
    ShardRecords(std::shared_ptr<const ShardFiles> files, Manifest manifest)
        : files_(std::move(files)), manifest_(std::move(manifest)), layout_(manifest_.world) {
        const Lattice& lattice = manifest_.world.lattice;
        const auto roots = static_cast<std::ptrdiff_t>(lattice.root_count_x) * lattice.root_count_y;
        range_ = manifest_.shards.front().heights;
        for (std::ptrdiff_t i = 0; i < roots; ++i) {
            range_ = joined(range_, manifest_.shards[static_cast<std::size_t>(i)].heights);
        }
    }

    const StoreWorld& world() const override { return manifest_.world; }
    const std::string& place() const override { return files_->place(); }
    Result<RecordContent> chunk(const ChunkKey& key, const std::stop_token& stop) const override {
        const std::int64_t shard = layout_.shard_of(key);
        TERRANE_TRY(const auto index, find_index(shard, stop));
        const Wanted wanted{shard, index->chunks[index->extent.index_of(key)]};
        TERRANE_TRY(auto contents, read({&wanted, 1}, max_encoded_bytes(), stop));
        return std::move(contents.front());
    }
    Result<std::vector<RecordContent>> squares(std::span<const SquareKey> keys,
                                               const std::stop_token& stop) const override {
        std::vector<Wanted> wanted;
        for (const SquareKey& key : keys) {
            const std::int64_t shard = layout_.shard_of(key);
            TERRANE_TRY(const auto index, find_index(shard, stop));
            wanted.push_back({shard, index->square(key)});
        }
        return read(wanted, max_square_bytes(), stop);
    }
    void expect(std::span<const Expected> expected) const override;
    HeightInterval heights(const ChunkKey& key) const override;
    bool is_slow() const override { return files_->is_slow(); }

private:
    /// An index, and where the squares are in it.
    struct Index : ShardIndex {
        explicit Index(ShardIndex index) : ShardIndex(std::move(index)), places(squares.size()) {
            std::size_t at = 0;
            for (const SquareKey& key : squares_of(extent))
                places[extent.squares.index_of(key)] = at++;
        }
        const StoredRecord& square(const SquareKey& key) const {
            return squares[places[extent.squares.index_of(key)]];
        }
        std::vector<std::size_t> places;  ///< [squares] row by row
    };
    struct Wanted {
        std::int64_t shard = 0;
        StoredRecord record;
    };
    struct Cached {
        std::shared_ptr<const Index> index;
        std::list<std::int64_t>::iterator place;
    };
    static constexpr std::size_t kMostIndices = 256;  ///< about 32 MB

    Result<std::vector<RecordContent>> read(std::span<const Wanted> wanted, std::size_t most_bytes,
                                            const std::stop_token& stop) const;
    /// The index of a shard, from the cache if it is there.
    Result<std::shared_ptr<const Index>> find_index(std::int64_t shard,
                                                    const std::stop_token& stop) const;
    /// Null if it is not in the cache.
    std::shared_ptr<const Index> cached_index(std::int64_t shard) const;

    std::shared_ptr<const ShardFiles> files_;
    Manifest manifest_;
    ShardLayout layout_;
    mutable std::mutex mutex_;                ///< guards the cache of indices
    mutable std::list<std::int64_t> recent_;  ///< most recent first
    mutable std::unordered_map<std::int64_t, Cached> indices_;
};

std::shared_ptr<const ShardRecords::Index> ShardRecords::cached_index(std::int64_t shard) const {
    const std::lock_guard lock(mutex_);
    const auto found = indices_.find(shard);
    if (found == indices_.end()) return nullptr;
    recent_.splice(recent_.begin(), recent_, found->second.place);
    return found->second.index;
}

Result<std::shared_ptr<const ShardRecords::Index>> ShardRecords::find_index(
    std::int64_t shard, const std::stop_token& stop) const {
    if (auto cached = cached_index(shard)) return cached;
    TERRANE_TRY(auto read, read_index(*files_, manifest_.shards[static_cast<std::size_t>(shard)],
                                      layout_.extent(shard), stop));
    auto index = std::make_shared<const Index>(std::move(read));
    const std::lock_guard lock(mutex_);
    if (!indices_.contains(shard)) {
        recent_.push_front(shard);
        indices_[shard] = {index, recent_.begin()};
        if (recent_.size() > kMostIndices) {
            indices_.erase(recent_.back());
            recent_.pop_back();
        }
    }
    return index;
}

Result<std::vector<RecordContent>> ShardRecords::read(std::span<const Wanted> wanted,
                                                      std::size_t most_bytes,
                                                      const std::stop_token& stop) const {
    std::vector<RecordContent> contents(wanted.size());
    std::vector<std::size_t> missing;  // indices of `wanted`
    for (std::size_t i = 0; i < wanted.size(); ++i) missing.push_back(i);
    // A cache may have damaged bytes: they are read once more.
    for (int attempt = 0; attempt < 2 && !missing.empty(); ++attempt) {
        std::vector<FileRange> ranges;
        std::vector<std::vector<std::uint8_t>> stored(missing.size());
        std::vector<std::size_t> read;  // likewise
        for (const std::size_t i : missing) {
            const ShardFile& file = manifest_.shards[static_cast<std::size_t>(wanted[i].shard)];
            const StoredRecord& record = wanted[i].record;
            if (!is_inside(record, file, most_bytes)) continue;
            std::vector<std::uint8_t>& bytes = stored[read.size()];
            bytes.resize(record.bytes);
            ranges.push_back({file.file_name(), file.bytes, record.offset, bytes});
            read.push_back(i);
        }
        TERRANE_TRY(files_->read(ranges, stop));
        missing.clear();
        for (std::size_t n = 0; n < read.size(); ++n) {
            RecordContent& content = contents[read[n]];
            content = content_of(stored[n], wanted[read[n]].record.hash, most_bytes);
            if (!content && files_->discard(ranges[n])) missing.push_back(read[n]);
        }
    }
    return contents;
}

void ShardRecords::expect(std::span<const Expected> expected) const {
    // Bytes that few records exceed. Root squares have bounds of coarser vertices too.
    constexpr std::uint64_t kLongRecord = 128 * 1024, kLongRoot = 160 * 1024;
    std::vector<ExpectedRange> ranges;
    std::set<std::int64_t> unknown;  // shards whose index is not read yet
    const auto add = [&](std::int64_t shard, const auto& record_in, std::size_t most_bytes,
                         bool is_later) {
        const ShardFile& file = manifest_.shards[static_cast<std::size_t>(shard)];
        if (const auto index = cached_index(shard)) {
            const StoredRecord& record = record_in(*index);
            if (!is_inside(record, file, most_bytes)) return;
            ranges.push_back({file.file_name(), file.bytes, record.offset, record.bytes, is_later});
        } else if (unknown.insert(shard).second) {
            ranges.push_back(
                {file.file_name(), file.bytes, file.bytes - file.index_bytes, file.index_bytes});
        }
    };
    const auto add_chunk = [&](const ChunkKey& key, bool is_later) {
        const std::int64_t shard = layout_.shard_of(key);
        const bool is_first = layout_.extent(shard).chunk_at(0) == key;
        if (is_first && cached_index(shard) == nullptr) {
            // Its record is the first of the file, and need not wait for the index, which has its size.
            const ShardFile& file = manifest_.shards[static_cast<std::size_t>(shard)];
            ranges.push_back({file.file_name(), file.bytes, 0,
                              std::min(key.level == 0 ? kLongRoot : kLongRecord, file.bytes),
                              is_later});
        }
        add(
            shard,
            [&](const Index& index) -> const StoredRecord& {
                return index.chunks[index.extent.index_of(key)];
            },
            max_encoded_bytes(), is_later);
    };
    for (const Expected& one : expected) {
        add_chunk(one.chunk, false);
        for (const SquareKey& key : one.squares) {
            add(
                layout_.shard_of(key),
                [&](const Index& index) -> const StoredRecord& { return index.square(key); },
                max_square_bytes(), false);
        }
    }
    // The children of a chunk are stored side by side, and most are needed within seconds of the first.
    for (const Expected& one : expected) {
        if (one.chunk.level == 0) continue;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            const ChunkKey sibling = one.chunk.parent().child(quadrant);
            if (sibling != one.chunk && layout_.shard_of(sibling) == layout_.shard_of(one.chunk))
                add_chunk(sibling, true);
        }
    }
    files_->expect(ranges);
}

HeightInterval ShardRecords::heights(const ChunkKey& key) const {
    const std::int64_t shard = layout_.shard_of(key);
    const ShardFile& file = manifest_.shards[static_cast<std::size_t>(shard)];
    std::shared_ptr<const Index> index = cached_index(shard);
    if (index == nullptr && !files_->is_slow()) {
        if (auto read = find_index(shard, {})) index = *read;
    }
    return index != nullptr ? index->chunks[index->extent.index_of(key)].heights : file.heights;
}

/// The files of a folder.
class FolderFiles final : public ShardFiles {
public:
    explicit FolderFiles(std::string folder) : folder_(std::move(folder)) {}

    const std::string& place() const override { return folder_; }
    Result<std::vector<std::uint8_t>> read_whole(const std::string& name,
                                                 std::size_t most_bytes) const override;
    Result<void> read(std::span<const FileRange> ranges,
                      const std::stop_token& stop) const override;

private:
    struct Cached {
        std::shared_ptr<const OpenFile> file;
        std::uint64_t used = 0;
    };
    static constexpr std::size_t kMostOpen = 64;

    std::string path_of(const std::string& name) const { return folder_ + "/" + name; }
    Result<std::shared_ptr<const OpenFile>> find(const std::string& name) const;

    std::string folder_;
    mutable std::mutex mutex_;  ///< guards the open files
    mutable std::unordered_map<std::string, Cached> files_;
    mutable std::uint64_t clock_ = 0;
};

Result<std::vector<std::uint8_t>> FolderFiles::read_whole(const std::string& name,
                                                          std::size_t most_bytes) const {
    TERRANE_TRY(const OpenFile file, OpenFile::open(path_of(name)));
    if (file.bytes() > most_bytes) {
        return fail(ErrorCode::bad_data, "\"" + file.path() + "\" has " +
                                             std::to_string(file.bytes()) + " bytes, at most " +
                                             std::to_string(most_bytes) + " are read");
    }
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(file.bytes()));
    TERRANE_TRY(file.read(0, bytes));
    return bytes;
}

Result<std::shared_ptr<const OpenFile>> FolderFiles::find(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    if (const auto found = files_.find(name); found != files_.end()) {
        found->second.used = ++clock_;
        return found->second.file;
    }
    TERRANE_TRY(auto opened, OpenFile::open(path_of(name)));
    auto file = std::make_shared<const OpenFile>(std::move(opened));
    if (files_.size() == kMostOpen) {
        files_.erase(std::ranges::min_element(files_, {},
                                              [](const auto& entry) { return entry.second.used; }));
    }
    files_[name] = {file, ++clock_};
    return file;
}

Result<void> FolderFiles::read(std::span<const FileRange> ranges,
                               const std::stop_token& stop) const {
    for (const FileRange& range : ranges) {
        if (stop.stop_requested()) return fail(ErrorCode::cancelled, "the chunk was given up");
        TERRANE_TRY(const auto file, find(range.name));
        if (file->bytes() != range.file_bytes) {
            return fail(ErrorCode::bad_data, "\"" + file->path() + "\" has " +
                                                 std::to_string(file->bytes()) + " bytes, not " +
                                                 std::to_string(range.file_bytes));
        }
        TERRANE_TRY(file->read(range.offset, range.bytes_out));
    }
    return {};
}

}  // namespace

Result<ShardIndex> read_index(const ShardFiles& files, const ShardFile& shard,
                              const ShardExtent& extent, const std::stop_token& stop) {
    const auto damaged = [&] {
        return fail(ErrorCode::bad_data,
                    "\"" + files.place() + "\": the index of " + shard.file_name() + " is damaged");
    };
    const std::size_t index_bytes = encoded_bytes(extent);
    if (shard.index_bytes > most_stored(index_bytes)) return damaged();
    for (int attempt = 0;; ++attempt) {
        std::vector<std::uint8_t> stored(shard.index_bytes);
        const FileRange range{shard.file_name(), shard.bytes, shard.bytes - shard.index_bytes,
                              stored};
        TERRANE_TRY(files.read({&range, 1}, stop));
        std::vector<std::uint8_t> bytes(index_bytes);
        if (const auto size = decompress(stored, bytes); size && *size == bytes.size()) {
            auto index = decode_shard(bytes, extent);
            if (index && name_of(*index) == shard.name) return index;
        }
        if (attempt > 0 || !files.discard(range)) return damaged();
    }
}

Result<bool> is_whole_record(const ShardFiles& files, const ShardFile& shard,
                             const StoredRecord& record, std::size_t most_bytes) {
    if (!is_inside(record, shard, most_bytes)) return false;
    std::vector<std::uint8_t> stored(record.bytes);
    const FileRange range{shard.file_name(), shard.bytes, record.offset, stored};
    TERRANE_TRY(files.read({&range, 1}, {}));
    return content_of(stored, record.hash, most_bytes).has_value();
}

Result<std::unique_ptr<const StoreRecords>> open_file(const std::string& path,
                                                      StoreInfo* info_out) {
    TERRANE_TRY(auto file, SealedReader::open(path, kStoreKind));
    auto directory = decode_directory(file.directory());
    if (!directory) {
        return fail(directory.error().code, "\"" + path + "\": " + directory.error().message);
    }
    file.drop_directory();
    if (info_out != nullptr) {
        *info_out = {static_cast<std::int64_t>(directory->chunks.size()), file.bytes(),
                     directory->max_error_m, sha_of(*directory), directory->note};
    }
    return std::make_unique<const FileRecords>(std::move(file), std::move(*directory));
}

Result<std::unique_ptr<const StoreRecords>> open_shards(std::shared_ptr<const ShardFiles> files,
                                                        StoreInfo* info_out) {
    TERRANE_TRY(const auto bytes,
                files->read_whole(std::string(kManifestName), kMostManifestBytes));
    auto manifest = decode_manifest(
        std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), false);
    if (!manifest) {
        return fail(manifest.error().code, "\"" + files->place() +
                                               "\": " + std::string(kManifestName) + " " +
                                               manifest.error().message);
    }
    if (info_out != nullptr) *info_out = info_of(*manifest);
    return std::make_unique<const ShardRecords>(std::move(files), std::move(*manifest));
}

}  // namespace terrane::internal

namespace terrane {

Result<std::shared_ptr<const ShardFiles>> open_shard_folder(const std::string& folder) {
    struct stat status {};
    if (stat(folder.c_str(), &status) != 0) {
        return fail(ErrorCode::io, "cannot open \"" + folder + "\": " + std::strerror(errno));
    }
    if (!S_ISDIR(status.st_mode)) {
        return fail(ErrorCode::io, "cannot open \"" + folder + "\": it is no folder");
    }
    return std::make_shared<const internal::FolderFiles>(folder);
}

}  // namespace terrane
