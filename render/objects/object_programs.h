// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/terrain/result.h>

namespace terrane::internal {

/// The programs that draw a scene's objects, and what they read.
struct ObjectPrograms {
    GlProgram meshes, impostors, particles;
    GLint centre = -1, half_box = -1, views = -1, radius = -1, texels = -1;  ///< of impostors
    GlVertexArray object_layout, particle_layout;

    /// Fails: device_unavailable where a program is refused
    ///
    /// @param sample_count of the picture
    static Result<ObjectPrograms> create(int sample_count);
};

}  // namespace terrane::internal
