// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Distance of a shape that is apart from the ground to the nearest triangle of the soup: least over
/// corners against faces and edges against edges of every triangle and every hull; `largest` where
/// none is nearer.
template <class Real>
Real brute_gap(const Soup& soup, const OracleShape& shape, const Pose& pose, Real largest);

}  // namespace terrane::test
