// SPDX-License-Identifier: MIT
#pragma once

#include "base/simd_level.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"

#include <span>
#include <vector>

namespace terrane {

/// Samples the bounds of heights by a fractal's head: see FractalHead.
class HeadSamples {
public:
    /// @param surface  must outlive this
    HeadSamples(const FractalSurface& surface, const FractalHead& head, internal::SimdLevel level)
        : surface_(surface), head_(head), level_(level) {}

    /// Whether radii vary; else all are FractalHead::radius.
    bool has_radii() const { return surface_.has_weights(); }

    /// Centres and radii, row-major: pure functions of position and step, a power of two.
    ///
    /// @param radii_out  empty where has_radii() is false
    void sample(const UnitGrid& grid, std::span<double> centres_out, std::span<double> radii_out);

private:
    const FractalSurface& surface_;
    FractalHead head_;
    internal::SimdLevel level_;
    std::vector<double> sums_, weights_;  ///< at twice the step
};

}  // namespace terrane
