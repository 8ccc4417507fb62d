// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "block_cache.h"
#include "block_fetcher.h"
#include "http_address.h"

#include <terrane/remote/http_files.h>

#include <curl/curl.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

namespace terrane {
namespace {

using internal::BlockKey;
using internal::Clock;
using internal::SharedBytes;

/// Most bytes of blocks that one read() holds at a time.
constexpr std::uint64_t kWindowBytes = std::uint64_t{1} << 24;

/// Part of a range that lies in one block.
struct Part {
    BlockKey block;
    std::uint64_t offset = 0;  // in the block
    std::span<std::uint8_t> bytes_out;
};

Result<void> check_line(const char* name, const std::string& text) {
    if (std::ranges::none_of(text, [](char letter) { return letter >= 0 && letter < ' '; }))
        return {};
    return fail(ErrorCode::invalid_argument, std::string(name) + " must be one line of text");
}

Result<void> check(const HttpSettings& settings) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 50;
    constexpr std::size_t kMostMemory = std::size_t{1} << 40;
    TERRANE_TRY(check_range("block_bytes", settings.block_bytes, std::size_t{1} << 12,
                            std::size_t{1} << 22));
    if (!std::has_single_bit(settings.block_bytes)) {
        return fail(ErrorCode::invalid_argument,
                    "block_bytes must be a power of two, got " + number_text(settings.block_bytes));
    }
    TERRANE_TRY(check_range("request_bytes", settings.request_bytes, settings.block_bytes,
                            std::size_t{1} << 26));
    TERRANE_TRY(
        check_range("memory_bytes", settings.memory_bytes, settings.request_bytes, kMostMemory));
    TERRANE_TRY(check_range("cache_bytes", settings.cache_bytes,
                            std::uint64_t{64} * settings.block_bytes, kMostBytes));
    TERRANE_TRY(check_range("connection_count", settings.connection_count, 1, 64));
    TERRANE_TRY(check_range("connect_timeout", settings.connect_timeout, 0.001, 3600.0));
    TERRANE_TRY(check_range("stall_timeout", settings.stall_timeout, 0.001, 3600.0));
    TERRANE_TRY(check_range("read_timeout", settings.read_timeout, 0.001, 86400.0));
    TERRANE_TRY(check_range("retry_count", settings.retry_count, 0, 100));
    TERRANE_TRY(check_range("first_retry_delay", settings.first_retry_delay, 0.001, 3600.0));
    TERRANE_TRY(check_range("longest_retry_delay", settings.longest_retry_delay,
                            settings.first_retry_delay, 3600.0));
    TERRANE_TRY(check_line("authorization", settings.authorization));
    return check_line("user_agent", settings.user_agent);
}

Result<void> check(const S3Settings& s3) {
    const bool is_region = !s3.region.empty() && std::ranges::all_of(s3.region, [](char letter) {
        return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') ||
               letter == '-';
    });
    if (!is_region) {
        return fail(ErrorCode::invalid_argument,
                    "s3.region must be lower-case letters, digits and hyphens, got \"" +
                        internal::shown_address(s3.region) + "\"");
    }
    if (s3.access_key.empty() != s3.secret_key.empty()) {
        return fail(ErrorCode::invalid_argument,
                    "s3.access_key and s3.secret_key go together, got only one");
    }
    TERRANE_TRY(check_line("s3.endpoint", s3.endpoint));
    TERRANE_TRY(check_line("s3.access_key", s3.access_key));
    TERRANE_TRY(check_line("s3.secret_key", s3.secret_key));
    TERRANE_TRY(check_line("s3.session_token", s3.session_token));
    constexpr unsigned kSignsHeaders = 0x075700;  // the first version that signs all headers
    const curl_version_info_data& curl = *curl_version_info(CURLVERSION_NOW);
    if (!s3.access_key.empty() && curl.version_num < kSignsHeaders) {
        return fail(ErrorCode::invalid_argument,
                    std::string("requests to buckets need libcurl 7.87 to be signed, this is ") +
                        curl.version);
    }
    return {};
}

std::string environment(const char* name, const char* other = nullptr) {
    const char* value = std::getenv(name);
    if ((value == nullptr || *value == '\0') && other != nullptr) value = std::getenv(other);
    return value == nullptr ? std::string() : std::string(value);
}

class CachedHttpFiles final : public HttpFiles {
public:
    CachedHttpFiles(internal::HttpAddress address, const HttpSettings& settings)
        : place_(address.folder),
          settings_(settings),
          disk_(settings.cache_folder, settings.cache_bytes),
          fetcher_(internal::HttpClient(std::move(address), settings)) {}

