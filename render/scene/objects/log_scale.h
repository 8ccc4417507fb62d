// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Base-2 logarithm of a positive normal number, without libm, so that results are bit-identical everywhere. Loops that
/// call it vectorise.
///
/// Source: the series of the inverse hyperbolic tangent, log(m) = 2 artanh((m - 1) / (m + 1)), for a mantissa m in
/// [1/sqrt(2), sqrt(2)). Accuracy: 2e-6 absolute.
inline float log2_of(float x) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
    // Exponent with the mantissa in [0.7071, 1.4142).
    const std::uint32_t shifted = bits - 0x3f3504f3u;
    const std::int32_t exponent = static_cast<std::int32_t>(shifted) >> 23;
    const float m = std::bit_cast<float>((shifted & 0x007fffffu) + 0x3f3504f3u);
    const float s = (m - 1.0f) / (m + 1.0f);
    const float s2 = s * s;
    // 2 / ln 2 / (1, 3, 5, 7)
    const float series =
        s * (2.88539008f + s2 * (0.961796694f + s2 * (0.577078016f + s2 * 0.412198583f)));
    return static_cast<float>(exponent) + series;
}

/// log2_of() of an error >= 0: minus infinity for 0, infinity from 1e30 on.
inline float log2_of_error(double error_m) {
    if (error_m == 0.0) return -std::numeric_limits<float>::infinity();
    if (error_m >= 1e30) return std::numeric_limits<float>::infinity();
    return log2_of(static_cast<float>(std::max(error_m, 1e-30)));
}

/// Bins of screen errors on a logarithmic scale: bin b holds the errors with kBinsPerOctave * (log2(error in pixels) -
/// kFirstOctave) in (b - 1, b]. The first bin has no lower end, and the last no upper end.
struct ErrorBins {
    static constexpr int kBinsPerOctave = 32;
    static constexpr int kFirstOctave = -10;  ///< 1/1024 pixel
    static constexpr int kLastOctave = 20;    ///< beyond any picture
    static constexpr int kCount = (kLastOctave - kFirstOctave) * kBinsPerOctave + 1;

    /// The bin of an error: upper_px() of the bin is not below the error, up to a relative 1e-6.
    static int bin_above(float log2_px) {
        const float at = (log2_px - static_cast<float>(kFirstOctave)) * kBinsPerOctave;
        if (!(at > 0.0f)) return 0;
        if (at >= static_cast<float>(kCount - 1)) return kCount - 1;
        const int whole = static_cast<int>(at);
        return static_cast<float>(whole) < at ? whole + 1 : whole;
    }
    /// The last bin whose upper_px() is not above an error, up to a relative 1e-6; -1 if there is none.
    static int bin_below(float log2_px) {
        const float at = (log2_px - static_cast<float>(kFirstOctave)) * kBinsPerOctave;
        if (!(at >= 0.0f)) return -1;
        // the last bin has no upper end
        return at >= static_cast<float>(kCount - 2) ? kCount - 2 : static_cast<int>(at);
    }
    /// Upper end of a bin, pixels.
    static double upper_px(int bin);
};

}  // namespace terrane::internal
