// SPDX-License-Identifier: MIT
#include "program/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string_view>
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
    for (int i = 0; i < kMostNames; ++i) {
        const std::string name = path + ".partial" + (i == 0 ? "" : std::to_string(i));
        // O_EXCL: never opens an existing file
        const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno == EEXIST) continue;
        if (descriptor < 0) return cannot_write(path, errno);
        std::FILE* const stream = ::fdopen(descriptor, "wb");
        if (stream == nullptr) {
            const int cause = errno;
            ::close(descriptor);
            std::remove(name.c_str());
            return cannot_write(path, cause);
        }
        return TemporaryFile(name, stream);
    }
    return cannot_write(path, EEXIST);
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

// Sources:
//   G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake. The FNV non-cryptographic hash algorithm (hash of contents).

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeading =
    "# Files that terrane wrote here: size, hash, name. A later run replaces these and no "
    "others.\n";

template <class T>
bool read_number(std::string_view& text, T& value_out, int base) {
    const auto [rest, error] =
        std::from_chars(text.data(), text.data() + text.size(), value_out, base);
    if (error != std::errc() || rest == text.data() + text.size() || *rest != ' ') return false;
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()) + 1);
    return true;
}

}  // namespace

tl::unexpected<Error> cannot_write(const std::string& path, int cause) {
    return fail(ErrorCode::io, "cannot write '" + path + "': " + std::strerror(cause));
}

std::string frame_name(std::size_t frame) { return fmt::format("frame_{:06}.png", frame); }

bool is_frame_name(const std::string& name) {
    return name.size() >= frame_name(0).size() && name.starts_with("frame_") &&
           name.ends_with(".png") && std::all_of(name.begin() + 6, name.end() - 4, [](char c) {
               return c >= '0' && c <= '9';
           });
}

