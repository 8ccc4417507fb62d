// SPDX-License-Identifier: MIT
#include "block_cache.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

constexpr std::array<char, 8> kMagic{'T', 'R', 'N', 'B', 'L', 'K', '0', '1'};
constexpr std::size_t kHeaderBytes = 24;
constexpr std::string_view kExtension = ".block";
constexpr std::size_t kDigits = 32;  // of a hash

std::vector<std::uint8_t> key_bytes(const BlockKey& key) {
    ByteWriter out;
    out.put_text(key.name);
    out.put(key.file_bytes);
    out.put(key.offset);
    out.put(key.bytes);
    return out.bytes();
}

/// Magic number, and the hash of key and content.
std::vector<std::uint8_t> header_of(const BlockKey& key, std::span<const std::uint8_t> content) {
    ContentHasher hasher;
    hasher.add(key_bytes(key));
    hasher.add(content);
    const ContentHash hash = hasher.value();
    ByteWriter out;
    out.put_each(std::span<const char>(kMagic));
    out.put(hash.low);
    out.put(hash.high);
    return out.bytes();
}

bool are_digits(std::string_view text) {
    return std::ranges::all_of(text, [](char letter) {
        return (letter >= '0' && letter <= '9') || (letter >= 'a' && letter <= 'f');
    });
}

/// Whether the cache has written a file: complete or temporary blocks. All other files in the folder are kept.
bool is_block_name(std::string_view name) {
    return name.size() >= kDigits + kExtension.size() && are_digits(name.substr(0, kDigits)) &&
           name.substr(kDigits).starts_with(kExtension);
}

/// Reads up to bytes_out.size() bytes of an open file, and returns how many it has there.
std::size_t read_file(int handle, std::span<std::uint8_t> bytes_out) {
    std::size_t done = 0;
    while (done < bytes_out.size()) {
        const ssize_t count = ::read(handle, bytes_out.data() + done, bytes_out.size() - done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        done += static_cast<std::size_t>(count);
    }
    return done;
}

/// Marks an open file as used now. The time that the system sets itself is up to 10 ms old.
void touch(int handle) {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    const timespec times[2] = {now, now};  // of access and of modification
    futimens(handle, times);
}

bool write_file(int handle, std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(handle, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
}

}  // namespace

BlockCache::BlockCache(std::string folder, std::uint64_t most_bytes)
    : folder_(std::move(folder)), most_bytes_(most_bytes) {}

std::string BlockCache::path_of(const BlockKey& key) const {
    const std::string digits = hash_of(key_bytes(key)).text();
    return folder_ + "/" + digits.substr(0, 2) + "/" + digits + std::string(kExtension);
}

std::optional<std::vector<std::uint8_t>> BlockCache::find(const BlockKey& key) {
    if (folder_.empty()) return std::nullopt;
    const std::string path = path_of(key);
    const int handle = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (handle < 0) return std::nullopt;
    std::array<std::uint8_t, kHeaderBytes> header{};
    // one byte more, to notice a file that is too long
    std::vector<std::uint8_t> content(key.bytes + 1);
    const bool has_header = read_file(handle, header) == header.size();
    content.resize(has_header ? read_file(handle, content) : 0);
    const bool is_whole = has_header && content.size() == key.bytes &&
                          std::ranges::equal(header, header_of(key, content));
    if (is_whole) touch(handle);
    close(handle);
    if (is_whole) return content;
    ++damaged_blocks_;
    unlink(path.c_str());
    return std::nullopt;
}

bool BlockCache::contains(const BlockKey& key) const {
    return !folder_.empty() && access(path_of(key).c_str(), F_OK) == 0;
}

void BlockCache::insert(const BlockKey& key, std::span<const std::uint8_t> content) {
    if (folder_.empty()) return;
    make_space(kHeaderBytes + content.size());
    if (!write(path_of(key), header_of(key, content), content)) ++faults_;
}

bool BlockCache::write(const std::string& path, std::span<const std::uint8_t> header,
                       std::span<const std::uint8_t> content) const {
    // A name that no other thread or process uses.
    static std::atomic<unsigned> next{0};
    std::string temporary;
    int handle = -1;
    bool has_folder = false;
    for (;;) {
        temporary = path + "." + std::to_string(getpid()) + "-" + std::to_string(next++);
        handle = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (handle >= 0) break;
        if (errno == EEXIST) continue;
        if (errno != ENOENT || std::exchange(has_folder, true)) return false;
        std::error_code ignored;  // the next open() tells
        std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    }
    bool is_written = write_file(handle, header) && write_file(handle, content);
    touch(handle);
    is_written = close(handle) == 0 && is_written;
    if (is_written && rename(temporary.c_str(), path.c_str()) == 0) return true;
    unlink(temporary.c_str());
    return false;
}

void BlockCache::discard(const BlockKey& key) {
    if (!folder_.empty()) unlink(path_of(key).c_str());
}

void BlockCache::make_space(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    if (!written_ || *written_ + bytes > most_bytes_ / 32) {
        evict();
        written_ = 0;
    }
    *written_ += bytes;
}

void BlockCache::evict() const {
    namespace fs = std::filesystem;
    std::vector<std::tuple<fs::file_time_type, std::string, std::uint64_t>> files;
    std::uint64_t total = 0;
    // Another process may remove files at the same time, so every step may fail.
    std::error_code error;
    for (fs::directory_iterator folder(folder_, error), end; !error && folder != end;
         folder.increment(error)) {
        const std::string name = folder->path().filename().string();
        if (name.size() != 2 || !are_digits(name)) continue;
        std::error_code fault;
        for (fs::directory_iterator file(folder->path(), fault), last; !fault && file != last;
             file.increment(fault)) {
            if (!is_block_name(file->path().filename().string())) continue;
            struct stat status {};
            if (lstat(file->path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
            std::error_code no_time;
            const fs::file_time_type used = file->last_write_time(no_time);
            if (no_time) continue;
            const auto bytes = static_cast<std::uint64_t>(status.st_size);
            files.emplace_back(used, file->path().string(), bytes);
            total += bytes;
        }
    }
    if (total <= most_bytes_ / 4 * 3) return;
    std::ranges::sort(files);
    for (const auto& [used, path, bytes] : files) {
        if (total <= most_bytes_ / 8 * 5) return;
        if (unlink(path.c_str()) == 0 || errno == ENOENT) total -= bytes;
    }
}

}  // namespace terrane::internal
