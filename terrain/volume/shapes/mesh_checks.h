// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/volume/volume_shapes.h>

namespace terrane::internal {

/// Whether a mesh that check() accepts bounds a solid: every edge has one triangle in each direction, no edge passes
/// through a triangle, and the signed volume is positive. Surfaces that only touch are accepted.
///
/// Fails: bad_data, naming an edge or two triangles
/// Cost:  O(triangles log triangles + pairs of triangles whose boxes overlap): all pairs of a fan
Result<void> check_closed(const VolumeMesh& mesh);

/// Sum of the areas of a mesh's triangles, square metres.
double surface_area(const VolumeMesh& mesh);

}  // namespace terrane::internal
