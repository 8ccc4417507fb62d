// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/hull/face_merge.h"
#include "shapes/hull/hull_lattice.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Points that are far apart: each is the farthest from the point, the line, the plane of those before.
struct Simplex {
    int dimension = 0;  ///< 0 one place, 1 a line, 2 a plane, 3: beyond the tolerance
    std::array<std::uint32_t, 4> corners{};  ///< dimension + 1 of them count
    double thickness = 0.0;                  ///< of the next dimension, in lattice spacings
};

/// @param chosen at least one; @param tolerance in lattice spacings
Simplex find_simplex(const std::vector<LatticePoint>& points, std::span<const std::uint32_t> chosen,
                     double tolerance);

/// The two faces of a flat hull: the convex polygon of the points seen along the simplex's normal,
/// and the same from behind. Empty where that polygon has fewer than three corners.
std::vector<HullFace> make_flat_faces(const std::vector<LatticePoint>& points,
                                      std::span<const std::uint32_t> chosen,
                                      const Simplex& simplex);

}  // namespace terrane::internal
