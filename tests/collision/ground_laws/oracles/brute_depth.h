// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Length of the minimum translation of an overlapping shape, if it is at most `largest`, else infinity; metres.
///
/// At the minimum at most three pairs of features are active constraints with multipliers >= 0 (the conditions of
/// Karush, Kuhn and Tucker). So all pairs of features within `largest` of touching are found, all sets of one to three
/// of them are solved, and the result is the shortest solution that separates the whole shape by brute_lift.
///
/// Cost: the third power of the number of near pairs: for shallow overlaps
long double brute_depth(const Soup& soup, const OracleShape& shape, const Pose& pose,
                        long double largest);

}  // namespace terrane::test
