// SPDX-License-Identifier: MIT
#pragma once

#include "reference_maps.h"

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::test {

/// A triangulation of a table over some of its samples.
struct TableMesh {
    std::vector<std::array<int, 2>> vertices;             ///< column and row
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from above
};

/// Largest vertical distance of a sample from the mesh, metres, by looking at every sample of every
/// triangle; infinite where the triangles do not cover the table once.
double measure_error(const HeightTable& table, const TableMesh& mesh);

/// Greedy insertion into a Delaunay triangulation: the sample that is furthest off goes in next,
/// until none is further off than `tolerance` metres.
TableMesh make_greedy_tin(const HeightTable& table, double tolerance);

/// The smallest conforming longest-edge bisection of a square table of 2^n + 1 samples a side that
/// has no sample further off than `tolerance` metres in any triangle that could still be split.
TableMesh make_minimal_closure(const HeightTable& table, double tolerance);

}  // namespace terrane::test
