// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/imagery_source.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane {

/// Settings of ImageryRaster::open(). Fixed once it is open.
struct ImageryRasterSettings {
    /// Numbers of the bands of red, green and blue, from 1, or of one band for grey. Empty: the bands that the file
    /// names so, else the first three, else the first as grey or by its palette.
    std::vector<int> bands = {};
    /// Places the raster by its georeferencing over the DEM that DemHeights::open() gave this of; from another CRS it
    /// is reprojected. Absent, or without a CRS: world (0, 0) is the middle of the raster.
    std::optional<DemInfo> aligned_with = {};
    /// Longest time for opening the file and for reading a square, seconds, above 0: as DemSettings::read_timeout.
    double read_timeout = 60.0;
};

/// Size and place of an imagery raster.
struct ImageryRasterInfo {
    int columns = 0, rows = 0;  ///< samples, after reprojection
    WorldRect rect = {};        ///< its outer edges in the world, metres
    std::string crs;            ///< name of the raster's CRS; "" if it has none
    std::vector<int> bands;     ///< that are used
};

/// Imagery from a raster that GDAL reads, with 8-bit bands. Nodata, masks and alpha bands are no data.
///
/// Nothing is held in memory but GDAL's cache. Coarse squares are read from the file's overviews, where it has some.
class ImageryRaster {
public:
    ImageryRaster() = delete;

    /// Opens a raster.
    ///
    /// Fails: io if it cannot be opened, and for pipes and devices; bad_data for bands that are not 8-bit, cells
    ///        without area, a CRS that cannot be converted to that of the DEM; invalid_argument for settings out of
    ///        range and bands that the file does not have; timed_out after read_timeout. Messages name the file
    /// Cost:  of opening the file
    static Result<std::shared_ptr<const ImagerySource>> open(
        const std::string& path, const ImageryRasterSettings& settings = {},
        ImageryRasterInfo* info_out = nullptr);
};

}  // namespace terrane
