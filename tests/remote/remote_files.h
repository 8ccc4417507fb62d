// SPDX-License-Identifier: MIT
#pragma once

#include "http_server.h"

#include <terrane/remote/http_files.h>

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace terrane::test {

inline const std::string kShard = "0123456789abcdef0123456789abcdef.shard";
constexpr std::uint64_t kBlock = 4096;

/// Bytes of a file; all positions below 2^24 differ in one of three neighbouring bytes.
inline std::uint8_t byte_at(std::uint64_t position) {
    const std::uint64_t mixed = (position + 1) * 0x9e3779b97f4a7c15u;
    return static_cast<std::uint8_t>(mixed >> 56);
}

inline std::vector<std::uint8_t> file_of(std::size_t size) {
    std::vector<std::uint8_t> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = byte_at(i);
    return bytes;
}

/// Small blocks, and delays that suit a test. No time limit that a loaded machine could exceed.
inline HttpSettings quick_settings() {
    HttpSettings settings;
    settings.block_bytes = kBlock;
    settings.request_bytes = 4 * kBlock;
    settings.memory_bytes = 64 * kBlock;
    settings.first_retry_delay = 0.001;
    settings.longest_retry_delay = 0.004;
    return settings;
}

inline std::shared_ptr<const HttpFiles> open_files(
    const std::string& url, const HttpSettings& settings = quick_settings()) {
    auto files = open_http(url, settings);
    EXPECT_TRUE(files.has_value()) << (files ? "" : files.error().message);
    return files.value();
}

/// A range to be read, with its bytes.
class Read {
public:
    Read(std::uint64_t offset, std::size_t size, std::uint64_t file_bytes)
        : bytes_(size), range_{kShard, file_bytes, offset, bytes_} {}
    const FileRange& range() const { return range_; }
    bool is_right() const {
        for (std::size_t i = 0; i < bytes_.size(); ++i) {
            if (bytes_[i] != byte_at(range_.offset + i)) return false;
        }
        return true;
    }

private:
    std::vector<std::uint8_t> bytes_;
    FileRange range_;
};

/// Reads one range; an error's text, or "" if the bytes are right, or "wrong bytes".
inline std::string read_one(const ShardFiles& files, std::uint64_t offset, std::size_t size,
                            std::uint64_t file_bytes) {
    const Read read(offset, size, file_bytes);
    const FileRange& range = read.range();
    if (auto done = files.read({&range, 1}, {}); !done) return done.error().message;
    return read.is_right() ? "" : "wrong bytes";
}

/// Waits until a condition holds, at most half a minute.
template <class Condition>
bool holds_soon(const Condition& condition) {
    for (int i = 0; i < 30000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

/// The sum of all failures.
inline std::uint64_t failure_count(const HttpFailures& f) {
    return f.refused + f.busy + f.server_error + f.cut_short + f.wrong_range + f.wrong_size +
           f.timed_out + f.unresolved + f.unreachable + f.certificate + f.redirect;
}

}  // namespace terrane::test
