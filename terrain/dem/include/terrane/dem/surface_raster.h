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

/// Meaning of the numbers in a surface raster.
enum class SurfaceNumbers {
    material,  ///< a material, an integer from 0 to 4294967294: see SurfaceRasterSettings::materials
    friction,  ///< the friction, 0 to 1e6, rounded to float; other properties are those of `defaults`
};

/// Settings of SurfaceRaster::open(). Fixed once the raster is open.
struct SurfaceRasterSettings {
    SurfaceNumbers numbers = SurfaceNumbers::material;  ///< meaning of the raster's first band
    /// Properties of the materials, each identified by its SurfaceProperties::material, in any order. A material that
    /// is not listed has the friction and restitution of the defaults. Must be empty if the numbers are friction.
    std::vector<SurfaceProperties> materials = {};
    /// Properties where the raster has nodata, and beyond the raster.
    SurfaceProperties defaults = {};

    /// Georeferences the raster relative to a DEM: the DemInfo that DemHeights::open() returned. Both must have the
    /// same CRS, by name. Absent: see `rect`.
    std::optional<DemInfo> aligned_with = {};
    /// The raster's outer edges in world metres; overrides its georeferencing. If neither this nor `aligned_with` is
    /// given, the raster is placed like a DEM, with its centre at world (0, 0).
    std::optional<WorldRect> rect = {};

    /// Memory limit for opening the raster and for the map, bytes; rasters that need more are refused before they are
    /// read. They need 4 bytes per sample, and up to 100 MiB while reading; GDAL's cache is not included.
    std::size_t memory_bytes = std::size_t{2} << 30;
    /// Timeout for opening the file, and for reading each strip of about four million samples, seconds, > 0: as
    /// DemSettings::read_timeout.
    double read_timeout = 60.0;
};

/// Size, place and statistics of a surface raster.
struct SurfaceRasterInfo {
    int columns = 0, rows = 0;    ///< samples
    WorldRect rect = {};          ///< its outer edges in the world, metres
    std::string crs;              ///< name of the raster's CRS; "" if it has none
    double nodata_share = 0.0;    ///< share of samples without data, 0 to 1
    double unlisted_share = 0.0;  ///< share of samples whose material is not listed, 0 to 1
};

/// A surface map from a raster that GDAL reads: a cell has the properties of its sample, without interpolation. A point
/// on the edge between two cells belongs to the eastern or northern one; the raster's outer edges are part of the
/// raster.
///
/// Samples have scale and offset applied. NaN and infinite samples are nodata. A rotated raster is resampled by nearest
/// neighbour. All samples are held in memory.
class SurfaceRaster {
public:
    SurfaceRaster() = delete;

    /// Opens and reads a raster, from its first row to its last. A single sample is sufficient.
    ///
    /// Fails: io if it cannot be opened or read, and for pipes and devices; bad_data for a sample that is not an
    ///        integer from 0 to 4294967294 (material) or not a valid friction (the message gives its position), complex
    ///        numbers, and the geometries that DemHeights::open() refuses; invalid_argument for settings
    ///        out of range, a material listed twice, materials listed for friction, both `aligned_with` and `rect`, and
    ///        a CRS that differs from the DEM's or has no name; out_of_memory above memory_bytes, or if the system has
    ///        less; timed_out after read_timeout. Messages about the raster name the file.
    /// Cost:  linear in the samples. A query costs O(log materials)
    static Result<std::shared_ptr<const SurfaceMap>> open(
        const std::string& path, const SurfaceRasterSettings& settings = {},
        SurfaceRasterInfo* info_out = nullptr);
};

}  // namespace terrane
