// SPDX-License-Identifier: MIT
#include "edit/edit_files.h"

#include "level_set/shapes.h"

#include <terrane/base/text.h>
#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <new>
#include <utility>

namespace terrane::internal {
namespace {

constexpr std::array<char, 8> kMagic{'T', 'R', 'N', 'D', 'I', 'G', 'S', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 36, kFrameBytes = 12;
// Largest change number that is accepted from a file, which is not trusted; later changes get larger numbers.
constexpr std::uint32_t kMostNumber = 0x7fffffff;

std::vector<std::uint8_t> header_of(const std::array<std::uint64_t, 2>& fingerprint,
                                    std::uint32_t version = kVersion) {
    ByteWriter out;
    out.put_each(std::span<const char>(kMagic));
    out.put(version);
    out.put_each(std::span<const std::uint64_t>(fingerprint));
    out.put(hash_of(out.bytes()).low);
    return out.bytes();
}

std::uint64_t chained(std::uint64_t before, std::span<const std::uint8_t> content) {
    ContentHasher hasher;
    ByteWriter first;
    first.put(before);
    hasher.add(first.bytes());
    hasher.add(content);
    return hasher.value().low;
}

std::vector<std::uint8_t> record_bytes(const LogRecord& record) {
    ByteWriter out;
    out.put(record.number);
    out.put(std::uint8_t{record.operation ? std::uint8_t{0} : std::uint8_t{1}});
    if (record.operation) {
        put(out, *record.operation);
    } else {
        out.put(record.undone);
    }
    return out.bytes();
}

std::optional<LogRecord> record_of(std::span<const std::uint8_t> content) {
    ByteReader in(content);
    LogRecord record;
    record.number = in.get<std::uint32_t>();
    const auto kind = in.get<std::uint8_t>();
    if (kind == 0) {
        record.operation = get_operation(in);
        if (!record.operation) return std::nullopt;
    } else {
        record.undone = in.get<std::uint32_t>();
    }
    if (kind > 1 || !in.is_done()) return std::nullopt;
    return record;
}

/// Whether a complete record starts at `at` whose hash continues the chain from `before`.
bool is_record(std::span<const std::uint8_t> bytes, std::size_t at, std::uint64_t before) {
    if (at + kFrameBytes > bytes.size()) return false;
    const auto length = ByteReader(bytes.subspan(at)).get<std::uint32_t>();
    if (length > bytes.size() - at - kFrameBytes) return false;
    return chained(before, bytes.subspan(at + 4, length)) ==
           ByteReader(bytes.subspan(at + 4 + length)).get<std::uint64_t>();
}

/// Whether a record that continues the chain starts after `at`: then the bytes at `at` are damaged, not torn.
bool has_later_record(std::span<const std::uint8_t> bytes, std::size_t at) {
    for (std::size_t next = at + 8; next + kFrameBytes <= bytes.size(); ++next) {
        if (is_record(bytes, next, ByteReader(bytes.subspan(next - 8)).get<std::uint64_t>()))
            return true;
    }
    return false;
}

}  // namespace

DigLog::DigLog(std::string path, const std::array<std::uint64_t, 2>& fingerprint)
    : path_(std::move(path)), header_(header_of(fingerprint)) {}

Result<DigLog> DigLog::open(std::string path, const std::array<std::uint64_t, 2>& fingerprint) {
    DigLog log(std::move(path), fingerprint);
    struct stat status {};
    if (stat(log.path_.c_str(), &status) != 0) {
        if (errno == ENOENT) return log;
        return fail(ErrorCode::io, "cannot open \"" + log.path_ + "\": " + std::strerror(errno));
    }
    std::ifstream in;
    if (S_ISREG(status.st_mode)) in.open(log.path_, std::ios::binary);
    if (!in.is_open()) return fail(ErrorCode::io, "cannot open \"" + log.path_ + "\"");
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)),
                                          std::istreambuf_iterator<char>());
    if (in.bad()) return fail(ErrorCode::io, "cannot read \"" + log.path_ + "\"");
    TERRANE_TRY(log.parse(bytes));
    return log;
}

Result<void> DigLog::parse(std::span<const std::uint8_t> bytes) {
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, "\"" + path_ + "\" " + what);
    };
    if (bytes.size() < kHeaderBytes || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
        return bad("is no log of digs");
    ByteReader in(bytes.subspan(kMagic.size()));
    const auto version = in.get<std::uint32_t>();
    std::array<std::uint64_t, 2> fingerprint{};
    in.get_each(std::span<std::uint64_t>(fingerprint));
    if (!std::ranges::equal(header_of(fingerprint, version), bytes.first(kHeaderBytes)))
        return bad("has a damaged header");
    if (version != kVersion) {
        return bad("is of version " + number_text(version) + ", this program reads " +
                   number_text(kVersion));
    }
    if (!std::ranges::equal(header_, bytes.first(kHeaderBytes)))
        return bad("is of other volumes or another lattice");
    std::size_t at = kHeaderBytes;
    while (at < bytes.size()) {
        const std::uint64_t before = hashes_.empty() ? 0 : hashes_.back();
        const std::size_t left = bytes.size() - at;
        const auto length = ByteReader(bytes.subspan(at)).get<std::uint32_t>();
        if (!is_record(bytes, at, before)) {
            // A later record may continue the chain from the hash that this record should have.
            const bool is_whole = left >= kFrameBytes && length <= left - kFrameBytes;
            if (has_later_record(bytes, at) ||
                (is_whole && is_record(bytes, at + kFrameBytes + length,
                                       chained(before, bytes.subspan(at + 4, length)))))
                return bad("is damaged at byte " + number_text(at));
            break;
        }
        const auto content = bytes.subspan(at + 4, length);
        auto record = record_of(content);
        if (!record || record->number > kMostNumber ||
            record->number <= (records_.empty() ? 0 : records_.back().number))
            return bad("has an impossible record at byte " + number_text(at));
        records_.push_back(std::move(*record));
        hashes_.push_back(chained(before, content));
        at += kFrameBytes + length;
    }
    saved_bytes_ = at;
    file_bytes_ = bytes.size();
    torn_bytes_ = file_bytes_ - saved_bytes_;
    return {};
}

