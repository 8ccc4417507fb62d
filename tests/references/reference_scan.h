// SPDX-License-Identifier: MIT
#pragma once

#include "reference_maps.h"

#include <array>
#include <cstdint>

namespace terrane::test {

/// Column and row of a sample.
using Place = std::array<int, 2>;

/// Twice the signed area of a triangle, positive where it is counter-clockwise.
inline std::int64_t cross(const Place& a, const Place& b, const Place& c) {
    return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{c[0] - a[0]} * (b[1] - a[1]);
}

struct Worst {
    double error = 0.0;
    Place place{};
};

/// The sample of a closed triangle that is furthest from its plane.
///
/// @param corners  counter-clockwise, of positive area
Worst find_worst(const HeightTable& table, const std::array<Place, 3>& corners);

}  // namespace terrane::test
