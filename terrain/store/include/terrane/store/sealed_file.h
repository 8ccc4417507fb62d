// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane {

namespace internal {
class NewFile;
class OpenFile;
}  // namespace internal

/// A 128-bit hash (XXH3), for identifying content and detecting damage; not cryptographic.
struct ContentHash {
    std::uint64_t low = 0, high = 0;  ///< halves of the hash
    friend bool operator==(const ContentHash&, const ContentHash&) = default;
    /// 32 hexadecimal digits.
    std::string text() const;
};

/// Computes the hash of bytes that are added piece by piece.
class ContentHasher {
public:
    ContentHasher();
    ~ContentHasher();
    ContentHasher(ContentHasher&&) noexcept;
    ContentHasher& operator=(ContentHasher&&) noexcept;

    /// Appends bytes to the hashed content.
    void add(std::span<const std::uint8_t> bytes);
    /// The same for any memory.
    void add_raw(const void* bytes, std::size_t count);
    /// The hash of all bytes so far.
    ContentHash value() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// The type of a sealed file: four characters, and a version that changes with the meaning of the file's bytes.
struct SealedKind {
    std::array<char, 4> name{};  ///< first bytes of the file
    std::uint32_t version = 0;   ///< version of the format
    friend bool operator==(const SealedKind&, const SealedKind&) = default;
};

/// Writes a file atomically: under a unique name in the same folder, flushed to the disk, then renamed. If several
/// programs write the same file at once, the last one wins; readers see one complete file or the other.
///
/// The file consists of a header of 72 bytes, *records* of any bytes, and a compressed *directory* (zstd) at the end.
/// Header and directory have checksums. Records have none, unless the caller stores them in the directory.
class SealedWriter {
public:
    /// Fails: io
    static Result<SealedWriter> create(const std::string& path, const SealedKind& kind);
    SealedWriter(SealedWriter&&) noexcept;
    SealedWriter& operator=(SealedWriter&&) = delete;
    /// Removes the file if it was not committed.
    ~SealedWriter();

    /// Appends a record, and returns its offset. Small records are written together.
    /// Fails: io, also for records of earlier calls
    Result<std::uint64_t> append(std::span<const std::uint8_t> record);
    /// Appends the directory and renames the file; call once, last.
    /// Fails: io; the new file is then removed, and a previous one remains
    Result<void> commit(std::span<const std::uint8_t> directory);
    /// Sets the path under which commit() will leave the file; it must be in the same folder.
    void set_path(std::string path);
    /// Bytes appended so far; size of the whole file after commit().
    std::uint64_t bytes() const { return end_; }
    /// Path of the incomplete file, until commit().
    const std::string& written_path() const;

private:
    SealedWriter(std::unique_ptr<internal::NewFile> file, const SealedKind& kind);
    Result<void> flush();

    std::unique_ptr<internal::NewFile> file_;
    SealedKind kind_;
    std::uint64_t end_ = 0;
    std::vector<std::uint8_t> pending_;  // the last bytes, which are not written yet
};

/// Reads a sealed file. Threads: any number at once.
class SealedReader {
public:
    /// Opens a file; reads and checks its header and directory.
    ///
    /// Fails: io if it cannot be opened or read; bad_data if it is not a sealed file, has another kind or version, or
    ///        is truncated or damaged
    static Result<SealedReader> open(const std::string& path, const SealedKind& kind);
    /// Whether a file starts like a sealed file of a kind, of any version. False if it cannot be read.
    static bool is_kind(const std::string& path, std::string_view name);
    SealedReader(SealedReader&& other) noexcept;
    SealedReader& operator=(SealedReader&&) = delete;
    ~SealedReader();

    /// Path of the open file.
    const std::string& path() const;
    /// Size of the open file.
    std::uint64_t bytes() const;
    /// The directory of the open file, as given to SealedWriter::commit(); empty after drop_directory().
    std::span<const std::uint8_t> directory() const { return directory_; }
    /// Frees the memory of the directory.
    void drop_directory() { directory_ = {}; }

    /// Reads part of the file.
    /// Fails: io; bad_data if the part is not inside the file
    Result<void> read(std::uint64_t offset, std::span<std::uint8_t> bytes_out) const;

private:
    explicit SealedReader(std::unique_ptr<const internal::OpenFile> file);
    Result<void> read_directory(const SealedKind& kind);

    std::unique_ptr<const internal::OpenFile> file_;
    std::vector<std::uint8_t> directory_;
};

/// Compresses bytes; deterministic for one version of zstd. Each thread keeps its working memory for the next call.
///
/// @param level of zstd: -1 takes less time than 3 and makes larger records
std::vector<std::uint8_t> compress(std::span<const std::uint8_t> content, int level = 3);
/// Decompresses a record into content_out, and returns the number of bytes.
/// Fails: bad_data if content_out is too small, or the record is damaged
Result<std::size_t> decompress(std::span<const std::uint8_t> record,
                               std::span<std::uint8_t> content_out);
ContentHash hash_of(std::span<const std::uint8_t> bytes);  ///< hash of the bytes: ContentHash

/// The hash of all bytes of a file. Fails: io, also for a folder, a pipe or a device
Result<ContentHash> hash_of_file(const std::string& path);

}  // namespace terrane
