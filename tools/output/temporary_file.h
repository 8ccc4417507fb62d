// SPDX-License-Identifier: MIT
#pragma once

#include "output/interrupt.h"

#include <terrane/terrain/result.h>

#include <cstdio>
#include <memory>
#include <string>

namespace terrane::tools {

/// A new file beside another one, for content that is not whole yet. It never takes the name of a file that is
/// there: PATH.partial, PATH.partial1 and so on. Removed when the object goes, unless it was renamed.
class TemporaryFile {
public:
    /// Fails with io, naming `path`, where no file can be made beside it.
    static Result<TemporaryFile> beside(const std::string& path);

    TemporaryFile(TemporaryFile&& other) noexcept;
    TemporaryFile& operator=(TemporaryFile&&) = delete;
    ~TemporaryFile();

    const std::string& path() const { return path_; }
    /// The file, open for writing from its beginning.
    std::FILE* stream() const { return stream_; }
    /// Closes the stream. @return 0, or the errno of a flush that failed, as of a full disk
    int close();

    /// Closes the stream, and gives the file its name. Call once.
    ///
    /// @param replaces whether a file that has the name is replaced; where not, that is EEXIST
    /// @return 0, or an errno: then the file is removed with the object
    int rename_to(const std::string& path, bool replaces);

private:
    TemporaryFile(std::string path, std::FILE* stream);

    std::string path_;  // "" where there is nothing to remove
    std::FILE* stream_ = nullptr;
    std::unique_ptr<RemovedIfKilled> if_killed_;
};

}  // namespace terrane::tools
