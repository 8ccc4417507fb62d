// SPDX-License-Identifier: MIT
#include "file_io.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#define XXH_INLINE_ALL  // NOLINT(readability-identifier-naming): a name of xxHash
#include <xxhash.h>
#include <zstd.h>

#include <cstdio>
#include <new>
#include <string>
#include <vector>

namespace terrane {

using namespace internal;

std::string ContentHash::text() const {
    char digits[33];
    std::snprintf(digits, sizeof(digits), "%016llx%016llx", static_cast<unsigned long long>(high),
                  static_cast<unsigned long long>(low));
    return digits;
}

struct ContentHasher::State {
    XXH3_state_t state;
};

ContentHasher::ContentHasher() : state_(std::make_unique<State>()) {
    XXH3_128bits_reset(&state_->state);
}
ContentHasher::~ContentHasher() = default;
ContentHasher::ContentHasher(ContentHasher&&) noexcept = default;
ContentHasher& ContentHasher::operator=(ContentHasher&&) noexcept = default;

void ContentHasher::add(std::span<const std::uint8_t> bytes) {
    add_raw(bytes.data(), bytes.size());
}

void ContentHasher::add_raw(const void* bytes, std::size_t count) {
    if (count > 0) XXH3_128bits_update(&state_->state, bytes, count);
}

ContentHash ContentHasher::value() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->state);
    return {hash.low64, hash.high64};
}

ContentHash hash_of(std::span<const std::uint8_t> bytes) {
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    return {hash.low64, hash.high64};
}

Result<ContentHash> hash_of_file(const std::string& path) {
    TERRANE_TRY(const auto file, OpenFile::open(path));
    constexpr std::uint64_t kPiece = 1 << 20;
    ContentHasher hasher;
    std::vector<std::uint8_t> bytes;
    for (std::uint64_t at = 0; at < file.bytes(); at += bytes.size()) {
        bytes.resize(std::min(kPiece, file.bytes() - at));
        TERRANE_TRY(file.read(at, bytes));
        hasher.add(bytes);
    }
    return hasher.value();
}

namespace {

struct FreeContext {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};

}  // namespace

std::vector<std::uint8_t> compress(std::span<const std::uint8_t> content, int level) {
    // a third of the time of a small record would go into a new context
    thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
    if (!context) throw std::bad_alloc();
    std::vector<std::uint8_t> record(ZSTD_compressBound(content.size()));
    // The record has space for the worst case, so compression fails only if it runs out of memory.
    const std::size_t size = ZSTD_compressCCtx(context.get(), record.data(), record.size(),
                                               content.data(), content.size(), level);
    if (ZSTD_isError(size) != 0) throw std::bad_alloc();
    record.resize(size);
    return record;
}

Result<std::size_t> decompress(std::span<const std::uint8_t> record,
                               std::span<std::uint8_t> content_out) {
    const std::size_t size =
        ZSTD_decompress(content_out.data(), content_out.size(), record.data(), record.size());
    if (ZSTD_isError(size) != 0) {
        return fail(ErrorCode::bad_data,
                    std::string("damaged compressed data: ") + ZSTD_getErrorName(size));
    }
    return size;
}

namespace {

// First bytes of a file: not valid text in any encoding, and visibly damaged by a conversion of line endings.
constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'T', 'R', 'N', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kHeaderBytes = 72;
/// Largest accepted directory: sizes in a file are not trusted for allocations.
constexpr std::uint64_t kLongestDirectory = std::uint64_t{1} << 33;

struct Header {
    SealedKind kind;
    std::uint64_t offset = 0, stored_bytes = 0, content_bytes = 0;  ///< of the directory
    ContentHash hash;                                               ///< of its content
};

std::vector<std::uint8_t> encode(const Header& header) {
    ByteWriter out;
    out.put_each(std::span<const std::uint8_t>(kMagic));
    out.put_each(std::span<const char>(header.kind.name));
    out.put(header.kind.version);
    out.put(header.offset);
    out.put(header.stored_bytes);
    out.put(header.content_bytes);
    out.put(header.hash.low);
    out.put(header.hash.high);
    out.put(std::uint64_t{0});
    out.put(hash_of(out.bytes()).low);
    return out.bytes();
}

}  // namespace

SealedWriter::SealedWriter(std::unique_ptr<NewFile> file, const SealedKind& kind)
    : file_(std::move(file)), kind_(kind) {}
SealedWriter::SealedWriter(SealedWriter&&) noexcept = default;
SealedWriter::~SealedWriter() = default;

Result<SealedWriter> SealedWriter::create(const std::string& path, const SealedKind& kind) {
    TERRANE_TRY(auto file, NewFile::create(path));
    SealedWriter writer(std::make_unique<NewFile>(std::move(file)), kind);
    const std::vector<std::uint8_t> blank(kHeaderBytes, 0);  // the header is written last
    TERRANE_TRY(writer.append(blank));
    return writer;
}

