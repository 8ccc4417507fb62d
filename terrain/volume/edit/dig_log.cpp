// SPDX-License-Identifier: MIT
#include "edit/dig_log.h"

#include "shapes/operation_bytes.h"

#include <terrane/store/sealed_file.h>
#include <terrane/terrain/number_text.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

namespace terrane::internal {
namespace {

constexpr std::array<char, 8> kMagic{'T', 'R', 'N', 'D', 'I', 'G', 'S', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 36, kFrameBytes = 12;
// Of a change. Numbers in a file are not trusted, and later changes get larger ones.
constexpr std::uint32_t kMostNumber = 0x7fffffff;

std::vector<std::uint8_t> header_of(const std::array<std::uint64_t, 2>& fingerprint,
                                    std::uint32_t version = kVersion) {
    ByteWriter out;
    out.put_each(std::span<const char>(kMagic));
    out.put(version);
    out.put_each(std::span<const std::uint64_t>(fingerprint));
    out.put(hash_of(out.bytes()).low);
    return out.bytes();
}

std::uint64_t chained(std::uint64_t before, std::span<const std::uint8_t> content) {
    ContentHasher hasher;
    ByteWriter first;
    first.put(before);
    hasher.add(first.bytes());
    hasher.add(content);
    return hasher.value().low;
}

std::vector<std::uint8_t> record_bytes(const LogRecord& record) {
    ByteWriter out;
    out.put(record.number);
    out.put(std::uint8_t{record.operation ? std::uint8_t{0} : std::uint8_t{1}});
    if (record.operation) {
        put(out, *record.operation);
    } else {
        out.put(record.undone);
    }
    return out.bytes();
}

std::optional<LogRecord> record_of(std::span<const std::uint8_t> content) {
    ByteReader in(content);
    LogRecord record;
    record.number = in.get<std::uint32_t>();
    const auto kind = in.get<std::uint8_t>();
    if (kind == 0) {
        record.operation = get_operation(in);
        if (!record.operation) return std::nullopt;
    } else {
        record.undone = in.get<std::uint32_t>();
    }
    if (kind > 1 || !in.is_done()) return std::nullopt;
    return record;
}

/// Whether a whole record that follows from a hash begins at `at`.
bool is_record(std::span<const std::uint8_t> bytes, std::size_t at, std::uint64_t before) {
    if (at + kFrameBytes > bytes.size()) return false;
    const auto length = ByteReader(bytes.subspan(at)).get<std::uint32_t>();
    if (length > bytes.size() - at - kFrameBytes) return false;
    return chained(before, bytes.subspan(at + 4, length)) ==
           ByteReader(bytes.subspan(at + 4 + length)).get<std::uint64_t>();
}

/// Whether a record begins after `at` that follows from the hash before it: then what is at `at` is damaged, not torn.
bool has_later_record(std::span<const std::uint8_t> bytes, std::size_t at) {
    for (std::size_t next = at + 8; next + kFrameBytes <= bytes.size(); ++next) {
        if (is_record(bytes, next, ByteReader(bytes.subspan(next - 8)).get<std::uint64_t>()))
            return true;
    }
    return false;
}

}  // namespace

DigLog::DigLog(std::string path, const std::array<std::uint64_t, 2>& fingerprint)
    : path_(std::move(path)), header_(header_of(fingerprint)) {}

Result<DigLog> DigLog::open(std::string path, const std::array<std::uint64_t, 2>& fingerprint) {
    DigLog log(std::move(path), fingerprint);
    struct stat status {};
    if (stat(log.path_.c_str(), &status) != 0) {
        if (errno == ENOENT) return log;
        return fail(ErrorCode::io, "cannot open \"" + log.path_ + "\": " + std::strerror(errno));
    }
    std::ifstream in;
    if (S_ISREG(status.st_mode)) in.open(log.path_, std::ios::binary);
    if (!in.is_open()) return fail(ErrorCode::io, "cannot open \"" + log.path_ + "\"");
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)),
                                          std::istreambuf_iterator<char>());
    if (in.bad()) return fail(ErrorCode::io, "cannot read \"" + log.path_ + "\"");
    if (auto ok = log.parse(bytes); !ok) return tl::unexpected(ok.error());
    return log;
}

