// SPDX-License-Identifier: MIT
//
// The body of key_kernels_*.cpp: included once by each, which names TERRANE_KERNELS. Plain loops that
// compilers vectorise; only the masks are written out. Everything is of internal linkage: see
// simd_level.h.
#include "key_kernels.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace terrane::internal {
namespace {

constexpr int kMost = 129;  // samples in a row

inline float larger(float a, float b) { return a > b ? a : b; }

void own(const KeyRow& row, float* __restrict keys_out) {
    const int count = row.count;
    const float* __restrict x = row.x;
    const std::int32_t* __restrict heights = row.heights;
    const float* __restrict inverse = row.inverse_square_bounds;
    const float* __restrict across = row.across;
    const float* __restrict up = row.up;
    const float y = row.y < 0.0f ? -row.y : row.y;
    const std::int32_t base = row.height_base;
    const float quantum = row.quantum, rest = row.height_rest, near_squared = row.near_squared;
    for (int i = 0; i < count; ++i) {
        const float z = static_cast<float>(heights[i] - base) * quantum + rest;
        const float from_x = larger(__builtin_fabsf(x[i]) - across[i], 0.0f);
        const float from_y = larger(y - across[i], 0.0f);
        const float from_z = larger(__builtin_fabsf(z) - up[i], 0.0f);
        const float squared = from_x * from_x + from_y * from_y + from_z * from_z;
        keys_out[i] = larger(squared, near_squared) * inverse[i];
    }
}

void weigh(const KeyRow& row, const KeyPlanes& planes, float* __restrict keys) {
    const int count = row.count;
    const float* __restrict x = row.x;
    const std::int32_t* __restrict heights = row.heights;
    const float* __restrict across = row.across;
    const float* __restrict up = row.up;
    const float y = __builtin_fabsf(row.y);
    float z[kMost], far[kMost], beside[kMost];
    for (int i = 0; i < count; ++i) {
        z[i] = static_cast<float>(heights[i] - row.height_base) * row.quantum + row.height_rest;
        far[i] = __builtin_fabsf(x[i]) + y + __builtin_fabsf(z[i]);
        beside[i] = 0.0f;
    }
    for (int plane = 0; plane < planes.count; ++plane) {
        const float nx = planes.x[plane], ny = planes.y[plane], nz = planes.z[plane];
        const float flat = __builtin_fabsf(nx) + __builtin_fabsf(ny);
        const float steep = __builtin_fabsf(nz);
        const float from_y = ny * row.y;
        for (int i = 0; i < count; ++i) {
            // a little further in, for the rounding
            const float in = nx * x[i] + from_y + nz * z[i] + flat * across[i] + steep * up[i] +
                             far[i] * 0x1p-18f;
            beside[i] = larger(-in, beside[i]);
        }
    }
    for (int i = 0; i < count; ++i) {
        const float reach = far[i] + 2.0f * across[i] + up[i] + planes.near_distance;
        const float weight = larger(1.0f - kWeightSlope * beside[i] / reach, kLeastWeight);
        keys[i] = keys[i] / (weight * weight);
    }
}

bool trim_centres(float* __restrict keys, int count, const float* __restrict south,
                  const float* __restrict north, bool even_first, float floor) {
    float parents[kMost / 2 + 1];
    const int squares = count / 2;
    // the parents are the corners of odd index sum: south-east and north-west of an even square
    const int even = even_first ? 0 : 1;
    for (int i = 0; i < squares; ++i) {
        const float rising = larger(south[i], north[i + 1]);
        const float falling = larger(south[i + 1], north[i]);
        parents[i] = (i & 1) == even ? falling : rising;
    }
    int held = 0;
    for (int i = 0; i < squares; ++i) {
        const float key = keys[2 * i + 1];
        held |= static_cast<int>(key < floor) & static_cast<int>(key < parents[i]);
        keys[2 * i + 1] = larger(key, parents[i]);
    }
    return held != 0;
}

bool trim_between(float* __restrict keys, int count, float floor) {
    int held = 0;
    for (int i = 2; i < count - 1; i += 2) {
        const float parents = larger(keys[i - 1], keys[i + 1]);
        held |= static_cast<int>(keys[i] < floor) & static_cast<int>(keys[i] < parents);
        keys[i] = larger(keys[i], parents);
    }
    return held != 0;
}

bool trim_across(float* __restrict keys, int count, const float* __restrict south,
                 const float* __restrict north, float floor) {
    int held = 0;
    for (int i = 1; i < count; i += 2) {
        const float parents = larger(south[i], north[i]);
        held |= static_cast<int>(keys[i] < floor) & static_cast<int>(keys[i] < parents);
        keys[i] = larger(keys[i], parents);
    }
    return held != 0;
}

void take(float key, KeyWindow& window, std::uint32_t& below) {
    if (key < window.low) {
        ++below;
    } else if (key < window.high) {
        window.keys[window.count++] = key;
    }
}

std::uint32_t count(const float* keys, int count, KeyWindow& window) {
    std::uint32_t below = 0;
    int i = 0;
#if defined(__AVX512F__)
    const __m512 low = _mm512_set1_ps(window.low), high = _mm512_set1_ps(window.high);
    for (; i + 16 <= count; i += 16) {
        const __m512 key = _mm512_loadu_ps(keys + i);
        const __mmask16 is_below = _mm512_cmp_ps_mask(key, low, _CMP_LT_OQ);
        const __mmask16 is_inside =
            _mm512_mask_cmp_ps_mask(static_cast<__mmask16>(~is_below), key, high, _CMP_LT_OQ);
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        if (is_inside != 0) {
            _mm512_mask_compressstoreu_ps(window.keys + window.count, is_inside, key);
            window.count += static_cast<std::uint32_t>(__builtin_popcount(is_inside));
        }
    }
#elif defined(__AVX2__)
    const __m256 low = _mm256_set1_ps(window.low), high = _mm256_set1_ps(window.high);
    for (; i + 8 <= count; i += 8) {
        const __m256 key = _mm256_loadu_ps(keys + i);
        const auto is_below =
            static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(key, low, _CMP_LT_OQ)));
        auto is_inside =
            static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(key, high, _CMP_LT_OQ))) &
            ~is_below;
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        for (; is_inside != 0; is_inside &= is_inside - 1) {
            window.keys[window.count++] = keys[i + __builtin_ctz(is_inside)];
        }
    }
