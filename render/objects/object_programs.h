// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/store/impostor_store.h"

#include <terrane/terrain/result.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace terrane::internal {

/// A program that draws billboards of an impostor, and its uniforms.
struct ImpostorProgram {
    GlProgram program;
    GLint first_instance = -1, centre = -1, half_box = -1, views = -1, radius = -1, texels = -1;

    /// Sets the uniforms of the current program.
    void set(const StoredImpostor& impostor, std::uint32_t first) const;
};
/// Fails: device_unavailable where the program is refused
Result<ImpostorProgram> make_impostor_program(const std::string& name, std::string_view vertex,
                                              std::string_view fragment);

/// The programs that draw a scene's objects.
struct ObjectPrograms {
    GlProgram meshes, particles;
    ImpostorProgram impostors;        ///< blend views, and follow their depth
    ImpostorProgram small_impostors;  ///< of few pixels: the nearest view alone
    GlVertexArray object_layout, no_layout;

    /// Fails: device_unavailable where a program is refused
    ///
    /// @param sample_count of the picture
    /// @param lighting     text that goes before shaders: defines lit_at() and shown_at()
    static Result<ObjectPrograms> create(int sample_count, const std::string& lighting);
};

}  // namespace terrane::internal
