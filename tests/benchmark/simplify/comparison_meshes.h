// SPDX-License-Identifier: MIT
#pragma once

#include "support/meshes/shapes.h"

#include <optional>
#include <string>

namespace terrane::bench {

/// side x side cells of a fractal, 4 m each, two triangles a cell.
test::ShapeMesh make_fractal_mesh(int side);

/// The points and triangles of a Wavefront OBJ file, vertices with the same coordinates as one. Nothing where it cannot
/// be read.
std::optional<test::ShapeMesh> read_obj_mesh(const std::string& path);

/// Without the vertices that no triangle uses.
test::ShapeMesh compacted(const test::ShapeMesh& mesh);

}  // namespace terrane::bench
