// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <span>

namespace terrane::internal {

/// Checks bounds of vertices against the source's own samples: the vertical distance of a vertex from the middle of
/// the edge that it splits is at most its bound. Skips vertices whose ends are not among the samples.
///
/// @param grid    of the bounds: as HeightSource::vertex_bounds() takes it
/// @param bounds  [grid.size()] metres
/// @param samples of the heights; its step divides that of `grid`
/// @param heights [samples.size()] metres
///
/// Fails: bad_data, naming position, bound and distance, for the first vertex beyond its bound
Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights);

#if TERRANE_ASSERTS
/// Spot checks of a source while a chunk is made, in builds with asserts: its samples lie in the source's interval
/// over the chunk, and height() at some points of its cells is within the cells' bounds. Violations go to
/// the assert handler, as one line with position and figures.
///
/// @param grid        of samples
/// @param heights     [grid.size()] metres
/// @param cell_bounds [(columns - 1) * (rows - 1)] metres
void assert_source_holds(const HeightSource& source, const SampleGrid& grid,
                         std::span<const double> heights, std::span<const float> cell_bounds);
#endif

}  // namespace terrane::internal
