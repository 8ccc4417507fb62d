// SPDX-License-Identifier: MIT
#pragma once

#include "output/output_folder.h"
#include "output/temporary_file.h"

#include <terrane/terrain/result.h>

#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

namespace terrane::tools {

/// A file that appears under its name only when it is whole: written beside it, then renamed. A
/// pipe or a device (/dev/stdout) is written directly. What was not committed is removed.
class OutputFile {
public:
    /// @param place a path that the user named, whose file is replaced; or a name in a run's folder, whose list then
    ///              holds the file
    ///
    /// Fails with io where the file cannot be made.
    static Result<OutputFile> create(const OutputPlace& place);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    /// Appends. A failure, as of a full disk, is kept and reported by check() and commit().
    void write(std::string_view bytes);
    /// Whether a write has failed: long commands stop early.
    bool has_failed() const { return failed_errno_ != 0; }
    /// Fails with io, naming the path and the cause, where a write has failed.
    Result<void> check() const;

    /// Makes the file appear. Fails with io, naming the path and the cause; call once.
    Result<void> commit();

private:
    OutputFile(OutputPlace place, std::optional<TemporaryFile> temporary, std::FILE* direct);
    std::FILE* stream() const { return direct_ != nullptr ? direct_ : temporary_->stream(); }

    OutputPlace place_;
    std::optional<TemporaryFile> temporary_;
    std::FILE* direct_ = nullptr;  ///< of a pipe or a device
    int failed_errno_ = 0;
};

}  // namespace terrane::tools
