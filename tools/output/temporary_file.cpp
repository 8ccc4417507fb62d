// SPDX-License-Identifier: MIT
#include "output/temporary_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace terrane::tools {

TemporaryFile::TemporaryFile(std::string path, std::FILE* stream)
    : path_(std::move(path)),
      stream_(stream),
      if_killed_(std::make_unique<RemovedIfKilled>(path_)) {}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      stream_(std::exchange(other.stream_, nullptr)),
      if_killed_(std::move(other.if_killed_)) {}

TemporaryFile::~TemporaryFile() {
    close();
    if (!path_.empty()) std::remove(path_.c_str());
}

Result<TemporaryFile> TemporaryFile::beside(const std::string& path) {
    constexpr int kMostNames = 1000;
    const auto refuse = [&path](int cause) {
        return fail(ErrorCode::io, "cannot write '" + path + "': " + std::strerror(cause));
    };
    for (int i = 0; i < kMostNames; ++i) {
        const std::string name = path + ".partial" + (i == 0 ? "" : std::to_string(i));
        // O_EXCL: an existing file is not ours
        const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno == EEXIST) continue;
        if (descriptor < 0) return refuse(errno);
        std::FILE* const stream = ::fdopen(descriptor, "wb");
        if (stream == nullptr) {
            const int cause = errno;
            ::close(descriptor);
            std::remove(name.c_str());
            return refuse(cause);
        }
        return TemporaryFile(name, stream);
    }
    return refuse(EEXIST);
}

int TemporaryFile::close() {
    if (stream_ == nullptr) return 0;
    return std::fclose(std::exchange(stream_, nullptr)) == 0 ? 0 : errno;
}

int TemporaryFile::rename_to(const std::string& path, bool replaces) {
    if (const int cause = close(); cause != 0) return cause;
    const unsigned flags = replaces ? 0 : RENAME_NOREPLACE;
    int failed = ::renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, path.c_str(), flags);
    if (failed != 0 && errno == EINVAL && !replaces) {
        // the file system does not support RENAME_NOREPLACE
        if (::access(path.c_str(), F_OK) == 0) return EEXIST;
        failed = std::rename(path_.c_str(), path.c_str());
    }
    if (failed != 0) return errno;
    path_.clear();
    if_killed_.reset();
    return 0;
}

}  // namespace terrane::tools
