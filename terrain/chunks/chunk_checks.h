// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <span>

namespace terrane::internal {

/// Whether the bounds of vertices admit what the source's own samples show: a vertex is no further from the
/// middle of the edge that it splits than its bound. Vertices whose ends are not among the samples are
/// left out.
///
/// @param grid    of the bounds: as HeightSource::vertex_bounds() takes it
/// @param bounds  [grid.size()] metres
/// @param samples of the heights; its step divides that of `grid`
/// @param heights [samples.size()] metres
///
/// Fails with bad_data, naming the place, the bound and the distance, for the first vertex that is.
Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights);

#if TERRANE_ASSERTS
/// Spot checks of a source while a chunk is made, for builds with asserts: its samples lie in the
/// source's interval over the chunk, and height() at some places of its cells is as near to them as
/// the cells' bounds say. What is wrong goes to the assert handler, as one line with place and figures.
///
/// @param grid        of samples
/// @param heights     [grid.size()] metres
/// @param cell_bounds [(columns - 1) * (rows - 1)] metres
void assert_source_holds(const HeightSource& source, const SampleGrid& grid,
                         std::span<const double> heights, std::span<const float> cell_bounds);
#endif

}  // namespace terrane::internal
