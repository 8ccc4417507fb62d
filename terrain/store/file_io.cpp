// SPDX-License-Identifier: MIT
#include "file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace terrane::internal {

Result<OpenFile> OpenFile::open(const std::string& path) {
    // Non-blocking, because opening a pipe without a writer would otherwise block.
    const int handle = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (handle < 0) {
        return fail(ErrorCode::io, "cannot open " + in_quotes(path) + ": " + std::strerror(errno));
    }
    struct stat status {};
    const bool is_regular = fstat(handle, &status) == 0 && S_ISREG(status.st_mode);
    OpenFile file(path, handle, is_regular ? static_cast<std::uint64_t>(status.st_size) : 0);
    if (!is_regular) {
        return fail(ErrorCode::io, "cannot open " + in_quotes(path) + ": it is no regular file");
    }
    return file;
}

OpenFile::~OpenFile() {
    if (handle_ >= 0) close(handle_);
}

Result<void> OpenFile::read(std::uint64_t offset, std::span<std::uint8_t> bytes_out) const {
    while (!bytes_out.empty()) {
        const ssize_t count =
            pread(handle_, bytes_out.data(), bytes_out.size(), static_cast<off_t>(offset));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            return fail(ErrorCode::io,
                        "cannot read " + in_quotes(path_) + ": " + std::strerror(errno));
        }
        if (count == 0) {
            return fail(ErrorCode::bad_data,
                        in_quotes(path_) + " is cut off at byte " + std::to_string(offset));
        }
        bytes_out = bytes_out.subspan(static_cast<std::size_t>(count));
        offset += static_cast<std::uint64_t>(count);
    }
    return {};
}

namespace {

/// The folder of a path.
std::string folder_of(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    if (slash == std::string::npos) return ".";
    return slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

Result<NewFile> NewFile::create(const std::string& path) {
    struct stat status {};
    if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
        return fail(ErrorCode::io, "cannot write " + in_quotes(path) + ": it is no regular file");
    }
    // A name unique among programs and threads.
    static std::atomic<unsigned> next{0};
    std::string written_path;
    int handle = -1;
    do {
        written_path = path + ".partial-" + std::to_string(getpid()) + "-" + std::to_string(next++);
        handle = ::open(written_path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (handle < 0 && errno == EEXIST);
    if (handle < 0) {
        return fail(ErrorCode::io, "cannot write " + in_quotes(path) + ": " + std::strerror(errno));
    }
    return NewFile(path, std::move(written_path), handle);
}

NewFile::~NewFile() {
    if (handle_ < 0) return;
    close(handle_);
    unlink(written_path_.c_str());
}

std::string NewFile::cannot_write(int cause) const {
    return "cannot write " + in_quotes(path_) + ": " + std::strerror(cause);
}

Result<void> NewFile::write(std::uint64_t offset, std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
        const ssize_t count =
            pwrite(handle_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return fail(ErrorCode::io, cannot_write(count < 0 ? errno : ENOSPC));
        bytes = bytes.subspan(static_cast<std::size_t>(count));
        offset += static_cast<std::uint64_t>(count);
    }
    return {};
}

Result<void> NewFile::commit() {
    // The content is flushed to the disk before the rename: after a crash there is either the old file or the new one.
    int cause = fsync(handle_) == 0 ? 0 : errno;
    if (close(std::exchange(handle_, -1)) != 0 && cause == 0) cause = errno;
    if (cause == 0 && rename(written_path_.c_str(), path_.c_str()) != 0) cause = errno;
    if (cause != 0) {
        unlink(written_path_.c_str());
        return fail(ErrorCode::io, cannot_write(cause));
    }
    if (const int folder = ::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        folder >= 0) {
        fsync(folder);
        close(folder);
    }
    return {};
}

Result<void> write_text(const std::string& path, std::string_view text) {
    TERRANE_TRY(auto file, NewFile::create(path));
    TERRANE_TRY(file.write(0, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
    return file.commit();
}

}  // namespace terrane::internal
