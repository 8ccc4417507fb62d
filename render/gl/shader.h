// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/base/result.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::internal {

// The text of the files in shaders/.
extern const std::string_view light_glsl, haze_glsl, atmosphere_glsl, point_light_glsl;
extern const std::string_view terrain_vert, depth_frag, line_frag, ground_mark_frag;
extern const std::string_view shade_vert, shade_frag, smooth_frag, block_glsl, block_frag;
extern const std::string_view solid_vert, solid_frag;
extern const std::string_view coverage_glsl, instance_vert, instance_frag;
extern const std::string_view impostor_bake_vert, impostor_bake_frag, impostor_vert, impostor_frag;
extern const std::string_view small_impostor_vert, small_impostor_frag;
extern const std::string_view particle_vert, particle_frag;
extern const std::string_view texture_glsl, textured_frag;
extern const std::string_view shadow_glsl, water_glsl, imagery_glsl, mesh_shadow_frag;
extern const std::string_view impostor_shadow_vert, impostor_shadow_frag;
extern const std::string_view ground_material_glsl;
extern const std::string_view lod_glsl, lod_keys_glsl, lod_squares_glsl, lod_morph_glsl;
extern const std::string_view lod_coarse_glsl, lod_error_glsl, lod_cells_glsl;
extern const std::string_view lod_error_least_comp, lod_cell_candidates_comp;
extern const std::string_view lod_held_candidates_comp, lod_slope_comp;
extern const std::string_view lod_coarse_candidates_comp, lod_error_comp;
extern const std::string_view lod_probe_comp, lod_above_comp;
extern const std::string_view lod_open_comp, lod_scan_comp, lod_list_comp, lod_coarse_comp;
extern const std::string_view lod_coarse_trim_comp;
extern const std::string_view lod_centres_comp, lod_midpoints_comp, lod_count_keys_comp;
extern const std::string_view lod_pick_comp, lod_masks_comp, lod_coarse_morph_comp, lod_morph_comp;
extern const std::string_view lod_count_comp, lod_coarse_mesh_comp, lod_sum_comp, lod_emit_comp,
    lod_in_place_comp;
extern const std::string_view instances_glsl, instances_cull_comp, instances_count_comp;
extern const std::string_view instances_scan_comp, instances_place_comp, instances_write_comp;
extern const std::string_view instances_casters_comp;

/// Options of the lighting of surfaces.
struct LightFeatures {
    int cascades = 0;              ///< number of shadow maps; 0: no shadows
    bool has_penumbra = false;     ///< whether the edges of shadows follow the sun's angular radius
    bool has_atmosphere = false;   ///< atmosphere.glsl in place of haze.glsl
    std::size_t point_lights = 0;  ///< most point lights; 0: none
    bool has_water = false;
    bool has_waves = false;    ///< whether the water moves
    bool has_imagery = false;  ///< whether the ground has imagery; for shade.frag
    int anisotropy = 0;        ///< of the ground's materials, for shade.frag; 0: no materials
};
/// Text to prepend to a shader that calls lit_at() or shown_at(): haze.glsl or atmosphere.glsl, shadow.glsl, water.glsl
/// and, if they are wanted, point_light.glsl, imagery.glsl and ground_material.glsl, with the macros that select the
/// features.
std::string light_text(const LightFeatures& features);

/// Compiles and links a program; light.glsl is prepended to both stages.
///
/// Fails with device_unavailable; the message has the program's name and the driver's log.
Result<GlProgram> make_program(const std::string& name, std::string_view vertex,
                               std::string_view fragment);

/// Compiles and links a program of one compute shader.
///
/// Fails as make_program()
Result<GlProgram> make_compute_program(const std::string& name, std::string_view text);

/// A hash table with linear probing that maps squares of a quadtree to numbers. It is uploaded as a buffer texture of
/// ivec4, which find_entry() of light.glsl reads.
class SquareTable {
public:
    struct Entry {
        std::int32_t x = 0, y = 0;  ///< in squares of the level, relative to the eye's square
        std::int32_t level = -1;    ///< -1: free
        std::int32_t value = 0;
    };

    /// @param count largest number of entries to be added; at least half of the places stay free
    explicit SquareTable(std::size_t count);

    /// Adds a square that is not in the table.
    ///
    /// @param x, y position in squares of the level, relative to the square with the eye; clamped to +-2^30, where a
    ///           float can no longer tell neighbouring squares apart
    void add(std::int64_t x, std::int64_t y, int level, std::int32_t value);

    std::span<const Entry> entries() const { return entries_; }
    /// Number of places minus 1.
    std::int32_t mask() const { return static_cast<std::int32_t>(entries_.size()) - 1; }

private:
    std::vector<Entry> entries_;
};
static_assert(sizeof(SquareTable::Entry) == 16);

}  // namespace terrane::internal
