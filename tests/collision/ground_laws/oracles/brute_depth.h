// SPDX-License-Identifier: MIT
#pragma once

#include "oracle_shape.h"

namespace terrane::test {

/// Length of the shortest translation that frees an overlapping shape, if it is no longer than
/// `largest`, else infinity; metres.
///
/// Where the shape touches after the shortest translation, at most three features of it are against three
/// of the ground's, independently, and each pushes (the conditions of Karush, Kuhn and Tucker). So all
/// features that come within `largest` of touching are paired, all pairs, couples and triples of
/// pairs are solved, and of those that free the whole shape, by brute_lift, the shortest is it.
///
/// Cost: the third power of the pairs that are near: for shallow overlaps
long double brute_depth(const Soup& soup, const OracleShape& shape, const Pose& pose,
                        long double largest);

}  // namespace terrane::test
