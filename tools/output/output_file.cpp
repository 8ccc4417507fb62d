// SPDX-License-Identifier: MIT
#include "output/output_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace terrane::tools {
namespace {}  // namespace

OutputFile::OutputFile(OutputPlace place, std::optional<TemporaryFile> temporary, std::FILE* direct)
    : place_(std::move(place)), temporary_(std::move(temporary)), direct_(direct) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : place_(std::move(other.place_)),
      temporary_(std::move(other.temporary_)),
      direct_(std::exchange(other.direct_, nullptr)),
      failed_errno_(other.failed_errno_) {}

OutputFile::~OutputFile() {
    if (direct_ != nullptr) std::fclose(direct_);
}

Result<OutputFile> OutputFile::create(const OutputPlace& place) {
    const std::string& path = place.path;
    if (path.empty()) return fail(ErrorCode::io, "cannot write to a file without a name");
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (std::filesystem::is_directory(status)) return cannot_write(path, EISDIR);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
        std::FILE* const direct = std::fopen(path.c_str(), "wb");
        if (direct == nullptr) return cannot_write(path, errno);
        return OutputFile(place, std::nullopt, direct);
    }
    Result<TemporaryFile> temporary = TemporaryFile::beside(path);
    if (!temporary) return tl::unexpected(temporary.error());
    return OutputFile(place, std::move(*temporary), nullptr);
}

void OutputFile::write(std::string_view bytes) {
    if (failed_errno_ != 0 || bytes.empty()) return;
    if (std::fwrite(bytes.data(), 1, bytes.size(), stream()) != bytes.size()) {
        failed_errno_ = errno;
    }
}

Result<void> OutputFile::check() const {
    if (failed_errno_ != 0) return cannot_write(place_.path, failed_errno_);
    return {};
}

Result<void> OutputFile::commit() {
    const int closed = direct_ != nullptr
                           ? (std::fclose(std::exchange(direct_, nullptr)) == 0 ? 0 : errno)
                           : temporary_->close();
    if (failed_errno_ == 0) failed_errno_ = closed;
    if (failed_errno_ == 0 && temporary_) {
        if (place_.folder != nullptr) {
            // the list first: after a kill in between, the next run finds a name without a file, which is harmless
            const Result<void> listed = place_.folder->record(temporary_->path(), place_.name);
            if (!listed) return listed;
        }
        failed_errno_ = temporary_->rename_to(place_.path, place_.folder == nullptr);
    }
    return check();
}

}  // namespace terrane::tools
