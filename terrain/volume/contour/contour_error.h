// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/solid_surface.h>
#include <terrane/volume/placed_volume.h>
#include <terrane/volume/volume_contour.h>
#include <terrane/volume/volume_tile.h>

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Bounds of the distance between a contour and the true surface, both ways, in boxes of a few cells.
struct ContourErrors {
    std::vector<SolidErrorBox> boxes;  ///< around all triangles of theirs
    std::vector<std::uint32_t>
        box_of;  ///< [triangles] index of the box that bounds a triangle's error
};

/// Bounds the error of a tile's contour.
///
/// Where one smooth piece of one shape alone is near, by its curvature; everywhere else, as in creases, beside the
/// heightfield, and of sampled shapes, by the diameter of the tetrahedra, VolumeContour::error_m.
///
/// Argument: let F be the composed distance and L its linear interpolant over the tetrahedra, |F - L| <= E. The tile's
/// contour is where L = 0. From a point of it, F has different signs at the ends of the normal of length E to both
/// sides, as F is there the distance of the one piece; from a point of the true surface, so has L. The interpolant of
/// a function whose second derivatives are at most H is off by at most H r^2 / 2, where r is the radius of the
/// tetrahedron's least enclosing ball (S. Waldron. The error in linear interpolation at the vertices of a simplex. SIAM
/// J. Numer. Anal. 35, 1998); r^2 <= 3/8 of its squared diameter (Jung). The distance of a capsule of radius R has H =
/// 1 / (R - d) where it is at least -d; that of a box beside one face has 0. Two capsules of a tube that meet at an
/// angle a: F is the less of two such functions, whose gradients differ by at most 2 sin(a / 2) where they are equal.
///
/// @param operations those that touch the tile, in any order. With more than 64 every error is that of tetrahedra
///
/// Cost: O(triangles + boxes * parts of shapes over the tile)
ContourErrors bound_errors(const VolumeContour& contour, const VolumeTile& tile,
                           std::span<const PlacedVolume* const> operations);

}  // namespace terrane::internal
