// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/terrain/result.h>

namespace terrane::internal {

/// A program that draws billboards of an impostor, and its uniforms.
struct ImpostorProgram {
    GlProgram program;
    GLint first_instance = -1, centre = -1, half_box = -1, views = -1, radius = -1, texels = -1;
};

/// The programs that draw a scene's objects.
struct ObjectPrograms {
    GlProgram meshes, particles;
    ImpostorProgram impostors;        ///< blend views, and follow their depth
    ImpostorProgram small_impostors;  ///< of few pixels: the nearest view alone
    GlVertexArray object_layout, no_layout;

    /// Fails: device_unavailable where a program is refused
    ///
    /// @param sample_count of the picture
    static Result<ObjectPrograms> create(int sample_count);
};

}  // namespace terrane::internal