std::uint64_t DigLog::add(LogRecord record) {
    const std::vector<std::uint8_t> content = record_bytes(record);
    const std::uint64_t hash = chained(hashes_.empty() ? 0 : hashes_.back(), content);
    ByteWriter framed;
    framed.put(static_cast<std::uint32_t>(content.size()));
    framed.put_each(std::span<const std::uint8_t>(content));
    framed.put(hash);
    unsaved_.insert(unsaved_.end(), framed.bytes().begin(), framed.bytes().end());
    records_.push_back(std::move(record));
    hashes_.push_back(hash);
    return hash;
}

Result<void> DigLog::save() {
    if (unsaved_.empty() && saved_bytes_ > 0) return {};
    const auto failed = [&](int cause) {
        return fail(ErrorCode::io, "cannot write \"" + path_ + "\": " + std::strerror(cause));
    };
    const int handle = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (handle < 0) return failed(errno);
    struct stat status {};
    if (fstat(handle, &status) != 0 || static_cast<std::uint64_t>(status.st_size) != file_bytes_) {
        close(handle);
        return fail(ErrorCode::io,
                    "cannot write \"" + path_ + "\": another program has changed it");
    }
    std::vector<std::uint8_t> bytes = saved_bytes_ == 0 ? header_ : std::vector<std::uint8_t>();
    bytes.insert(bytes.end(), unsaved_.begin(), unsaved_.end());
    int cause = 0;
    for (std::size_t done = 0; done < bytes.size() && cause == 0;) {
        const ssize_t count = pwrite(handle, bytes.data() + done, bytes.size() - done,
                                     static_cast<off_t>(saved_bytes_ + done));
        if (count > 0) {
            done += static_cast<std::size_t>(count);
        } else if (count == 0 || errno != EINTR) {
            cause = count == 0 ? ENOSPC : errno;
        }
    }
    const std::uint64_t end = saved_bytes_ + bytes.size();
    if (cause == 0 && ftruncate(handle, static_cast<off_t>(end)) != 0) cause = errno;
    if (cause == 0 && fsync(handle) != 0) cause = errno;
    if (cause != 0) {
        // Restores the previous end. If this fails too, the rest is a torn record, which open() drops.
        const bool is_restored = ftruncate(handle, static_cast<off_t>(saved_bytes_)) == 0;
        file_bytes_ = is_restored || fstat(handle, &status) != 0
                          ? saved_bytes_
                          : static_cast<std::uint64_t>(status.st_size);
        close(handle);
        if (saved_bytes_ == 0 && is_restored) unlink(path_.c_str());
        return failed(cause);
    }
    close(handle);
    if (saved_bytes_ == 0) {  // a new file: flush its folder entry too
        const std::size_t slash = path_.rfind('/');
        const std::string folder = slash == std::string::npos ? "." : path_.substr(0, slash + 1);
        if (const int at = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); at >= 0) {
            fsync(at);
            close(at);
        }
    }
    saved_bytes_ = file_bytes_ = end;
    unsaved_.clear();
    return {};
}

namespace {

constexpr SealedKind kKind{{'T', 'D', 'I', 'G'}, 1};
/// Largest size of a tile's record that is allocated, bytes: sizes in a file are not trusted.
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

/// Reads the content of a tile's record and checks its hash.
Result<std::vector<std::uint8_t>> read_tile(const SealedReader& file, const TileRecord& tile) {
    const auto damaged = [&] {
        return fail(ErrorCode::bad_data, "\"" + file.path() + "\" has a damaged tile");
    };
    if (tile.stored_bytes > file.bytes()) return damaged();
    std::vector<std::uint8_t> stored(static_cast<std::size_t>(tile.stored_bytes));
    TERRANE_TRY(file.read(tile.offset, stored));
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
    TERRANE_TRY(auto file, SealedReader::open(path, kKind));
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, "\"" + path + "\" " + what);
    };
    const auto directory = directory_of(file.directory());
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
        TERRANE_TRY(const auto content, read_tile(file, record));
        auto tile =
            VolumeTile::decode(volumes_, tile_of(chunk.key, i), tile_heights(chunk, i), content);
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
    TERRANE_TRY(auto file, SealedWriter::create(path_of(key), kKind));
    Directory directory{volumes_.fingerprint(), {}, key, position, *hash, {}};
    ContentHasher heights;
    for (int i = 0; i < kChunkTiles; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (!tiles[at]) continue;
        const std::vector<std::uint8_t> content = tiles[at]->level_set.encoded();
        const std::vector<std::uint8_t> stored = compress(content);
        TERRANE_TRY(const auto offset, file.append(stored));
        directory.tiles[at] = {offset, stored.size(), content.size(), pair_of(hash_of(content))};
        add(heights, tiles[at]->level_set.heights());
    }
    directory.heights = pair_of(heights.value());
    TERRANE_TRY(file.commit(directory_bytes(directory)));
    const std::scoped_lock lock(mutex_);
    ++counts_.written;
    return {};
}

}  // namespace terrane::internal
