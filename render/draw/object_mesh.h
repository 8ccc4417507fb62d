// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <cstdint>

namespace terrane::internal {

/// A small mesh on the device: positions and unit normals, 6 floats a vertex.
struct ObjectMesh {
    GlBuffer vertices;
    GlBuffer indices;  ///< 16 bits
    std::int32_t index_count = 0;
};

/// A cube from -1 to 1 along each axis.
ObjectMesh make_cube();
/// A sphere of radius 1 around the origin.
ObjectMesh make_ball();
/// An open cylinder of radius 1 about z, from z = -1 to 1.
ObjectMesh make_tube();

}  // namespace terrane::internal
