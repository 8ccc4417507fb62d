// SPDX-License-Identifier: MIT
#pragma once

#include "output/interrupt.h"

#include <terrane/terrain/result.h>

#include <cstdio>
#include <memory>
#include <string>

namespace terrane::tools {

/// A new file beside another one, for incomplete content. It never takes the name of an existing file: PATH.partial,
/// PATH.partial1 and so on. The destructor removes it unless it was renamed.
class TemporaryFile {
public:
    /// Fails with io, naming `path`, where no file can be created beside it.
    static Result<TemporaryFile> beside(const std::string& path);

    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;
    ~TemporaryFile();

    const std::string& path() const { return path_; }
    /// The file, open for writing from its beginning.
    std::FILE* stream() const { return stream_; }
    /// Closes the stream.
    /// @return 0, or the errno of a failed flush, as of a full disk
    int close();

    /// Closes the stream and renames the file. Call once.
    ///
    /// @param replaces whether an existing file is replaced; otherwise the call returns EEXIST for it
    /// @return 0, or an errno: then the destructor removes the file
    int rename_to(const std::string& path, bool replaces);

private:
    TemporaryFile(std::string path, std::FILE* stream);

    std::string path_;  // "" after the rename
    std::FILE* stream_ = nullptr;
    std::unique_ptr<RemovedIfKilled> if_killed_;
};

}  // namespace terrane::tools
