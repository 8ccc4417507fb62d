// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>

#include <array>
#include <memory>

namespace terrane::tools {

/// Whether two closed boxes have a point in common.
inline bool overlap(const Aabb& a, const Aabb& b) {
    return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
}

/// Cells of a dense grid along each axis of its room, as published.
inline constexpr std::size_t kDenseCells = 40;

/// The published dense grid over the cube from the origin to `width` along each axis: a list of bodies for each of
/// 40^3 cells, all of them cleared in every update. Bodies beyond the cube lie in its border cells.
std::unique_ptr<Broadphase> make_dense_grid(double width);

/// The grid that the published study wanted: only the cells that boxes lie in, by a hash of their coordinates. Time and
/// memory of an update are linear in the bodies. Cells are as wide as the mean distance of the bodies, so that a
/// body of usual size lies in little more than one; wider where boxes would fill more than 64 cells each on average.
///
/// Sources:    M. Teschner et al. Optimized spatial hashing for collision detection of deformable objects. 2003
/// Deviations: buckets are sorted by counting instead of linked lists; a pair is taken in one cell only, that of the
///             low corner of the intersection of both boxes, instead of being compared with the pairs found before.
std::unique_ptr<Broadphase> make_hashed_grid(double width, std::size_t body_count);

}  // namespace terrane::tools
