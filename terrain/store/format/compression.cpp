// SPDX-License-Identifier: MIT
#include <terrane/store/sealed_file.h>

#define XXH_INLINE_ALL
#include <xxhash.h>
#include <zstd.h>

#include <cstdio>
#include <new>
#include <string>

namespace terrane {

std::string ContentHash::text() const {
    char digits[33];
    std::snprintf(digits, sizeof(digits), "%016llx%016llx", static_cast<unsigned long long>(high),
                  static_cast<unsigned long long>(low));
    return digits;
}

struct ContentHasher::State {
    XXH3_state_t state;
};

ContentHasher::ContentHasher() : state_(std::make_unique<State>()) {
    XXH3_128bits_reset(&state_->state);
}
ContentHasher::~ContentHasher() = default;
ContentHasher::ContentHasher(ContentHasher&&) noexcept = default;
ContentHasher& ContentHasher::operator=(ContentHasher&&) noexcept = default;

void ContentHasher::add(std::span<const std::uint8_t> bytes) {
    add_raw(bytes.data(), bytes.size());
}

void ContentHasher::add_raw(const void* bytes, std::size_t count) {
    if (count > 0) XXH3_128bits_update(&state_->state, bytes, count);
}

ContentHash ContentHasher::value() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->state);
    return {hash.low64, hash.high64};
}

ContentHash hash_of(std::span<const std::uint8_t> bytes) {
    const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
    return {hash.low64, hash.high64};
}

std::vector<std::uint8_t> compress(std::span<const std::uint8_t> content) {
    constexpr int kLevel = 3;
    std::vector<std::uint8_t> record(ZSTD_compressBound(content.size()));
    // With space for the worst case it fails for lack of memory only.
    const std::size_t size =
        ZSTD_compress(record.data(), record.size(), content.data(), content.size(), kLevel);
    if (ZSTD_isError(size) != 0) throw std::bad_alloc();
    record.resize(size);
    return record;
}

Result<std::size_t> decompress(std::span<const std::uint8_t> record,
                               std::span<std::uint8_t> content_out) {
    const std::size_t size =
        ZSTD_decompress(content_out.data(), content_out.size(), record.data(), record.size());
    if (ZSTD_isError(size) != 0) {
        return fail(ErrorCode::bad_data,
                    std::string("damaged compressed data: ") + ZSTD_getErrorName(size));
    }
    return size;
}

}  // namespace terrane
