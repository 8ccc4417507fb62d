// SPDX-License-Identifier: MIT
//
// Let a right triangle have hypotenuse l: it lies in the circle of radius r = l / 2 around the middle
// O of its hypotenuse. A point p in it is sum w_i v_i of the corners with w_i >= 0 of sum 1,
// and sum w_i |p - v_i|^2 = r^2 - |p - O|^2 <= r^2. The interpolant at p is sum w_i n(v_i), so
//
//   |n(p) - sum w_i n(v_i)| <= 2 sup |n|;
//   ... <= slope * sum w_i |p - v_i| <= slope * r, by Cauchy and Schwarz;
//   ... <= sum w_i curvature |p - v_i|^2 / 2 <= curvature * r^2 / 2, as the terms of first order
//   of the Taylor series at p cancel: sum w_i (v_i - p) = 0.
//
// The least of the three counts for each octave; the sum over octaves bounds the fractal.
#include "source/fractal/octave_bounds.h"

#include "source/bounds/rounding.h"
#include "source/noise/noise.h"

#include <algorithm>

namespace terrane {
namespace {

/// Each bound below is a sum of at most 24 terms of a few operations: relative error below 2^-45.

}  // namespace

OctaveBounds::OctaveBounds(std::span<const OctaveScale> octaves)
    : octaves_(octaves.begin(), octaves.end()) {
    double amplitude_sum = 0.0;
    for (const OctaveScale& octave : octaves_) amplitude_sum += octave.amplitude;
    // Noise takes about twenty operations on values below 2, and the sum over octaves 24 more: a
    // computed height is within 2^-46 of the amplitudes' sum. A deviation has three heights.
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

}  // namespace terrane
