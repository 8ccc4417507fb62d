// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <cstdio>
#include <string>
#include <string_view>

namespace terrane::tools {

/// A file that appears under its name only when it is whole: written beside it, then renamed. A
/// pipe or a device (/dev/stdout) is written directly. What was not committed is removed.
class OutputFile {
public:
    /// Fails with io where the file cannot be made.
    static Result<OutputFile> create(const std::string& path);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    /// Appends. A failure, as of a full disk, is kept and reported by commit().
    void write(std::string_view bytes);
    /// Whether a write has failed: long commands stop early.
    bool has_failed() const { return failed_errno_ != 0; }

    /// Makes the file appear. Fails with io, naming the path and the cause; call once.
    Result<void> commit();

private:
    OutputFile(std::string path, std::string written_path, std::FILE* file);

    std::string path_;
    std::string written_path_;  ///< the same as path_ for pipes and devices
    std::FILE* file_ = nullptr;
    int failed_errno_ = 0;
};

}  // namespace terrane::tools
