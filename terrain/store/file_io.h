// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace terrane::internal {

/// A regular file that is open for reading. Threads: any number at once.
class OpenFile {
public:
    /// Fails: io
    static Result<OpenFile> open(const std::string& path);
    OpenFile(OpenFile&& other) noexcept
        : path_(std::move(other.path_)),
          handle_(std::exchange(other.handle_, -1)),
          bytes_(other.bytes_) {}
    OpenFile& operator=(OpenFile&&) = delete;
    ~OpenFile();

    const std::string& path() const { return path_; }
    std::uint64_t bytes() const { return bytes_; }
    /// Reads part of the file. Fails: io; bad_data if the part is not inside the file
    Result<void> read(std::uint64_t offset, std::span<std::uint8_t> bytes_out) const;

private:
    OpenFile(std::string path, int handle, std::uint64_t bytes)
        : path_(std::move(path)), handle_(handle), bytes_(bytes) {}

    std::string path_;
    int handle_ = -1;
    std::uint64_t bytes_ = 0;
};

/// A file that is written under a unique name in its folder, and appears under its own name when it is committed.
class NewFile {
public:
    /// Fails: io
    static Result<NewFile> create(const std::string& path);
    NewFile(NewFile&& other) noexcept
        : path_(std::move(other.path_)),
          written_path_(std::move(other.written_path_)),
          handle_(std::exchange(other.handle_, -1)) {}
    NewFile& operator=(NewFile&&) = delete;
    /// Removes the file if it was not committed.
    ~NewFile();

    /// Path of the incomplete file.
    const std::string& written_path() const { return written_path_; }
    /// Sets the path under which commit() leaves the file; it must be in the same folder.
    void set_path(std::string path) { path_ = std::move(path); }
    /// Fails: io
    Result<void> write(std::uint64_t offset, std::span<const std::uint8_t> bytes);
    /// Flushes the file to the disk and renames it; call once, last.
    /// Fails: io; the new file is then removed, and a previous one remains
    Result<void> commit();

private:
    NewFile(std::string path, std::string written_path, int handle)
        : path_(std::move(path)), written_path_(std::move(written_path)), handle_(handle) {}
    std::string cannot_write(int cause) const;

    std::string path_, written_path_;
    int handle_ = -1;
};

/// Writes a small file at once. Fails: as NewFile
Result<void> write_text(const std::string& path, std::string_view text);

/// A path in messages.
inline std::string in_quotes(const std::string& path) { return "\"" + path + "\""; }

}  // namespace terrane::internal
