// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <terrane/terrain/solid_surface.h>
#include <terrane/volume/volume_tile.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Contours a tile: marches the tetrahedra of all columns, and clips the triangles of the heightfield that have a
/// sample in the void or in added solid.
///
/// @param closes whether to make the western, eastern, southern and northern cap
VolumeContour contour_tile(const TileLevelSet& level_set, const TileLines& lines,
                           const VolumeTileKey& key, const std::array<bool, 4>& closes);

/// Upper bounds of the Hausdorff distance between a contour and the true surface, one per box of 4 x 4 x 4 cells.
struct ContourErrors {
    std::vector<SolidErrorBox> boxes;   ///< each encloses its triangles
    std::vector<std::uint32_t> box_of;  ///< [triangles] index of the triangle's box
};

/// Bounds the error of a tile's contour.
///
/// Where only a single smooth part of one shape is near, the bound follows from its curvature. Everywhere else, such as
/// at creases, beside the heightfield and for sampled shapes, it is the diameter of the tetrahedra,
/// VolumeContour::error_m.
///
/// Argument: let F be the composed distance and L its linear interpolant over the tetrahedra, |F - L| <= E. The tile's
/// contour is the set L = 0, and F is the signed distance of the single part. So F changes sign along the normal within
/// E of each point of the contour, and L within E of each point of the true surface. The interpolant of a function
/// whose second derivatives are at most H has an error of at most H r^2 / 2, where r is the radius of the tetrahedron's
/// smallest enclosing ball (S. Waldron. The error in linear interpolation at the vertices of a simplex. SIAM J. Numer.
/// Anal. 35, 1998); r^2 <= 3/8 of its squared diameter (Jung). The distance of a capsule of radius R has H = 1 / (R -
/// d) where it is at least -d; the distance of a box beside one face has H = 0. Two capsules of a tube that meet at an
/// angle a: F is the minimum of two such functions, whose gradients differ by at most 2 sin(a / 2) where they are
/// equal, if neither segment is shorter than (R + d) sin a.
///
/// Limit: the heightfield beyond the tile is unknown; at the tile's border its slope is assumed to be no larger than
/// inside.
///
/// @param operations that touch the tile, in any order. With more than 64, every error is the diameter of the
///                   tetrahedra
///
/// Cost: O(triangles + boxes * parts of shapes over the tile)
ContourErrors bound_errors(const VolumeContour& contour, const VolumeTile& tile,
                           std::span<const PlacedVolume* const> operations);

}  // namespace terrane::internal
