// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/triangle_mesh.h>

namespace terrane::tools {

/// Whether two shapes have equal sizes, vertices and parts.
bool is_same_shape(const Shape& a, const Shape& b);

/// The surface of a shape as a mesh, in one colour for each kind of shape; hulls have flat faces.
///
/// Fails: invalid_argument for sizes above 1e5 m, and for a hull without faces
Result<TriangleMesh> make_shape_mesh(const Shape& shape);

}  // namespace terrane::tools
