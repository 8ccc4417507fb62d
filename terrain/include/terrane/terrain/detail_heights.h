// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane {

/// The amplitude of detail, and the grid at whose points it vanishes, so that a raster's samples keep their heights.
struct DetailField {
    double origin_x = 0.0, origin_y = 0.0;  ///< world position of a grid point, metres
    double cell_x = 1.0, cell_y = 1.0;      ///< of the grid, metres: wavelength of the first octave
    int columns = 0, rows = 0;              ///< amplitude nodes, >= 1
    double node_origin_x = 0.0, node_origin_y = 0.0;    ///< world position of node (0, 0), metres
    double node_spacing_x = 1.0, node_spacing_y = 1.0;  ///< between nodes, metres
    /// [rows * columns] from the south-west: amplitude of the first octave, metres, >= 0; bilinear
    /// between nodes, constant beyond them.
    std::vector<float> amplitude;
};

/// Settings of DetailHeights. Fixed once it is created.
struct DetailSettings {
    std::uint64_t seed = 1;  ///< of the noise
    int octave_count = 6;    ///< 1 to 24
    double gain = 0.5;       ///< amplitude ratio of successive octaves, > 0 to 1
};

/// A source plus fractal detail; its bounds are the sums of both.
/// Fails: invalid_argument for settings out of range or a field that is not finite
Result<std::shared_ptr<const HeightSource>> add_detail(std::shared_ptr<const HeightSource> base,
                                                       DetailField field,
                                                       const DetailSettings& settings);

}  // namespace terrane
