// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace terrane {

/// A number that files may contain: an integer or an IEEE 754 float of 1, 2, 4 or 8 bytes.
template <class T>
concept StoredNumber = std::integral<T> || std::floating_point<T>;

/// Writes numbers as little-endian bytes on every machine.
class ByteWriter {
public:
    /// Writes one value.
    template <StoredNumber T>
    void put(T value) {
        put_each(std::span<const T>(&value, 1));
    }
    /// Writes the values, without their count.
    template <StoredNumber T>
    void put_each(std::span<const T> values) {
        const std::size_t begin = bytes_.size();
        bytes_.resize(begin + values.size_bytes());
        if (values.empty()) return;
        std::memcpy(bytes_.data() + begin, values.data(), values.size_bytes());
        if constexpr (std::endian::native == std::endian::big && sizeof(T) > 1) {
            for (std::size_t i = begin; i < bytes_.size(); i += sizeof(T)) {
                for (std::size_t k = 0; k < sizeof(T) / 2; ++k) {
                    std::swap(bytes_[i + k], bytes_[i + sizeof(T) - 1 - k]);
                }
            }
        }
    }
    /// Writes the length as 64 bits, then the characters.
    void put_text(std::string_view text) {
        put(static_cast<std::uint64_t>(text.size()));
        put_each(std::span<const char>(text.data(), text.size()));
    }

    /// The bytes written so far.
    const std::vector<std::uint8_t>& bytes() const { return bytes_; }

private:
    std::vector<std::uint8_t> bytes_;
};

/// Reads the output of a ByteWriter. Reads beyond the end return 0, and has_failed() is true from then on.
class ByteReader {
public:
    /// Starts at the first of these bytes, which must outlive the reader.
    explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    /// Reads one value.
    template <StoredNumber T>
    T get() {
        T value{};
        get_each(std::span<T>(&value, 1));
        return value;
    }
    /// Reads as many values as the span has.
    template <StoredNumber T>
    void get_each(std::span<T> values_out) {
        if (values_out.empty()) return;
        if (has_failed_ || values_out.size_bytes() > bytes_.size() - at_) {
            has_failed_ = true;
            std::memset(values_out.data(), 0, values_out.size_bytes());
            return;
        }
        if constexpr (std::endian::native == std::endian::big && sizeof(T) > 1) {
            for (T& value : values_out) {
                unsigned char turned[sizeof(T)];
                for (std::size_t k = 0; k < sizeof(T); ++k) {
                    turned[k] = bytes_[at_ + sizeof(T) - 1 - k];
                }
                std::memcpy(&value, turned, sizeof(T));
                at_ += sizeof(T);
            }
        } else {
            std::memcpy(values_out.data(), bytes_.data() + at_, values_out.size_bytes());
            at_ += values_out.size_bytes();
        }
    }
    /// Reads the output of put_text().
    std::string get_text() {
        const auto length = get<std::uint64_t>();
        if (has_failed_ || length > bytes_.size() - at_) {
            has_failed_ = true;
            return {};
        }
        std::string text(static_cast<std::size_t>(length), '\0');
        get_each(std::span<char>(text.data(), text.size()));
        return text;
    }

    /// Whether a read went beyond the end.
    bool has_failed() const { return has_failed_; }
    /// Whether all bytes were read, and no read failed.
    bool is_done() const { return !has_failed_ && at_ == bytes_.size(); }

private:
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 0;
    bool has_failed_ = false;
};

}  // namespace terrane
