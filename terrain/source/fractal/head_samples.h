// SPDX-License-Identifier: MIT
#pragma once

#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"
#include "base/simd_level.h"

#include <span>
#include <vector>

namespace terrane {

/// Samples what the head of a fractal says of its heights: see FractalHead.
class HeadSamples {
public:
    /// @param surface  must outlive this
    HeadSamples(const FractalSurface& surface, const FractalHead& head, internal::SimdLevel level)
        : surface_(surface), head_(head), level_(level) {}

    /// Whether radii differ from place to place, or else all of them are FractalHead::radius.
    bool has_radii() const { return surface_.has_weights(); }

    /// Row-major, pure functions of the place and the step, a power of two.
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