#elif defined(__SSE2__)
    const __m128 low = _mm_set1_ps(window.low), high = _mm_set1_ps(window.high);
    for (; i + 4 <= count; i += 4) {
        const __m128 key = _mm_loadu_ps(keys + i);
        const auto is_below = static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(key, low)));
        auto is_inside =
            static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(key, high))) & ~is_below;
        below += static_cast<std::uint32_t>(__builtin_popcount(is_below));
        for (; is_inside != 0; is_inside &= is_inside - 1) {
            window.keys[window.count++] = keys[i + __builtin_ctz(is_inside)];
        }
    }
#endif
    for (; i < count; ++i) take(keys[i], window, below);
    return below;
}

void mask(const float* keys, float threshold, std::uint64_t& even_out, std::uint64_t& odd_out) {
    std::uint64_t even = 0, odd = 0;
#if defined(__AVX2__)
    const __m256 limit = _mm256_set1_ps(threshold);
    for (int i = 0; i < 8; ++i) {
        // lanes 0 2 | 8 10 | 4 6 | 12 14 of sixteen, then in order
        const __m256 first = _mm256_loadu_ps(keys + 16 * i);
        const __m256 second = _mm256_loadu_ps(keys + 16 * i + 8);
        const auto pick = [&](__m256 mixed) {
            const __m256 ordered = _mm256_castpd_ps(
                _mm256_permute4x64_pd(_mm256_castps_pd(mixed), _MM_SHUFFLE(3, 1, 2, 0)));
            return static_cast<std::uint64_t>(static_cast<unsigned>(
                _mm256_movemask_ps(_mm256_cmp_ps(ordered, limit, _CMP_LT_OQ))));
        };
        even |= pick(_mm256_shuffle_ps(first, second, _MM_SHUFFLE(2, 0, 2, 0))) << (8 * i);
        odd |= pick(_mm256_shuffle_ps(first, second, _MM_SHUFFLE(3, 1, 3, 1))) << (8 * i);
    }
#elif defined(__SSE2__)
    const __m128 limit = _mm_set1_ps(threshold);
    for (int i = 0; i < 16; ++i) {
        const __m128 first = _mm_loadu_ps(keys + 8 * i);
        const __m128 second = _mm_loadu_ps(keys + 8 * i + 4);
        const __m128 evens = _mm_shuffle_ps(first, second, _MM_SHUFFLE(2, 0, 2, 0));
        const __m128 odds = _mm_shuffle_ps(first, second, _MM_SHUFFLE(3, 1, 3, 1));
        even |= static_cast<std::uint64_t>(
                    static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(evens, limit))))
                << (4 * i);
        odd |= static_cast<std::uint64_t>(
                   static_cast<unsigned>(_mm_movemask_ps(_mm_cmplt_ps(odds, limit))))
               << (4 * i);
    }
