// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/hull/face_merge.h"
#include "shapes/hull/hull_lattice.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Initial simplex: each corner is the farthest from the point, line or plane of the previous ones.
struct Simplex {
    int dimension = 0;  ///< of the points within the tolerance: 0 point, 1 line, 2 plane, 3 solid
    std::array<std::uint32_t, 4> corners{};  ///< the first dimension + 1 are valid
    double thickness = 0.0;                  ///< extent in the next dimension, in lattice spacings
};

/// @param chosen at least one; @param tolerance in lattice spacings
Simplex find_simplex(const std::vector<LatticePoint>& points, std::span<const std::uint32_t> chosen,
                     double tolerance);

/// The two faces of a flat hull: the convex polygon of the points projected along the simplex's normal, and its
/// reverse. Empty where that polygon has fewer than three corners.
std::vector<HullFace> make_flat_faces(const std::vector<LatticePoint>& points,
                                      std::span<const std::uint32_t> chosen,
                                      const Simplex& simplex);

}  // namespace terrane::internal
