// SPDX-License-Identifier: MIT
#pragma once

#include "render/scene.h"

namespace terrane::test {

/// A world of two roots of 256 m beside each other from the origin east, with samples 2 m apart on a plane.
///
/// @param height     at x = 256, between the roots, metres
/// @param slope_east rise over run
Scene make_plane_scene(double height = 0.0, double slope_east = 0.0);

/// Raises the western root's triangles as a whole by offsets: a sheet above x = 0 to 256.
void raise_western_root(Scene& scene, float by);

}  // namespace terrane::test
