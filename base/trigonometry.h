// SPDX-License-Identifier: MIT
#pragma once

namespace terrane::internal {

/// Tangent of an angle, radians, |x| below pi / 2, without libm, so that bits do not depend on the C library; exact to
/// a few units in the last place.
///
/// Source: J. H. Lambert, 1761 (its continued fraction).
inline double tangent(double x) {
    if (x == 0.0) return 0.0;
    double tail = 0.0;
    for (int odd = 41; odd >= 1; odd -= 2) tail = x * x / (static_cast<double>(odd) - tail);
    return tail / x;
}

}  // namespace terrane::internal
