// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/terrain/triangulator.h>

#include <cstddef>

namespace terrane::bench {

/// Result of a measurement by brute force.
struct Measured {
    double error_px = 0.0;   ///< largest screen error of a ground point inside the side planes
    std::size_t points = 0;  ///< inside the side planes
};

/// Samples 4 x 4 points a cell of the finest level in triangles up to 8 cells wide, the corners
/// of up to 64 x 64 parts of larger ones; on fractal ground, whose finest cells are too many,
/// those of 12 x 12 parts. The worst 256 triangles get four times as many along each axis, on fractal
/// ground eight times.
Measured measure_densely(const TerrainMesh& mesh, const HeightSource& source, const View& view,
                         bool is_fractal);

/// Largest vertical distance of a sample of a table from what is displayed, metres.
double measure_samples(const TerrainMesh& mesh, const test::TableHeights& source);

}  // namespace terrane::bench
