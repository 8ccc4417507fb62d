// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/surface.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane {

/// What the numbers of a surface raster stand for.
enum class SurfaceNumbers {
    material,  ///< numbers of materials, such as classes of land cover: SurfaceRasterSettings::materials
    friction,  ///< friction itself, 0 to 1e6, held as floats; the rest is that of the defaults
};

/// Settings of SurfaceRaster::open(). Fixed once it is open.
struct SurfaceRasterSettings {
    SurfaceNumbers numbers = SurfaceNumbers::material;  ///< of the raster's first band
    /// Properties of the materials, each under its SurfaceProperties::material, in any order. A material without a row
    /// has the friction and restitution of the defaults. Empty where the numbers are friction.
    std::vector<SurfaceProperties> materials = {};
    /// Where there is nodata, and beyond the raster.
    SurfaceProperties defaults = {};

    /// Places the raster by its georeferencing over the DEM that DemHeights::open() gave this of. Both need the same
    /// CRS, by its name. Absent: see `rect`.
    std::optional<DemInfo> aligned_with = {};
    /// Where the outer edges of the raster come to lie, world metres, whatever its georeferencing. Absent, and without
    /// `aligned_with`: where those of a DEM would, world (0, 0) being their centre.
    std::optional<WorldRect> rect = {};

    /// Limit of the memory of opening the raster and of the map, bytes; rasters that need more are refused before they
    /// are read. For each sample 4 bytes, and up to 100 MiB while it is read; GDAL's cache is not counted.
    std::size_t memory_bytes = std::size_t{2} << 30;
    /// Longest time for opening the file, and for reading about four million samples of it: as
    /// DemSettings::read_timeout, seconds, above 0.
    double read_timeout = 60.0;
};

/// Size, place and statistics of a surface raster.
struct SurfaceRasterInfo {
    int columns = 0, rows = 0;    ///< samples
    WorldRect rect = {};          ///< its outer edges in the world, metres
    std::string crs;              ///< name of the raster's CRS; "" if it has none
    double nodata_share = 0.0;    ///< of the samples, 0 to 1
    double unlisted_share = 0.0;  ///< of the samples: with a material that has no row, 0 to 1
};

/// A surface map from a raster that GDAL reads: everywhere in a cell the properties of its sample, nothing is
/// interpolated. A place on the edge of two cells belongs to the one to the east or north; the raster's outer edges are
/// part of it.
///
/// Samples have scale and offset applied. NaN and infinite samples are nodata. A rotated raster is straightened with
/// its nearest samples. All samples are held in memory.
class SurfaceRaster {
public:
    SurfaceRaster() = delete;

    /// Opens and reads a raster, from its first row to its last. One sample is enough.
    ///
    /// Fails: io if it cannot be opened or read, and for pipes and devices; bad_data for a sample that is no whole
    ///        number of 0 to 4294967294 (material) or no friction, which is named with its position, complex
    ///        numbers, and the geometries that DemHeights::open() refuses; invalid_argument for settings out of
    ///        range, a material listed twice, materials listed for friction, both `aligned_with` and `rect`, another
    ///        CRS than that of the DEM, or one without a name; out_of_memory above memory_bytes, or if the system
    ///        has less; timed_out after read_timeout. Messages about the raster name the file.
    /// Cost:  linear in the samples. Of an answer: O(log materials)
    static Result<std::shared_ptr<const SurfaceMap>> open(
        const std::string& path, const SurfaceRasterSettings& settings = {},
        SurfaceRasterInfo* info_out = nullptr);
};

}  // namespace terrane