    const std::string& place() const override { return place_; }
    bool is_slow() const override { return true; }

    Result<std::vector<std::uint8_t>> read_whole(const std::string& name,
                                                 std::size_t most_bytes) const override {
        TERRANE_TRY(check_name(name));
        return fetcher_.fetch_whole(name, most_bytes, deadline());
    }

    Result<void> read(std::span<const FileRange> ranges,
                      const std::stop_token& stop) const override {
        const Clock::time_point end = deadline();
        for (const FileRange& range : ranges) TERRANE_TRY(check_range_of(range));
        std::vector<Part> parts;
        std::uint64_t bytes = 0;
        for (const FileRange& range : ranges) {
            for (const Part& part : parts_of(range)) {
                parts.push_back(part);
                bytes += part.block.bytes;
                if (bytes < kWindowBytes) continue;
                TERRANE_TRY(read_parts(parts, end, stop));
                parts.clear();
                bytes = 0;
            }
        }
        return read_parts(parts, end, stop);
    }

    void expect(std::span<const ExpectedRange> ranges) const override {
        const std::lock_guard lock(expecting_);
        std::map<BlockKey, bool> is_on_disk;  // of the blocks that are expected now
        std::vector<BlockKey> soon, later;
        for (const ExpectedRange& range : ranges) {
            const FileRange empty{range.name, range.file_bytes, range.offset, {}};
            if (range.bytes == 0 || !check_range_of(empty) ||
                range.bytes > range.file_bytes - range.offset)
                continue;
            const std::uint64_t size = settings_.block_bytes;
            for (std::uint64_t at = range.offset / size * size; at < range.offset + range.bytes;
                 at += size) {
                const BlockKey key{range.name, range.file_bytes, at,
                                   std::min(size, range.file_bytes - at)};
                const auto [place, is_new] = is_on_disk.try_emplace(key, false);
                if (!is_new) continue;
                const auto known = is_expected_on_disk_.find(key);
                place->second =
                    known != is_expected_on_disk_.end() ? known->second : disk_.contains(key);
                if (!place->second) (range.is_later ? later : soon).push_back(key);
            }
        }
        is_expected_on_disk_ = std::move(is_on_disk);
        fetcher_.expect(soon, later);
    }

    bool discard(const FileRange& range) const override {
        if (!check_range_of(range)) return false;
        // Before blocks are removed: calls that are storing blocks see it, and remove theirs.
        ++discard_count_;
        for (const Part& part : parts_of(range)) {
            fetcher_.discard(part.block);
            disk_.discard(part.block);
        }
        return true;
    }

    HttpStatistics statistics() const override {
        HttpStatistics statistics = fetcher_.statistics();
        statistics.disk_hits = disk_hits_;
        statistics.discarded = discard_count_;
        statistics.damaged_blocks = disk_.damaged_blocks();
        statistics.cache_faults = disk_.faults();
        return statistics;
    }

private:
    Clock::time_point deadline() const {
        return Clock::now() + internal::to_duration(settings_.read_timeout);
    }

    Result<void> check_name(const std::string& name) const {
        if (internal::is_file_name(name)) return {};
        return fail(ErrorCode::bad_data, "cannot read \"" + internal::shown_address(name) +
                                             "\" of \"" + place_ + "\": it is no name of a file");
    }

    Result<void> check_range_of(const FileRange& range) const {
        TERRANE_TRY(check_name(range.name));
        if (range.offset <= range.file_bytes &&
            range.bytes_out.size() <= range.file_bytes - range.offset) {
            return {};
        }
        return fail(ErrorCode::bad_data, "cannot read " + number_text(range.bytes_out.size()) +
                                             " bytes at " + number_text(range.offset) + " of \"" +
                                             place_ + range.name + "\": it has " +
                                             number_text(range.file_bytes) + " bytes");
    }

