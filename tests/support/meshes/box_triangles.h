// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <array>

namespace terrane::test {

/// The sides of a box whose corner i is at the higher end of the x, y and z axis where bit 0, 1 and 2 of i is set;
/// counter-clockwise from outside.
inline constexpr std::array<TriangleMesh::Triangle, 12> kBoxTriangles = {{{0, 2, 1},
                                                                          {1, 2, 3},
                                                                          {4, 5, 6},
                                                                          {5, 7, 6},
                                                                          {0, 1, 4},
                                                                          {1, 5, 4},
                                                                          {2, 6, 3},
                                                                          {3, 6, 7},
                                                                          {0, 4, 2},
                                                                          {2, 4, 6},
                                                                          {1, 3, 5},
                                                                          {3, 7, 5}}};

}  // namespace terrane::test
