// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/terrain/result.h>

#include <span>
#include <string>
#include <string_view>

namespace terrane::internal {

// The text of the files in shaders/.
extern const std::string_view light_glsl;
extern const std::string_view terrain_vert, depth_frag, line_frag;
extern const std::string_view object_vert, object_frag;
extern const std::string_view shade_vert, shade_frag;
extern const std::string_view solid_vert, solid_frag;
extern const std::string_view coverage_glsl, instance_vert, instance_frag;
extern const std::string_view impostor_bake_vert, impostor_bake_frag, impostor_vert, impostor_frag;
extern const std::string_view small_impostor_vert, small_impostor_frag;
extern const std::string_view particle_vert, particle_frag;
extern const std::string_view shadow_glsl, water_glsl, imagery_glsl, mesh_shadow_frag;
extern const std::string_view impostor_shadow_vert, impostor_shadow_frag;

/// Options of the lighting of surfaces.
struct LightFeatures {
    int cascades = 0;  ///< of shadow maps; 0: no shadows
    bool has_water = false;
    bool has_imagery = false;  ///< of the ground: for shade.frag
};
/// Text that goes before a shader which calls lit_at() or shown_at(): shadow.glsl and water.glsl.
std::string light_text(const LightFeatures& features);

/// Compiles and links a program; light.glsl is prepended to both stages.
///
/// Fails with device_unavailable, naming the program, with the driver's log.
Result<GlProgram> make_program(const std::string& name, std::string_view vertex,
                               std::string_view fragment);

}  // namespace terrane::internal