#else
    for (int i = 0; i < 64; ++i) {
        even |= static_cast<std::uint64_t>(keys[2 * i] < threshold) << i;
        odd |= static_cast<std::uint64_t>(keys[2 * i + 1] < threshold) << i;
    }
#endif
    even_out = even;
    odd_out = odd;
}

// How far a vertex is from being in place: share - 1.
inline float share_less_one(float key, float full, float slope) {
    const float share = larger(full - slope * key, 0.0f);
    return (share < 1.0f ? share : 1.0f) - 1.0f;
}

// Displayed = mean of the displayed ends + share * (height - mean of the ends' heights).
inline float slide(float less_one, float half_quantum, std::int32_t height, std::int32_t height_a,
                   std::int32_t height_b, float offset_a, float offset_b) {
    const float rise = half_quantum * (static_cast<float>(height - height_a) +
                                       static_cast<float>(height - height_b));
    return 0.5f * (offset_a + offset_b) + less_one * rise;
}

void slide_even(const OffsetRow& row) {
    const float* __restrict keys = row.keys;
    const std::int32_t* __restrict heights = row.heights;
    const float* __restrict coarse = row.coarse;
    float* __restrict offsets = row.offsets;
    const float full = row.full, slope = row.slope, half_quantum = 0.5f * row.quantum;
    const int squares = row.count / 2;
    for (int i = 0; i < squares; ++i) {
        offsets[2 * i] = coarse[i];
        offsets[2 * i + 1] =
            slide(share_less_one(keys[2 * i + 1], full, slope), half_quantum, heights[2 * i + 1],
                  heights[2 * i], heights[2 * i + 2], coarse[i], coarse[i + 1]);
    }
    offsets[2 * squares] = coarse[squares];
}

void slide_odd(const OffsetRow& row) {
    const float* __restrict keys = row.keys;
    const std::int32_t* __restrict heights = row.heights;
    const std::int32_t* __restrict heights_low = row.heights - kMost;
    const std::int32_t* __restrict heights_high = row.heights + kMost;
    const float* __restrict low = row.coarse;
    const float* __restrict high = row.coarse_high;
    float* __restrict offsets = row.offsets;
    const float full = row.full, slope = row.slope, half_quantum = 0.5f * row.quantum;
    const int squares = row.count / 2;
    // an even square's diagonal rises from its south-western corner
    const int even = row.first_is_even_square ? 0 : 1;
    for (int i = 0; i < squares; ++i) {
        offsets[2 * i] =
            slide(share_less_one(keys[2 * i], full, slope), half_quantum, heights[2 * i],
                  heights_low[2 * i], heights_high[2 * i], low[i], high[i]);
        const std::int32_t low_west = heights_low[2 * i], low_east = heights_low[2 * i + 2];
        const std::int32_t high_west = heights_high[2 * i], high_east = heights_high[2 * i + 2];
        const float from_low_west = low[i], from_low_east = low[i + 1];
        const float from_high_west = high[i], from_high_east = high[i + 1];
        const bool rises = (i & 1) == even;
        offsets[2 * i + 1] =
            slide(share_less_one(keys[2 * i + 1], full, slope), half_quantum, heights[2 * i + 1],
                  rises ? low_west : low_east, rises ? high_east : high_west,
                  rises ? from_low_west : from_low_east, rises ? from_high_east : from_high_west);
    }
    const int last = 2 * squares;
    offsets[last] = slide(share_less_one(keys[last], full, slope), half_quantum, heights[last],
                          heights_low[last], heights_high[last], low[squares], high[squares]);
}

}  // namespace

extern const KeyKernels TERRANE_KERNELS;
const KeyKernels TERRANE_KERNELS = {&own,   &weigh, &trim_centres, &trim_between, &trim_across,
                                    &count, &mask,  &slide_even,   &slide_odd};

}  // namespace terrane::internal
