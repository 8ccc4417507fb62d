// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/fractal_heights.h>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane {

/// The scale of one octave, which determines its bounds.
struct OctaveScale {
    double amplitude = 0.0;   ///< metres, >= 0
    double wavelength = 1.0;  ///< metres, > 0
};

/// A-priori bounds of a sum of octaves of gradient noise, valid everywhere, derived from the suprema in noise.h. All
/// are rounded outward and include the rounding errors of computed heights.
class OctaveBounds {
public:
    explicit OctaveBounds(std::span<const OctaveScale> octaves);

    /// Largest absolute value of the sum.
    double sup() const { return sup_; }

    /// Bound of the deviation from linear interpolation over right triangles with at most this hypotenuse; a
    /// non-decreasing function of the hypotenuse.
    double interpolation(double hypotenuse) const;

    /// Bound of the difference between two points at most `distance` apart; a non-decreasing function of `distance`.
    double rise(double distance) const;

private:
    std::vector<OctaveScale> octaves_;
    double sup_ = 0.0;
    double rounding_ = 0.0;
};

class FractalSurface;

/// Bounds of a fractal's heights from its leading octaves, the head. At a position, let L be the sum of these octaves
/// and w the weight that they pass to the following octaves (1 for kinds without weights). The height lies within
///
///   L + centre + centre_slope w  +-  (radius + radius_slope w).
///
/// Over a right triangle the height lies between the linear interpolations of these limits from the corners, widened by
/// `bend`: the interpolation error of the leading octaves, including that of octaves sampled at twice the step.
struct FractalHead {
    int octave_count = 0;
    int coarse_count = 0;  ///< leading octaves that are sampled at twice the step
    double centre = 0.0, centre_slope = 0.0;
    double radius = 0.0, radius_slope = 0.0;
    double bend = 0.0;
};

/// A-priori bounds of a fractal of any kind, valid everywhere. All are rounded outward and include the rounding errors
/// of computed heights.
class FractalBounds {
public:
    /// Variation of a function within a distance: its spread, and its error of linear interpolation (bend). Defined in
    /// fractal_bounds.cpp.
    struct Deviation {
        double spread = 0.0;
        double bend = 0.0;
    };

    explicit FractalBounds(const FractalSurface& surface);

    /// Contains all heights, metres.
    const HeightInterval& range() const { return range_; }

    /// Wavelength of the first octave, metres.
    double coarsest_wavelength() const { return octaves_.front().wavelength; }

    /// Bound of the deviation of the heights from linear interpolation over right triangles with at most this
    /// hypotenuse; a non-decreasing function of the hypotenuse.
    double interpolation(double hypotenuse) const;

    /// The head with the tightest bounds for samples at the corners of right triangles with this hypotenuse, or one
    /// with similar bounds that costs less.
    FractalHead head(double hypotenuse) const;

    /// Bound of the difference between two points at most `distance` apart; a non-decreasing function of `distance`.
    double rise(double distance) const;

private:
    /// Deviations of the sum of a head, and of the weight after the head.
    struct Multifractal {
        Deviation sum, weight;
    };

    bool is_sum() const { return kind_ == FractalKind::fbm || kind_ == FractalKind::warped; }

    /// Deviation of the head of a sum, without rounding errors. A sum without a warp is displaced by 0.
    Deviation warped(double distance, std::size_t octave_count) const;
    Multifractal multifractal(double distance, std::size_t octave_count) const;
    Deviation deviation(double distance) const;
    FractalHead make_head(double hypotenuse, std::size_t octave_count) const;
    double coarse_error(double hypotenuse, const FractalHead& head, int coarse_count) const;
    void add_tail(FractalHead& head) const;
    double least_shaped() const;

    FractalKind kind_;
    std::vector<OctaveScale> octaves_;
    std::vector<OctaveScale> warp_;  ///< of either axis
    OctaveBounds sums_;              ///< of octaves_
    double heterogeneity_ = 0.0;
    double crest_ = 1.0;
    double rounding_ = 0.0;
    HeightInterval range_;
};

}  // namespace terrane
