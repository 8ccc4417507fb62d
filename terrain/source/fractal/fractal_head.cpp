// SPDX-License-Identifier: MIT
//
// A head consists of the first m octaves of a fractal; the others, its tail, are too fine to be bounded by samples, and
// are bounded by their suprema.
//
//   sums:           |tail| <= sup |n| (a_m + a_(m+1) + ...): a constant radius.
//   multifractals:  v_i = w_i s_i with 0 <= s_min <= s_i <= 1, and w_(i+1) = 1 - k + k v_i grows with
//                   v_i. So the tail lies between the sums that s_i = s_min and s_i = 1 give, both
//                   of them linear functions of w_m: centre +- radius.
//
// L + centre + radius and L + centre - radius are linear functions of L and w_m, with slopes in w_m
// between 0 and centre_slope + radius_slope. Over a triangle both leave their interpolation by at most
// bend(L) + (centre_slope + radius_slope) bend(w_m), and the height lies between them.
//
// The first octaves of a head may be interpolated themselves, from samples of twice the step, which
// are corners of right triangles of twice the hypotenuse. Their sum is off by at most its bend there.
// So is the weight w that they leave; octave i adds a_i v_i, off by a_i times the error of w_i, and
// leaves k times that error to w_(i+1), as 0 <= s_i <= 1.
//
// `rounding_` is there twice: for the heights at a triangle's corners and for the samples.
#include "source/bounds/rounding.h"
#include "source/fractal/fractal_bounds.h"
#include "source/noise/noise.h"

#include <cstddef>
#include <span>

namespace terrane {
/// Interval of the tail.
void FractalBounds::add_tail(FractalHead& head) const {
    const auto tail = std::span(octaves_).subspan(static_cast<std::size_t>(head.octave_count));
    if (is_sum()) {
        for (const OctaveScale& octave : tail) head.radius += kNoiseSup * octave.amplitude;
        return;
    }
    // least and largest value of an octave's weight, as linear functions of w
    double low = 0.0, low_slope = 1.0, high = 0.0, high_slope = 1.0;
    const double least = least_shaped();
    for (const OctaveScale& octave : tail) {
        const double half = 0.5 * octave.amplitude;
        head.centre += half * (high + least * low);
        head.centre_slope += half * (high_slope + least * low_slope);
        head.radius += half * (high - least * low);
        head.radius_slope += half * (high_slope - least * low_slope);
        low = 1.0 - heterogeneity_ + heterogeneity_ * least * low;
        low_slope *= heterogeneity_ * least;
        high = 1.0 - heterogeneity_ + heterogeneity_ * high;
        high_slope *= heterogeneity_;
    }
}

FractalHead FractalBounds::make_head(double hypotenuse, std::size_t octave_count) const {
    FractalHead head;
    head.octave_count = static_cast<int>(octave_count);
    add_tail(head);
    const double radius = 0.5 * hypotenuse;
    if (is_sum()) {
        head.bend = warped(radius, octave_count).bend;
    } else {
        const Multifractal own = multifractal(radius, octave_count);
        head.bend = own.sum.bend + (head.centre_slope + head.radius_slope) * own.weight.bend;
    }
    head.bend = (head.bend + 2.0 * rounding_) * kOutward;
    return head;
}

/// Error bound of the head's centre plus radius if its first octaves are interpolated.
double FractalBounds::coarse_error(double hypotenuse, const FractalHead& head,
                                   int coarse_count) const {
    const double radius = 0.5 * hypotenuse;
    const auto count = static_cast<std::size_t>(coarse_count);
    if (is_sum()) return warped(radius, count).bend * kOutward;
    const Multifractal coarse = multifractal(radius, count);
    double error = coarse.sum.bend, of_weight = coarse.weight.bend;
    for (int octave = coarse_count; octave < head.octave_count; ++octave) {
        error += octaves_[static_cast<std::size_t>(octave)].amplitude * of_weight;
        of_weight *= heterogeneity_;
    }
    return (error + (head.centre_slope + head.radius_slope) * of_weight) * kOutward;
}

FractalHead FractalBounds::head(double hypotenuse) const {
    // largest bend of an octave, as a share of the radius that it removes
    constexpr double kWorthwhile = 0.75;
    const auto radius_of = [](const FractalHead& head) { return head.radius + head.radius_slope; };
    FractalHead best = make_head(hypotenuse, 0);
    while (best.octave_count < static_cast<int>(octaves_.size())) {
        const FractalHead longer =
            make_head(hypotenuse, static_cast<std::size_t>(best.octave_count) + 1);
        const double gain = radius_of(best) - radius_of(longer);
        if (longer.bend - best.bend > kWorthwhile * gain) break;
        best = longer;
    }
    constexpr double kShare = 0.125;  // of the bound, accepted for fewer samples
    const double most = kShare * (best.bend + radius_of(best));
    double error = 0.0;
    while (best.coarse_count < best.octave_count) {
        const double longer = coarse_error(2.0 * hypotenuse, best, best.coarse_count + 1);
        if (longer > most) break;
        error = longer;
        ++best.coarse_count;
    }
    best.bend += error;
    return best;
}

}  // namespace terrane
