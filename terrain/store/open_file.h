// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstdint>
#include <span>
#include <string>
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

}  // namespace terrane::internal