    std::vector<Part> parts_of(const FileRange& range) const {
        std::vector<Part> parts;
        const std::uint64_t end = range.offset + range.bytes_out.size();
        for (std::uint64_t at = range.offset; at < end;) {
            const std::uint64_t block = at / settings_.block_bytes * settings_.block_bytes;
            const std::uint64_t block_end =
                std::min(block + settings_.block_bytes, range.file_bytes);
            const std::uint64_t part_end = std::min(block_end, end);
            parts.push_back({{range.name, range.file_bytes, block, block_end - block},
                             at - block,
                             range.bytes_out.subspan(at - range.offset, part_end - at)});
            at = part_end;
        }
        return parts;
    }

    Result<void> read_parts(std::span<const Part> parts, Clock::time_point end,
                            const std::stop_token& stop) const {
        if (stop.stop_requested()) {
            return fail(ErrorCode::cancelled, "reading \"" + place_ + "\" was cancelled");
        }
        std::map<BlockKey, SharedBytes> blocks;
        for (const Part& part : parts) blocks.emplace(part.block, nullptr);
        TERRANE_TRY(read_blocks(blocks, end, stop));
        for (const Part& part : parts) {
            std::memcpy(part.bytes_out.data(), blocks[part.block]->data() + part.offset,
                        part.bytes_out.size());
        }
        return {};
    }

    /// Finds blocks in memory, on disk, or on the server.
    Result<void> read_blocks(std::map<BlockKey, SharedBytes>& blocks, Clock::time_point end,
                             const std::stop_token& stop) const {
        const std::uint64_t discard_count = discard_count_;
        std::vector<BlockKey> missing;
        for (auto& [key, bytes] : blocks) {
            const auto found = fetcher_.find(key);
            bytes = found.bytes;
            if (found.is_first) store(key, *bytes, discard_count);
            if (bytes != nullptr) continue;
            if (auto content = disk_.find(key)) {
                ++disk_hits_;
                bytes = std::make_shared<const std::vector<std::uint8_t>>(*std::move(content));
                fetcher_.keep(key, bytes);
                if (discard_count_ != discard_count) fetcher_.discard(key);
            } else {
                missing.push_back(key);
            }
        }
        if (missing.empty()) return {};
        TERRANE_TRY(const auto fetched, fetcher_.fetch(missing, end, stop));
        for (std::size_t i = 0; i < missing.size(); ++i) {
            blocks[missing[i]] = fetched[i].bytes;
            if (fetched[i].is_first) store(missing[i], *fetched[i].bytes, discard_count);
        }
        return {};
    }

    /// Writes a block to the disk cache, unless blocks were discarded since discard_count_ had this value.
    void store(const BlockKey& key, std::span<const std::uint8_t> bytes,
               std::uint64_t discard_count) const {
        disk_.insert(key, bytes);
        if (discard_count_ != discard_count) disk_.discard(key);
    }

    const std::string place_;
    const HttpSettings settings_;
    mutable std::atomic<std::uint64_t> disk_hits_{0}, discard_count_{0};
    mutable std::mutex expecting_;
    mutable std::map<BlockKey, bool> is_expected_on_disk_;  ///< since the last expect(), by block
    mutable internal::BlockCache disk_;
    mutable internal::BlockFetcher fetcher_;
};

}  // namespace

S3Settings s3_settings_of_environment() {
    S3Settings s3;
    if (std::string region = environment("AWS_REGION", "AWS_DEFAULT_REGION"); !region.empty()) {
        s3.region = std::move(region);
    }
    s3.endpoint = environment("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL");
    s3.access_key = environment("AWS_ACCESS_KEY_ID");
    s3.secret_key = environment("AWS_SECRET_ACCESS_KEY");
    s3.session_token = environment("AWS_SESSION_TOKEN");
    return s3;
}

Result<std::shared_ptr<const HttpFiles>> open_http(const std::string& url,
                                                   const HttpSettings& settings) {
    TERRANE_TRY(check(settings));
    if (internal::is_bucket_address(url)) TERRANE_TRY(check(settings.s3));
    TERRANE_TRY(auto address, internal::parse_http_address(url, settings.s3));
    return std::make_shared<const CachedHttpFiles>(std::move(address), settings);
}

}  // namespace terrane
