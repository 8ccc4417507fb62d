// SPDX-License-Identifier: MIT
#pragma once

#include "octave_bounds.h"

#include <terrane/terrain/fractal_heights.h>

#include <vector>

namespace terrane {

class FractalSurface;

/// A-priori bounds of a fractal of any kind, anywhere. All are rounded outward, and cover the
/// rounding of the computed heights themselves.
class FractalBounds {
public:
    /// How far a function can move within a distance: fractal_bounds.cpp says what of.
    struct Deviation {
        double spread = 0.0;
        double bend = 0.0;
    };

    explicit FractalBounds(const FractalSurface& surface);

    /// Contains all heights.
    const HeightInterval& range() const { return range_; }

    /// How far the heights can leave their linear interpolation over a right triangle whose
    /// hypotenuse is at most `hypotenuse`. Not decreasing.
    double interpolation(double hypotenuse) const;

    /// Largest difference between two points at most `distance` apart. Not decreasing.
    double rise(double distance) const;

private:
    /// Without rounding.
    Deviation warped(double distance) const;
    Deviation multifractal(double distance) const;
    Deviation deviation(double distance) const;

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
