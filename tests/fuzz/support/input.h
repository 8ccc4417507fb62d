// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

/// A fuzz target: libFuzzer or replay_main.cpp calls it with the bytes of one input. Returns 0; -1: the input is not to
/// be kept in the corpus. Aborts where a promise of the library is broken.
// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace terrane::fuzz {

/// Aborts with a message where a promise is broken.
inline void require(bool is_kept, const char* promise) {
    if (is_kept) return;
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
}
inline void require(bool is_kept, const std::string& promise) { require(is_kept, promise.c_str()); }

/// Takes values from the front of the bytes of an input. After the end all bytes are 0.
class Input {
public:
    Input(const std::uint8_t* data, std::size_t size) : bytes_(data, size) {}

    bool is_empty() const { return bytes_.empty(); }
    std::uint8_t byte();
    bool flag() { return (byte() & 1) != 0; }
    /// @param count above 0
    int below(int count) { return byte() % count; }
    /// `width` bytes, little-endian.
    std::uint64_t bits(int width);
    /// Evenly spaced values of 16 bits, low and high included.
    double between(double low, double high);
    /// Mostly low to high; where the first byte is 255 any bits of a double follow, NaN and infinities included.
    double number(double low, double high);
    /// Mostly a point of the box from (low, low, low) to (high, high, high); see number().
    Eigen::Vector3d vector(double low, double high);
    /// Mostly a rotation; else any matrix.
    Eigen::Matrix3d rotation();
    /// At most `most` bytes.
    std::span<const std::uint8_t> bytes(std::size_t most);
    /// All bytes that are left.
    std::span<const std::uint8_t> rest() { return bytes(bytes_.size()); }
    std::string_view rest_as_text();

private:
    std::span<const std::uint8_t> bytes_;
};

}  // namespace terrane::fuzz
