// SPDX-License-Identifier: MIT
#pragma once

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

}  // namespace terrane
