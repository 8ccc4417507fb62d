// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/adapters/heightmap.h>
#include <terrane/terrain/result.h>

#include <optional>
#include <string>

namespace terrane::tools {

/// File formats of heightmaps.
enum class RasterFormat {
    png,   ///< grey, 16 bits: quantise()
    tiff,  ///< GeoTIFF, 32-bit float: heights in metres, placed in the world's x and y without a CRS
};

/// The format of a file extension (.png, .tif, .tiff), in any case; absent for another one.
std::optional<RasterFormat> raster_format(const std::string& path);

/// Writes a heightmap; replaces an existing file.
///
/// Fails: io, naming the path and the cause. A file that was there is unchanged then
Result<void> write_heightmap(const adapters::Heightmap& map, RasterFormat format,
                             const std::string& path);

}  // namespace terrane::tools
