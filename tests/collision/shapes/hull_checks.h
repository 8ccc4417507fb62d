// SPDX-License-Identifier: MIT
#pragma once

#include "shapes/polyhedron.h"

#include <Eigen/Core>

#include <span>
#include <string>

namespace terrane::test {

/// What is wrong with a polyhedron as such; empty where nothing is. Loops, edges and neighbours say the
/// same; it is closed; Euler's formula holds; faces are flat and convex, and the whole is convex.
///
/// @param tolerance metres
std::string find_fault(const internal::Polyhedron& hull, double tolerance);

/// What is wrong with it as the hull of some points. Vertices are points bit for bit; no point lies in
/// front of a face, or reaches beyond the hull along any of 500 directions, by more than the tolerance.
std::string find_fault_of_hull(const internal::Polyhedron& hull,
                               std::span<const Eigen::Vector3d> points, double tolerance);

}  // namespace terrane::test
