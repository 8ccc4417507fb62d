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

/// A file that appears under its name only when it is complete: written to a temporary file beside it, then renamed. A
/// pipe or a device (/dev/stdout) is written directly. Without commit() the temporary file is removed.
class OutputFile {
public:
    /// @param place a path named by the user, whose file is replaced; or a name in an output folder, to whose list
    ///              commit() adds it
    ///
    /// Fails with io where the file cannot be created.
    static Result<OutputFile> create(const OutputPlace& place);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&&) = delete;
    ~OutputFile();

    /// Appends. An error, as of a full disk, is stored and reported by check() and commit().
    void write(std::string_view bytes);
    /// Whether a write has failed; lets long commands stop early.
    bool has_failed() const { return failed_errno_ != 0; }
    /// Fails with io, naming the path and the cause, where a write has failed.
    Result<void> check() const;

    /// Completes the file and gives it its name. Fails with io, naming the path and the cause. Call once.
    Result<void> commit();

private:
    OutputFile(OutputPlace place, std::optional<TemporaryFile> temporary, std::FILE* direct);
    std::FILE* stream() const { return direct_ != nullptr ? direct_ : temporary_->stream(); }

    OutputPlace place_;
    std::optional<TemporaryFile> temporary_;
    std::FILE* direct_ = nullptr;  ///< stream of a pipe or a device
    int failed_errno_ = 0;
};

}  // namespace terrane::tools
