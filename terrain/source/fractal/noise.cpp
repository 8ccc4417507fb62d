// SPDX-License-Identifier: MIT
//
// Sources:
//   Perlin. Improving Noise. SIGGRAPH 2002. (gradient noise with a quintic fade)
//   Steele, Lea, Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014. (hash: Stafford's mix 13)
// Deviations: 64-bit nodes, 64 unit gradients; gradients are blended along y first, so that each sample of a row in one
// cell costs four products. noise_kernels_impl.h does the same operations in the same order for rows.
//
// Bounds. In a cell, n(p) = sum over its four nodes c of w_c(p) g_c . (p - c). The weights w_c = wx wy >= 0 sum to 1;
// wx is f(tx) or 1 - f(tx) with f(t) = 6 t^5 - 15 t^4 + 10 t^3, and wy likewise. As |g_c| = 1:
//
//   |n| <= sum w_c |p - c| <= sqrt(sum w_c |p - c|^2) = sqrt(q(tx) + q(ty)),
//   q(t) = (1 - f) t^2 + f (1 - t)^2. With t = 1/2 + u: q = 1/4 - u^2 (11/4 - 10 u^2 + 12 u^4), and
//   for u^2 <= 1/4 the bracket is positive; so q <= 1/4 and |n| <= sqrt(1/2). This is attained if all
//   gradients point to the middle of a cell.
//
//   Derivative along a unit vector e: sum g_c . (w_c e + (e . grad w_c) (p - c)), so
//   |grad n| <= max over p, e of sum |w_c e + (e . grad w_c) (p - c)| = 2.0691181...,
//   attained at the middle, e along an axis: 4 |(1/4 - 15/32, 15/32)|.
//
//   Second derivative along e: sum g_c . (2 (e . grad w_c) e + (e' grad^2 w_c e) (p - c)), so its norm
//   is at most the maximum of sum |2 (e . grad w_c) e + (e' grad^2 w_c e) (p - c)| = 9.2354350...,
//   on the cell's diagonal at 0.3555, e along it. The Hessian is symmetric: its operator norm is the
//   largest second derivative along any e.
//
// Both maxima are over three numbers (p and the angle of e); noise_test bounds them by interval arithmetic. First and
// second derivatives of f vanish at 0 and 1, so the bounds also hold across cells. The tables' gradients have unit
// length to 2^-53; the constants are rounded up by more than that.
#include "source/fractal/noise.h"

#include "source/fractal/noise_kernels.h"

#include <array>
#include <cstddef>

namespace terrane {
namespace {

struct Gradient {
    double x, y;
};

constexpr std::array<Gradient, 64> make_gradients() {
    std::array<Gradient, 64> gradients{};
    for (std::size_t index = 0; index < 64; ++index) {
        const double x = internal::kNoiseCosines[index & 15];
        const double y = internal::kNoiseCosines[15 - (index & 15)];  // sin(a) = cos(pi / 2 - a)
        gradients[index] = {(index & 16) != 0 ? -x : x, (index & 32) != 0 ? -y : y};
    }
    return gradients;
}

constexpr std::array<Gradient, 64> kGradients = make_gradients();

const Gradient& gradient(std::uint64_t x_hash, std::uint64_t y_hash) {
    // both hashes are well mixed; a product and a fold remove the linearity of ^
    std::uint64_t hash = (x_hash ^ y_hash) * internal::kNodeFirst;
    hash = (hash ^ (hash >> 32)) * internal::kNodeSecond;
    return kGradients[hash >> 58];
}

/// A column of two nodes as seen from a row of samples: their gradients blended along y, as a linear function of x.
struct Blend {
    double slope = 0.0;
    double offset = 0.0;
};

Blend blend(std::uint64_t x_hash, const NoisePlace& y) {
    const Gradient& low = gradient(x_hash, y.low_hash);
    const Gradient& high = gradient(x_hash, y.high_hash);
    const double low_offset = low.y * y.fraction;
    const double high_offset = high.y * (y.fraction - 1.0);
    return {low.x + y.fade * (high.x - low.x), low_offset + y.fade * (high_offset - low_offset)};
}

double blend_along_x(const Blend& low, const Blend& high, double fraction, double fade) {
    const double from_low = low.slope * fraction + low.offset;
    const double from_high = high.slope * (fraction - 1.0) + high.offset;
    return from_low + fade * (from_high - from_low);
}

}  // namespace

std::uint64_t mix64(std::uint64_t value) {
    value = (value ^ (value >> 30)) * internal::kMixFirst;
    value = (value ^ (value >> 27)) * internal::kMixSecond;
    return value ^ (value >> 31);
}

double quintic_fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

NoiseKeys NoiseKeys::make(std::uint64_t seed, int octave) {
    const std::uint64_t key =
        mix64(mix64(seed + 0x9e3779b97f4a7c15u) + static_cast<std::uint64_t>(octave));
    return {mix64(key ^ 0x243f6a8885a308d3u), mix64(key ^ 0x13198a2e03707344u)};
}

NoiseCoordinate noise_coordinate(const internal::NoiseAxis& axis, std::uint64_t units,
                                 double rest) {
    const std::uint64_t shifted = units + axis.offset;
    const std::uint64_t inside = shifted & ((std::uint64_t{1} << axis.shift) - 1);
    const double fraction =
        (static_cast<double>(static_cast<std::int64_t>(inside)) + rest) * axis.cells_per_unit;
    return {shifted >> axis.shift, fraction};
}

NoisePlace noise_place(const internal::NoiseAxis& axis, std::uint64_t units, double rest) {
    return noise_place(axis.key, ~std::uint64_t{0} >> axis.shift,
                       noise_coordinate(axis, units, rest));
}

NoisePlace noise_place(std::uint64_t axis_key, std::uint64_t cell_mask,
                       NoiseCoordinate coordinate) {
    return {coordinate.cell, mix64(axis_key + (coordinate.cell & cell_mask)),
            mix64(axis_key + ((coordinate.cell + 1) & cell_mask)), coordinate.fraction,
            quintic_fade(coordinate.fraction)};
}

double noise(const NoisePlace& x, const NoisePlace& y) {
    return blend_along_x(blend(x.low_hash, y), blend(x.high_hash, y), x.fraction, x.fade);
}

}  // namespace terrane

namespace terrane::internal {

const NoiseKernels& noise_kernels(SimdLevel level) {
#if defined(__x86_64__)
    if (level == SimdLevel::avx512) return kNoiseKernelsAvx512;
    if (level == SimdLevel::avx2) return kNoiseKernelsAvx2;
#else
    static_cast<void>(level);
#endif
    return kNoiseKernelsBaseline;
}

}  // namespace terrane::internal
