// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>

#include <span>
#include <vector>

namespace terrane {

/// Difference between pictures of an impostor and of its mesh at one size, over the pixels that either covers.
struct ImpostorDifference {
    double diameter_px = 0.0;  ///< of the mesh's bounding sphere
    double mean = 0.0;         ///< of the largest difference of a pixel's channels, 0 to 255
    double share = 0.0;        ///< of pixels with a channel that differs by more than 8, 0 to 1
    /// `mean` over that of the mesh and the same mesh displaced by a pixel along the picture's diagonal: a displacement
    /// of the mesh's picture, pixels, that would be seen as much.
    double displacement_px = 0.0;
};

/// When an impostor may stand for its mesh.
struct ImpostorError {
    std::vector<ImpostorDifference> sizes;  ///< by diameter, the smallest first
    /// Largest diameter asked for up to which, smaller ones included, displacement_px is at most the accepted one; 0:
    /// none.
    double takeover_px = 0.0;
    /// For ObjectLevel::error_m: the accepted displacement where the mesh's diameter is takeover_px, metres. Infinity
    /// where takeover_px is 0: the impostor is never good enough.
    double error_m = 0.0;
};

/// Draws a mesh and its impostor alone before the sky, from 8 sides and at the elevations that the impostor is for, and
/// compares. Most of the directions lie between the impostor's views.
///
/// @param renderer     its last frame is replaced, and its counts
/// @param mesh         that `mesh_id` was made from
/// @param has_ring     whether ImpostorSettings::views_above is 1: from level alone, else from 0, 34 and 74 degrees
///                     above
/// @param diameters_px each above 0 and at most the shorter side of the renderer's picture
/// @param accepted_px  largest displacement accepted, > 0
///
/// Fails: invalid_argument for a mesh without extent, an argument out of range and as TerrainRenderer::draw()
/// Cost:  32 or 96 draws and reads of a picture for each diameter
Result<ImpostorError> measure_impostor(TerrainRenderer& renderer, const TriangleMesh& mesh,
                                       MeshId mesh_id, ImpostorId impostor, bool has_ring,
                                       std::span<const double> diameters_px,
                                       double accepted_px = 1.0);

}  // namespace terrane
