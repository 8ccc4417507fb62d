// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <cstdint>

namespace terrane::test {

/// A conifer of 8 m with its foot at the origin: a trunk and three cones, with colours and without normals.
///
/// @param sides around the trunk and each cone, >= 3
TriangleMesh make_tree(int sides);

/// A boulder of about 1.5 m that reaches below the origin: a sphere with dents, closed.
///
/// @param depth cuts of an icosahedron: 20 * 4^depth triangles
TriangleMesh make_rock(int depth, std::uint64_t seed);

}  // namespace terrane::test
