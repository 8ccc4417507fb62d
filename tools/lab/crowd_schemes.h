// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>

#include <array>
#include <cstddef>
#include <memory>
#include <string_view>

namespace terrane::tools {

/// Cells of the dense grid along each axis of its room.
inline constexpr std::size_t kDenseCells = 40;

/// Broadphases of a crowd: the library's, the published study's, and variants of those.
enum class CrowdScheme {
    sap,        ///< BroadphaseKind::sap
    grid,       ///< BroadphaseKind::grid
    two_scene,  ///< BroadphaseKind::two_scene, of cubes that contain a body at any rotation
    brute,      ///< compares every pair of boxes
    hashed,     ///< a hashed grid with cells as wide as the mean distance between bodies
    dense,  ///< a dense grid of 40^3 cells, all cleared in each update; a body is in every cell of its box
    centroid,  ///< the published dense grid: a body is in the cell of its centre; compares bounding spheres
};

/// The schemes in order.
inline constexpr std::array kCrowdSchemes{
    CrowdScheme::sap,    CrowdScheme::grid,  CrowdScheme::two_scene, CrowdScheme::brute,
    CrowdScheme::hashed, CrowdScheme::dense, CrowdScheme::centroid};

/// `sap`, `grid`, `two-scene`, `brute`, `hashed`, `dense` or `centroid`.
std::string_view to_string(CrowdScheme scheme);

/// Whether a scheme is given the cubes around the bodies' bounding spheres instead of their boxes.
constexpr bool is_of_cubes(CrowdScheme scheme) {
    return scheme == CrowdScheme::two_scene || scheme == CrowdScheme::centroid;
}

/// Makes a scheme's broadphase for bodies in a room, the cube from the origin to `width` along each axis, metres.
/// Bodies outside are found too, but slowly by `hashed`, `dense` and `centroid`. Its pairs are those of overlapping
/// bounds; of `centroid`, those of overlapping spheres in cubes.
std::unique_ptr<Broadphase> make_scheme(CrowdScheme scheme, double width, std::size_t body_count);

}  // namespace terrane::tools