Result<void> DigLog::parse(std::span<const std::uint8_t> bytes) {
    const auto bad = [&](const std::string& what) {
        return fail(ErrorCode::bad_data, "\"" + path_ + "\" " + what);
    };
    if (bytes.size() < kHeaderBytes || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
        return bad("is no log of digs");
    ByteReader in(bytes.subspan(kMagic.size()));
    const auto version = in.get<std::uint32_t>();
    std::array<std::uint64_t, 2> fingerprint{};
    in.get_each(std::span<std::uint64_t>(fingerprint));
    if (!std::ranges::equal(header_of(fingerprint, version), bytes.first(kHeaderBytes)))
        return bad("has a damaged header");
    if (version != kVersion) {
        return bad("is of version " + number_text(version) + ", this program reads " +
                   number_text(kVersion));
    }
    if (!std::ranges::equal(header_, bytes.first(kHeaderBytes)))
        return bad("is of other volumes or another lattice");
    std::size_t at = kHeaderBytes;
    while (at < bytes.size()) {
        const std::uint64_t before = hashes_.empty() ? 0 : hashes_.back();
        const std::size_t left = bytes.size() - at;
        const auto length = ByteReader(bytes.subspan(at)).get<std::uint32_t>();
        if (!is_record(bytes, at, before)) {
            // A record after it may follow from what its own hash should be.
            const bool is_whole = left >= kFrameBytes && length <= left - kFrameBytes;
            if (has_later_record(bytes, at) ||
                (is_whole && is_record(bytes, at + kFrameBytes + length,
                                       chained(before, bytes.subspan(at + 4, length)))))
                return bad("is damaged at byte " + number_text(at));
            break;
        }
        const auto content = bytes.subspan(at + 4, length);
        auto record = record_of(content);
        if (!record || record->number > kMostNumber ||
            record->number <= (records_.empty() ? 0 : records_.back().number))
            return bad("has an impossible record at byte " + number_text(at));
        records_.push_back(std::move(*record));
        hashes_.push_back(chained(before, content));
        at += kFrameBytes + length;
    }
    saved_bytes_ = at;
    file_bytes_ = bytes.size();
    torn_bytes_ = file_bytes_ - saved_bytes_;
    return {};
}

std::uint64_t DigLog::add(LogRecord record) {
    const std::vector<std::uint8_t> content = record_bytes(record);
    const std::uint64_t hash = chained(hashes_.empty() ? 0 : hashes_.back(), content);
    ByteWriter framed;
    framed.put(static_cast<std::uint32_t>(content.size()));
    framed.put_each(std::span<const std::uint8_t>(content));
    framed.put(hash);
    unsaved_.insert(unsaved_.end(), framed.bytes().begin(), framed.bytes().end());
    records_.push_back(std::move(record));
    hashes_.push_back(hash);
    return hash;
}

Result<void> DigLog::save() {
    if (unsaved_.empty() && saved_bytes_ > 0) return {};
    const auto failed = [&](int cause) {
        return fail(ErrorCode::io, "cannot write \"" + path_ + "\": " + std::strerror(cause));
    };
    const int handle = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (handle < 0) return failed(errno);
    struct stat status {};
    if (fstat(handle, &status) != 0 || static_cast<std::uint64_t>(status.st_size) != file_bytes_) {
        close(handle);
        return fail(ErrorCode::io,
                    "cannot write \"" + path_ + "\": another program has changed it");
    }
    std::vector<std::uint8_t> bytes = saved_bytes_ == 0 ? header_ : std::vector<std::uint8_t>();
    bytes.insert(bytes.end(), unsaved_.begin(), unsaved_.end());
    int cause = 0;
    for (std::size_t done = 0; done < bytes.size() && cause == 0;) {
        const ssize_t count = pwrite(handle, bytes.data() + done, bytes.size() - done,
                                     static_cast<off_t>(saved_bytes_ + done));
        if (count > 0) {
            done += static_cast<std::size_t>(count);
        } else if (count == 0 || errno != EINTR) {
            cause = count == 0 ? ENOSPC : errno;
        }
    }
    const std::uint64_t end = saved_bytes_ + bytes.size();
    if (cause == 0 && ftruncate(handle, static_cast<off_t>(end)) != 0) cause = errno;
    if (cause == 0 && fsync(handle) != 0) cause = errno;
    if (cause != 0) {
        // As it was. If this fails too, the rest is a torn end, which open() leaves out.
        const bool is_restored = ftruncate(handle, static_cast<off_t>(saved_bytes_)) == 0;
        file_bytes_ = is_restored || fstat(handle, &status) != 0
                          ? saved_bytes_
                          : static_cast<std::uint64_t>(status.st_size);
        close(handle);
        if (saved_bytes_ == 0 && is_restored) unlink(path_.c_str());
        return failed(cause);
    }
    close(handle);
    if (saved_bytes_ == 0) {  // the file's name, too
        const std::size_t slash = path_.rfind('/');
        const std::string folder = slash == std::string::npos ? "." : path_.substr(0, slash + 1);
        if (const int at = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); at >= 0) {
            fsync(at);
            close(at);
        }
    }
    saved_bytes_ = file_bytes_ = end;
    unsaved_.clear();
    return {};
}

}  // namespace terrane::internal
