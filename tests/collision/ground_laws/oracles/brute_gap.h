// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Distance of a separated shape to the nearest triangle of the soup: the least over vertex-face and edge-edge pairs of
/// every triangle and every part; `largest` where none is nearer.
template <class Real>
Real brute_gap(const Soup& soup, const OracleShape& shape, const Pose& pose, Real largest);

}  // namespace terrane::test
