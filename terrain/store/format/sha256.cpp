// SPDX-License-Identifier: MIT
//
// Sources: NIST, Secure Hash Standard, FIPS 180-4, 2015: sections 4.1.2, 4.2.2, 5.1.1, 5.3.3, 6.2.
// Deviations: none. Its constants are computed from their definition, the first 32 bits of the fractional
//             parts of square and cube roots of primes, by integers.
#include "format/sha256.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <vector>

namespace terrane::internal {
namespace {

/// The largest integer whose square, or cube, is at most prime * 2^(32 * power); its last 32 bits.
constexpr std::uint32_t root_fraction(std::uint64_t prime, int power) {
    __extension__ using Wide = unsigned __int128;
    // Below 7.4 * 2^32 for the cube root of 409, below 4.4 * 2^32 for the square root of 19.
    std::uint64_t root = 0;
    for (int bit = 34; bit >= 0; --bit) {
        const std::uint64_t tried = root | std::uint64_t{1} << bit;
        // compare tried^power with prime << (32 * power), without its lowest bits' overflow
        const Wide square = Wide{tried} * tried;
        const bool fits =
            power == 2 ? square <= Wide{prime} << 64 : square <= (Wide{prime} << 96) / tried;
        if (fits) root = tried;
    }
    return static_cast<std::uint32_t>(root);
}

template <std::size_t count>
constexpr std::array<std::uint32_t, count> root_fractions(int power) {
    std::array<std::uint32_t, count> fractions{};
    std::size_t found = 0;
    for (std::uint64_t n = 2; found < count; ++n) {
        bool is_prime = true;
        for (std::uint64_t d = 2; d * d <= n; ++d) is_prime = is_prime && n % d != 0;
        if (is_prime) fractions[found++] = root_fraction(n, power);
    }
    return fractions;
}

constexpr std::array<std::uint32_t, 64> kRound = root_fractions<64>(3);
constexpr std::array<std::uint32_t, 8> kStart = root_fractions<8>(2);
static_assert(kRound[0] == 0x428a2f98u && kRound[63] == 0xc67178f2u && kStart[0] == 0x6a09e667u);

void add_block(const std::uint8_t* block, std::array<std::uint32_t, 8>& state) {
    std::array<std::uint32_t, 64> w{};
    for (std::size_t t = 0; t < 16; ++t) {
        for (std::size_t k = 0; k < 4; ++k) w[t] = w[t] << 8 | block[4 * t + k];
    }
    for (std::size_t t = 16; t < 64; ++t) {
        const std::uint32_t a = w[t - 15], b = w[t - 2];
        w[t] = (std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10)) + w[t - 7] +
               (std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3)) + w[t - 16];
    }
    auto [a, b, c, d, e, f, g, h] = state;
    for (std::size_t t = 0; t < 64; ++t) {
        const std::uint32_t one = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                                  ((e & f) ^ (~e & g)) + kRound[t] + w[t];
        const std::uint32_t two =
            (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
        h = g;
        g = f;
        f = e;
        e = d + one;
        d = c;
        c = b;
        b = a;
        a = one + two;
    }
    const std::array<std::uint32_t, 8> sum{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < 8; ++i) state[i] += sum[i];
}

}  // namespace

std::string sha256(std::span<const std::uint8_t> bytes) {
    std::array<std::uint32_t, 8> state = kStart;
    std::size_t at = 0;
    for (; bytes.size() - at >= 64; at += 64) add_block(bytes.data() + at, state);
    std::vector<std::uint8_t> last(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
    last.push_back(0x80);
    while (last.size() % 64 != 56) last.push_back(0);
    const std::uint64_t bits = std::uint64_t{8} * bytes.size();
    for (int shift = 56; shift >= 0; shift -= 8) {
        last.push_back(static_cast<std::uint8_t>(bits >> shift));
    }
    for (std::size_t i = 0; i < last.size(); i += 64) add_block(last.data() + i, state);
    std::string text;
    for (const std::uint32_t word : state) {
        char digits[9];
        std::snprintf(digits, sizeof(digits), "%08x", word);
        text += digits;
    }
    return text;
}

}  // namespace terrane::internal