Result<std::shared_ptr<OutputFolder>> OutputFolder::open(const std::string& path,
                                                         std::vector<std::string> names,
                                                         bool has_frames) {
    if (path.empty()) return std::shared_ptr<OutputFolder>();
    std::error_code error;
    fs::create_directories(path, error);
    if (error || !fs::is_directory(path, error)) {
        const std::string cause = error ? error.message() : "it is a file";
        return fail(ErrorCode::io, "cannot make the folder '" + path + "': " + cause);
    }
    const std::shared_ptr<OutputFolder> folder(new OutputFolder(path));
    TERRANE_TRY(folder->open_list());
    TERRANE_TRY(folder->read_list());

    std::vector<std::string> clashes;
    for (fs::directory_iterator entry(path, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        const bool is_wanted = (has_frames && is_frame_name(name)) ||
                               std::find(names.begin(), names.end(), name) != names.end();
        if (!is_wanted) continue;
        const auto own = folder->entries_.find(name);
        if (own == folder->entries_.end() || !folder->is_unchanged(name, own->second)) {
            clashes.push_back(name);
        }
    }
    if (error) {
        return fail(ErrorCode::io, "cannot read the folder '" + path + "': " + error.message());
    }
    if (clashes.empty()) return folder;
    // the first name alphabetically, independent of the order of the directory listing
    const std::string first = *std::min_element(clashes.begin(), clashes.end());
    return fail(
        ErrorCode::io,
        fmt::format("'{}' is not a file that terrane wrote and left there, and would be "
                    "written over{}; move it, or choose another folder for --out",
                    folder->path_of(first),
                    clashes.size() == 1 ? "" : fmt::format(" (and {} more)", clashes.size() - 1)));
}

OutputFolder::~OutputFolder() {
    if (list_ < 0) return;
    if (entries_.empty()) ::unlink(path_of(kFileListName).c_str());
    ::close(list_);
}

Result<void> OutputFolder::open_list() {
    const std::string path = path_of(kFileListName);
    list_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (list_ < 0) return cannot_write(path, errno);
    if (::flock(list_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return {};
    ::close(std::exchange(list_, -1));
    return fail(ErrorCode::io, "another run of terrane writes to the folder '" + path_ + "'");
}

Result<void> OutputFolder::read_list() {
    const std::string path = path_of(kFileListName);
    std::string text;
    char piece[4096];
    ssize_t count = 0;
    while ((count = ::read(list_, piece, sizeof piece)) > 0) {
        text.append(piece, static_cast<std::size_t>(count));
    }
    if (count < 0) {
        return fail(ErrorCode::io, "cannot read '" + path + "': " + std::strerror(errno));
    }
    std::string_view rest = text;
    if (!rest.empty() && !rest.starts_with(kHeading)) {
        ::close(std::exchange(list_, -1));  // the file belongs to the user and must not be changed
        return fail(ErrorCode::io, "'" + path +
                                       "' is not a list of files that terrane wrote; move it, or "
                                       "choose another folder for --out");
    }
    rest.remove_prefix(std::min(rest.size(), kHeading.size()));
    // ignores a last line without a line end, left by a full disk or a killed program
    for (std::size_t end = rest.find('\n'); end != std::string_view::npos; end = rest.find('\n')) {
        std::string_view line = rest.substr(0, end);
        rest.remove_prefix(end + 1);
        Entry entry;
        if (!read_number(line, entry.size, 10) || !read_number(line, entry.hash, 16)) continue;
        const std::string name(line);
        if (name.empty() || name.find('/') != std::string::npos) continue;  // outside the folder
        entries_[name] = entry;
    }
    return {};
}

Result<void> OutputFolder::clear() {
    for (const auto& [name, entry] : entries_) {
        if (!is_unchanged(name, entry)) continue;
        std::error_code error;
        fs::remove(path_of(name), error);
        if (error) {
            return fail(ErrorCode::io, "cannot remove '" + path_of(name) + "': " + error.message());
        }
    }
    entries_.clear();
    if (::ftruncate(list_, 0) != 0 || ::lseek(list_, 0, SEEK_SET) != 0) {
        return cannot_write(path_of(kFileListName), errno);
    }
    return append(std::string(kHeading));
}

Result<void> OutputFolder::record(const std::string& written_path, const std::string& name) {
    TERRANE_TRY(const Entry entry, measure(written_path));
    entries_[name] = entry;
    return append(fmt::format("{} {:016x} {}\n", entry.size, entry.hash, name));
}

Result<void> OutputFolder::append(const std::string& text) {
    for (std::size_t written = 0; written < text.size();) {
        const ssize_t count = ::write(list_, text.data() + written, text.size() - written);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return cannot_write(path_of(kFileListName), errno);
        written += static_cast<std::size_t>(count);
    }
    return {};
}

Result<OutputFolder::Entry> OutputFolder::measure(const std::string& path) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                               &std::fclose);
    const auto refuse = [&path](int cause) {
        return fail(ErrorCode::io, "cannot read '" + path + "': " + std::strerror(cause));
    };
    if (file == nullptr) return refuse(errno);
    Entry entry{.size = 0, .hash = 0xcbf29ce484222325u};
    std::vector<unsigned char> piece(std::size_t{1} << 16);
    for (;;) {
        const std::size_t count = std::fread(piece.data(), 1, piece.size(), file.get());
        for (std::size_t i = 0; i < count; ++i) {
            entry.hash = (entry.hash ^ piece[i]) * 0x100000001b3u;
        }
        entry.size += count;
        if (count == piece.size()) continue;
        if (std::ferror(file.get()) != 0) return refuse(errno);
        return entry;
    }
}

bool OutputFolder::is_unchanged(const std::string& name, const Entry& entry) const {
    std::error_code error;
    // no run writes symbolic links: a link belongs to the user, whatever its target
    const fs::file_status status = fs::symlink_status(path_of(name), error);
    if (error || !fs::is_regular_file(status)) return false;
    if (fs::file_size(path_of(name), error) != entry.size || error) return false;
    const Result<Entry> now = measure(path_of(name));
    return now && *now == entry;
}

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
    TERRANE_TRY(TemporaryFile temporary, TemporaryFile::beside(path));
    return OutputFile(place, std::move(temporary), nullptr);
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
            // listed before the rename: if killed in between, the list names a missing file, which is harmless
            TERRANE_TRY(place_.folder->record(temporary_->path(), place_.name));
        }
        failed_errno_ = temporary_->rename_to(place_.path, place_.folder == nullptr);
    }
    return check();
}

Result<void> write_file(const OutputPlace& place, std::string_view bytes) {
    TERRANE_TRY(OutputFile file, OutputFile::create(place));
    file.write(bytes);
    return file.commit();
}

}  // namespace terrane::tools
