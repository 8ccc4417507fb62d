// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/polyhedron.h"

#include <Eigen/Core>

#include <span>
#include <string>

namespace terrane::test {

/// Errors of a polyhedron; empty if there are none. Loops, edges and neighbours agree; it is closed; Euler's formula
/// holds; faces are flat and convex, and so is the whole.
///
/// @param tolerance metres
std::string find_fault(const internal::Polyhedron& hull, double tolerance);

/// Errors of a polyhedron as the hull of points. Vertices are points bit for bit; no point is in front of a face, or
/// beyond the hull along any of 500 directions, by more than the tolerance.
std::string find_fault_of_hull(const internal::Polyhedron& hull,
                               std::span<const Eigen::Vector3d> points, double tolerance);

}  // namespace terrane::test
