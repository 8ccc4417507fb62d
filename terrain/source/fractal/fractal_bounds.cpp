// SPDX-License-Identifier: MIT
//
// A right triangle with hypotenuse l lies in the circle of radius r = l / 2 around the middle O of its hypotenuse. A
// point p in it is sum w_i v_i of its corners v_i with w_i >= 0 and sum w_i = 1, and sum w_i |p - v_i|^2 = r^2 - |p -
// O|^2 <= r^2. The linear interpolation of the noise n of an octave is sum w_i n(v_i) at p, so
//
//   |n(p) - sum w_i n(v_i)| <= 2 sup |n|;
//   ... <= slope * sum w_i |p - v_i| <= slope * r, by Cauchy and Schwarz;
//   ... <= sum w_i curvature |p - v_i|^2 / 2 <= curvature * r^2 / 2, because the first-order terms
//   of the Taylor series at p cancel: sum w_i (v_i - p) = 0.
//
// The smallest of the three bounds is used for each octave; their sum over all octaves bounds the fractal.
#include "source/fractal/fractal_bounds.h"

#include "source/fractal/fractal_surface.h"
#include "source/fractal/noise.h"
#include "source/mesh_bounds.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace terrane {

// Each bound of an OctaveBounds is a sum of at most 24 terms of a few operations: its relative error is below 2^-45.

OctaveBounds::OctaveBounds(std::span<const OctaveScale> octaves)
    : octaves_(octaves.begin(), octaves.end()) {
    double amplitude_sum = 0.0;
    for (const OctaveScale& octave : octaves_) amplitude_sum += octave.amplitude;
    // Noise takes about twenty operations on values below 2, and the sum over octaves 24 more: the error of a computed
    // height is below 2^-46 of the sum of amplitudes. A deviation involves three heights.
    rounding_ = 0x1p-44 * amplitude_sum;
    sup_ = (kNoiseSup * amplitude_sum + rounding_) * kOutward;
}

double OctaveBounds::interpolation(double hypotenuse) const {
    double sum = rounding_;
    for (const OctaveScale& octave : octaves_) {
        const double radius = 0.5 * hypotenuse / octave.wavelength;
        sum += octave.amplitude * std::min({2.0 * kNoiseSup, kNoiseSlope * radius,
                                            0.5 * kNoiseCurvature * radius * radius});
    }
    return sum * kOutward;
}

double OctaveBounds::rise(double distance) const {
    double sum = rounding_;
    for (const OctaveScale& octave : octaves_) {
        sum += octave.amplitude *
               std::min(2.0 * kNoiseSup, kNoiseSlope * distance / octave.wavelength);
    }
    return sum * kOutward;
}

// A point p of a right triangle with hypotenuse l and corners v_i is sum w_i v_i, with w_i >= 0 and sum w_i = 1, and
// sum w_i |p - v_i|^2 <= r^2 with r = l / 2 (see the head of this file). For a function f, let
//
//   spread(f) bound (sum w_i |f(p) - f(v_i)|^2)^(1/2),   bend(f) bound |f(p) - sum w_i f(v_i)|
//
// over all such points and triangles. By Cauchy and Schwarz, bend <= spread, and neither exceeds the length of an
// interval that contains the values of f. The following rules lead from octaves to heights, with d_i = f(v_i) - f(p):
//
//   noise of a place q:  d_i = grad n . (q_i - q) + R_i, |R_i| <= curvature / 2 |q_i - q|^2, so
//                        spread <= slope spread(q),
//                        bend <= slope bend(q) + curvature / 2 spread(q)^2
//   the place p itself:  spread <= r, bend = 0, as the interpolation of a place is exact
//   q = p + (wx, wy):    spread(q) <= r + sqrt2 spread(w), bend(q) <= sqrt2 bend(w) as vectors,
//                        w either component of the warp; both have the same amplitudes
//   a f + b g:           spread and bend are at most |a| times f's plus |b| times g's (Minkowski)
//   s(f):                s(f(v_i)) - s(f(p)) = s' d_i + R_i, |R_i| <= sup |s''| / 2 d_i^2, so
//                        spread <= sup |s'| spread(f),
//                        bend <= sup |s'| bend(f) + sup |s''| / 2 spread(f)^2
//   f g:                 with e_i for g's d_i, f g differs by f(p) e_i + g(p) d_i + d_i e_i, so
//                        spread <= sup |f| spread(g) + sup |g| spread(f),
//                        bend <= sup |f| bend(g) + sup |g| bend(f) + spread(f) spread(g)
//
// Only a Lipschitz bound of s' is needed: s'' may jump at the borders of the rounded part of a crest. For ridges |s'|
// <= sqrt2 and |s''| <= 2 / c, where c is the crest rounding; for the hybrid |s'| = 1 / sqrt2 and s'' = 0. The weighted
// values v = w s of a multifractal lie between 0 and 1, and the next weight is 1 - k + k v, where k is the
// heterogeneity. If S is the slope of an octave's s, the slope of v is at most S (1 + k / 2 + k^2 / 4 + ...), so at
// most 2 S. (With the usual weight, 2 v clamped to 1, it would be S times the number of octaves.)
//
// The same rules bound the difference of f between two points r apart by the spread of f: each also holds for a single
// d_i. Sums, products and minima of non-decreasing functions of r are non-decreasing, in floating point too.