void SealedWriter::set_path(std::string path) { file_->set_path(std::move(path)); }
const std::string& SealedWriter::written_path() const { return file_->written_path(); }

Result<void> SealedWriter::flush() {
    TERRANE_TRY(file_->write(end_ - pending_.size(), pending_));
    pending_.clear();
    return {};
}

Result<std::uint64_t> SealedWriter::append(std::span<const std::uint8_t> record) {
    constexpr std::size_t kMostPending = std::size_t{1} << 16;
    const std::uint64_t offset = end_;
    if (pending_.size() + record.size() > kMostPending) TERRANE_TRY(flush());
    if (record.size() > kMostPending) {
        TERRANE_TRY(file_->write(offset, record));
    } else {
        pending_.insert(pending_.end(), record.begin(), record.end());
    }
    end_ += record.size();
    return offset;
}

Result<void> SealedWriter::commit(std::span<const std::uint8_t> directory) {
    const std::vector<std::uint8_t> stored = compress(directory);
    TERRANE_TRY(const auto offset, append(stored));
    TERRANE_TRY(flush());
    const Header header{kind_, offset, stored.size(), directory.size(), hash_of(directory)};
    TERRANE_TRY(file_->write(0, encode(header)));
    return file_->commit();
}

Result<SealedReader> SealedReader::open(const std::string& path, const SealedKind& kind) {
    TERRANE_TRY(auto file, OpenFile::open(path));
    SealedReader reader(std::make_unique<const OpenFile>(std::move(file)));
    TERRANE_TRY(reader.read_directory(kind));
    return reader;
}

SealedReader::SealedReader(std::unique_ptr<const OpenFile> file) : file_(std::move(file)) {}
SealedReader::SealedReader(SealedReader&&) noexcept = default;
SealedReader::~SealedReader() = default;

const std::string& SealedReader::path() const { return file_->path(); }
std::uint64_t SealedReader::bytes() const { return file_->bytes(); }

bool SealedReader::is_kind(const std::string& path, std::string_view name) {
    const int handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (handle < 0) return false;
    std::array<std::uint8_t, kMagic.size() + 4> begin{};
    const ssize_t count = pread(handle, begin.data(), begin.size(), 0);
    close(handle);
    return count == static_cast<ssize_t>(begin.size()) &&
           std::equal(kMagic.begin(), kMagic.end(), begin.begin()) &&
           std::equal(name.begin(), name.end(), begin.begin() + kMagic.size(), begin.end());
}

Result<void> SealedReader::read_directory(const SealedKind& kind) {
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, in_quotes(path()) + " " + what);
    };
    const std::string name(kind.name.data(), kind.name.size());
    if (bytes() < kHeaderBytes) return bad("is no whole \"" + name + "\" file: it is cut off");
    std::vector<std::uint8_t> begin(kHeaderBytes);
    TERRANE_TRY(read(0, begin));
    ByteReader in(std::span<const std::uint8_t>(begin).subspan(kMagic.size()));
    Header header;
    in.get_each(std::span<char>(header.kind.name));
    header.kind.version = in.get<std::uint32_t>();
    header.offset = in.get<std::uint64_t>();
    header.stored_bytes = in.get<std::uint64_t>();
    header.content_bytes = in.get<std::uint64_t>();
    header.hash.low = in.get<std::uint64_t>();
    header.hash.high = in.get<std::uint64_t>();
    if (!std::equal(kMagic.begin(), kMagic.end(), begin.begin()) || header.kind.name != kind.name) {
        return bad("is no \"" + name + "\" file");
    }
    if (encode(header) != begin) return bad("has a damaged header");
    if (header.kind.version != kind.version) {
        return bad("is of version " + std::to_string(header.kind.version) +
                   ", this program reads " + std::to_string(kind.version) +
                   "; it must be written again");
    }
    if (header.offset > bytes() || header.stored_bytes > bytes() - header.offset) {
        return bad("is cut off after " + std::to_string(bytes()) + " bytes");
    }
    if (header.content_bytes > kLongestDirectory) {
        return bad("has a directory of " + std::to_string(header.content_bytes) + " bytes");
    }
    std::vector<std::uint8_t> stored(static_cast<std::size_t>(header.stored_bytes));
    TERRANE_TRY(read(header.offset, stored));
    directory_.resize(static_cast<std::size_t>(header.content_bytes));
    const Result<std::size_t> size = decompress(stored, directory_);
    if (!size || *size != directory_.size() || hash_of(directory_) != header.hash) {
        return bad("has a damaged directory");
    }
    return {};
}

Result<void> SealedReader::read(std::uint64_t offset, std::span<std::uint8_t> bytes_out) const {
    return file_->read(offset, bytes_out);
}

}  // namespace terrane
