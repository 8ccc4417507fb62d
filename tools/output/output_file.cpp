// SPDX-License-Identifier: MIT
#include "output/output_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace terrane::tools {
namespace {

std::string cannot_write(const std::string& path, int cause) {
    return "cannot write '" + path + "': " + std::strerror(cause);
}

}  // namespace

OutputFile::OutputFile(std::string path, std::string written_path, std::FILE* file)
    : path_(std::move(path)), written_path_(std::move(written_path)), file_(file) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      written_path_(std::move(other.written_path_)),
      file_(std::exchange(other.file_, nullptr)),
      failed_errno_(other.failed_errno_) {}

OutputFile::~OutputFile() {
    if (file_ == nullptr) return;
    std::fclose(file_);
    if (written_path_ != path_) std::remove(written_path_.c_str());
}

Result<OutputFile> OutputFile::create(const std::string& path) {
    if (path.empty()) return fail(ErrorCode::io, "cannot write to a file without a name");
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (std::filesystem::is_directory(status)) {
        return fail(ErrorCode::io, cannot_write(path, EISDIR));
    }
    const bool replace =
        !std::filesystem::exists(status) || std::filesystem::is_regular_file(status);
    const std::string written_path = replace ? path + ".partial" : path;
    std::FILE* file = std::fopen(written_path.c_str(), "wb");
    if (file == nullptr) return fail(ErrorCode::io, cannot_write(path, errno));
    return OutputFile(path, written_path, file);
}

void OutputFile::write(std::string_view bytes) {
    if (failed_errno_ != 0 || bytes.empty()) return;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) failed_errno_ = errno;
}

Result<void> OutputFile::commit() {
    if (failed_errno_ == 0 && std::fflush(file_) != 0) failed_errno_ = errno;
    if (std::fclose(std::exchange(file_, nullptr)) != 0 && failed_errno_ == 0) {
        failed_errno_ = errno;
    }
    if (failed_errno_ == 0 && written_path_ != path_ &&
        std::rename(written_path_.c_str(), path_.c_str()) != 0) {
        failed_errno_ = errno;
    }
    if (failed_errno_ == 0) return {};
    if (written_path_ != path_) std::remove(written_path_.c_str());
    return fail(ErrorCode::io, cannot_write(path_, failed_errno_));
}

}  // namespace terrane::tools
