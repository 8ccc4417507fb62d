// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/fractal_heights.h>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane {

/// One octave of a fractal: what its bounds depend on.
struct OctaveScale {
    double amplitude = 0.0;   ///< metres, >= 0
    double wavelength = 1.0;  ///< metres, > 0
};

/// A-priori bounds of a sum of octaves of gradient noise, anywhere, from the suprema of noise.h.
/// All are rounded outward, and cover the rounding of the computed heights themselves.
class OctaveBounds {
public:
    explicit OctaveBounds(std::span<const OctaveScale> octaves);

    /// Largest absolute value of the sum.
    double sup() const { return sup_; }

    /// How far the sum can leave its linear interpolation over a right triangle whose hypotenuse
    /// is at most `hypotenuse`. Not decreasing.
    double interpolation(double hypotenuse) const;

    /// Largest difference between two points at most `distance` apart. Not decreasing.
    double rise(double distance) const;

private:
    std::vector<OctaveScale> octaves_;
    double sup_ = 0.0;
    double rounding_ = 0.0;
};

class FractalSurface;

/// Bounds of a fractal's heights by its leading octaves, the head. Let L be their sum and w the weight that they
/// give the octaves after them (1 where the kind has none). The height lies within
///
///   L + centre + centre_slope w  +-  (radius + radius_slope w)
///
/// and over a right triangle within the linear interpolation of these limits between its corners, widened by
/// `bend`: the interpolation error of the leading octaves between samples of twice the step.
struct FractalHead {
    int octave_count = 0;
    int coarse_count = 0;  ///< leading octaves that are sampled at twice the step
    double centre = 0.0, centre_slope = 0.0;
    double radius = 0.0, radius_slope = 0.0;
    double bend = 0.0;
};

/// A-priori bounds of a fractal of any kind, anywhere. All are rounded outward, and cover the
/// rounding of the computed heights themselves.
class FractalBounds {
public:
    /// Variation of a function within a distance: its spread, and its error of linear interpolation (bend).
    /// fractal_bounds.cpp says of which functions.
    struct Deviation {
        double spread = 0.0;
        double bend = 0.0;
    };

    explicit FractalBounds(const FractalSurface& surface);

    /// Contains all heights.
    const HeightInterval& range() const { return range_; }

    /// Of the first octave, metres.
    double coarsest_wavelength() const { return octaves_.front().wavelength; }

    /// How far the heights can leave their linear interpolation over a right triangle whose
    /// hypotenuse is at most `hypotenuse`. Not decreasing.
    double interpolation(double hypotenuse) const;

    /// The head that bounds the heights best where it is sampled at the corners of right triangles of
    /// a hypotenuse; of two that are about as good the one that costs less.
    FractalHead head(double hypotenuse) const;

    /// Largest difference between two points at most `distance` apart. Not decreasing.
    double rise(double distance) const;

private:
    /// Of a head's sum and of the weight after it.
    struct Multifractal {
        Deviation sum, weight;
    };

    bool is_sum() const { return kind_ == FractalKind::fbm || kind_ == FractalKind::warped; }

    /// Of a head, without rounding. Without a warp its displacement is 0.
    Deviation warped(double distance, std::size_t octave_count) const;
    Multifractal multifractal(double distance, std::size_t octave_count) const;
    Deviation deviation(double distance) const;
    FractalHead make_head(double hypotenuse, std::size_t octave_count) const;
    double coarse_error(double hypotenuse, const FractalHead& head, int coarse_count) const;
    void add_tail(FractalHead& head) const;
    double least_shaped() const;

    FractalKind kind_;
    std::vector<OctaveScale> octaves_;
    std::vector<OctaveScale> warp_;  ///< of one axis
    OctaveBounds sums_;              ///< of octaves_
    double heterogeneity_ = 0.0;
    double crest_ = 1.0;
    double rounding_ = 0.0;
    HeightInterval range_;
};

}  // namespace terrane