namespace {

using Deviation = FractalBounds::Deviation;

// The following bounds take a few hundred operations on numbers >= 0: their relative error is below 2^-44.

Deviation within(double length, Deviation of) {
    const double spread = std::min(of.spread, length);
    return {spread, std::min(of.bend, spread)};
}

/// Deviation of noise of wavelength 1.
Deviation noise_of(Deviation place) {
    return within(2.0 * kNoiseSup,
                  {kNoiseSlope * place.spread,
                   kNoiseSlope * place.bend + 0.5 * kNoiseCurvature * place.spread * place.spread});
}

Deviation sum_of(std::span<const OctaveScale> octaves, Deviation place) {
    Deviation sum;
    for (const OctaveScale& octave : octaves) {
        const double cells = 1.0 / octave.wavelength;  // a power of two: exact
        const Deviation noise = noise_of({place.spread * cells, place.bend * cells});
        sum.spread += octave.amplitude * noise.spread;
        sum.bend += octave.amplitude * noise.bend;
    }
    return sum;
}

std::vector<OctaveScale> make_scales(std::span<const internal::NoiseOctave> octaves) {
    std::vector<OctaveScale> scales;
    for (const internal::NoiseOctave& octave : octaves) {
        scales.push_back({octave.amplitude, std::ldexp(1.0, octave.x.shift + kUnitLog2)});
    }
    return scales;
}

}  // namespace

FractalBounds::FractalBounds(const FractalSurface& surface)
    : kind_(surface.kind()),
      octaves_(make_scales(surface.octaves())),
      warp_(make_scales(surface.warp_x())),
      sums_(octaves_),
      heterogeneity_(surface.shape().heterogeneity),
      crest_(surface.shape().crest) {
    if (kind_ == FractalKind::fbm || kind_ == FractalKind::warped) {
        range_ = {-sums_.sup(), sums_.sup()};
        if (kind_ == FractalKind::fbm) {
            rounding_ = sums_.interpolation(0.0);
            return;
        }
        // The error of each component of the warp is below 2^-43 of its sum of amplitudes; adding the component to a
        // coordinate adds at most 2^-53 of the component. A deviation involves three points.
        double displacement = 0.0;
        for (const OctaveScale& octave : warp_) displacement += octave.amplitude;
        rounding_ = 3.0 * sums_.rise(0x1p-42 * displacement);
        return;
    }
    double amplitude_sum = 0.0;
    for (const OctaveScale& octave : octaves_) amplitude_sum += octave.amplitude;
    // After the noise, shape and weight take ten operations on numbers up to 1; over at most 24 octaves their errors
    // add up to less than 2^-43 of the sum of amplitudes. A deviation involves three heights.
    rounding_ = 0x1p-41 * amplitude_sum;
    range_ = {-rounding_, (amplitude_sum + rounding_) * kOutward};
}

Deviation FractalBounds::warped(double distance, std::size_t octave_count) const {
    const Deviation warp = sum_of(warp_, {distance, 0.0});
    return sum_of(std::span(octaves_).first(octave_count),
                  {distance + kSqrt2 * warp.spread, kSqrt2 * warp.bend});
}

double FractalBounds::least_shaped() const {
    return kind_ == FractalKind::ridged ? 0.5 * crest_ : 0.0;
}

FractalBounds::Multifractal FractalBounds::multifractal(double distance,
                                                        std::size_t octave_count) const {
    const bool ridged = kind_ == FractalKind::ridged;
    const double steepest = ridged ? kSqrt2 : 0.5 * kSqrt2;
    const double half_curvature = ridged ? 1.0 / crest_ : 0.0;
    Multifractal all;
    Deviation& weight = all.weight;
    double least_weight = 1.0;
    for (const OctaveScale& octave : std::span(octaves_).first(octave_count)) {
        const Deviation noise = noise_of({distance / octave.wavelength, 0.0});
        const Deviation shaped =
            within(1.0 - least_shaped(),
                   {steepest * noise.spread,
                    steepest * noise.bend + half_curvature * noise.spread * noise.spread});
        const double least = least_shaped() * least_weight;
        const Deviation value =
            within(1.0 - least, {shaped.spread + weight.spread,
                                 shaped.bend + weight.bend + shaped.spread * weight.spread});
        all.sum.spread += octave.amplitude * value.spread;
        all.sum.bend += octave.amplitude * value.bend;
        weight = {heterogeneity_ * value.spread, heterogeneity_ * value.bend};
        least_weight = 1.0 - heterogeneity_ + heterogeneity_ * least;
    }
    return all;
}

Deviation FractalBounds::deviation(double distance) const {
    const Deviation all = kind_ == FractalKind::warped
                              ? warped(distance, octaves_.size())
                              : multifractal(distance, octaves_.size()).sum;
    return within(range_.high - range_.low,
                  {(all.spread + rounding_) * kOutward, (all.bend + rounding_) * kOutward});
}

double FractalBounds::interpolation(double hypotenuse) const {
    if (kind_ == FractalKind::fbm) return sums_.interpolation(hypotenuse);
    return deviation(0.5 * hypotenuse).bend;
}

double FractalBounds::rise(double distance) const {
    if (kind_ == FractalKind::fbm) return sums_.rise(distance);
    return deviation(distance).spread;
}

}  // namespace terrane
