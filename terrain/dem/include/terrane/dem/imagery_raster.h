// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/imagery_source.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane {

/// Settings of ImageryRaster::open(). Fixed once the raster is open.
struct ImageryRasterSettings {
    /// Indices, from 1, of the red, green and blue bands, or of one grey band. Empty: the bands that the file declares
    /// as red, green and blue, else the first three, else the first as grey or with its palette.
    std::vector<int> bands = {};
    /// Values of all bands that are displayed as black and as white, finite, the second above the first. With limits or
    /// percentiles the bands may have any real type.
    std::optional<std::array<double, 2>> limits = {};
    /// The same as percentiles of the values of each band, 0 to 100, the second above the first; not with limits. They
    /// are those of a regular grid of at most 512 x 512 of the raster's cells.
    std::optional<std::array<double, 2>> percentiles = {};
    /// Displayed values between black and white, 0 to 1, are raised to the power of 1 / gamma, 0.1 to 10: above 1 the
    /// middle is brighter. Without limits and percentiles black is 0 and white 255.
    double gamma = 1.0;
    /// Georeferences the raster relative to the DEM whose DemHeights::open() returned this; a raster in another CRS is
    /// reprojected. Absent, or without a CRS: world (0, 0) is the centre of the raster.
    std::optional<DemInfo> aligned_with = {};
    /// Timeout for opening the file and for reading a square of imagery, seconds, > 0: as DemSettings::read_timeout.
    double read_timeout = 60.0;
};

/// Size and place of an imagery raster.
struct ImageryRasterInfo {
    int columns = 0, rows = 0;  ///< samples, after reprojection
    WorldRect rect = {};        ///< its outer edges in the world, metres
    std::string crs;            ///< name of the raster's CRS; "" if it has none
    std::vector<int> bands;     ///< the bands in use
};

/// Imagery from a raster with 8-bit bands, or with others that are stretched, that GDAL reads. Texels that are nodata,
/// masked or transparent by the alpha band have no data.
///
/// Nothing is held in memory except GDAL's cache. Coarse squares are read from the file's overviews, if it has any.
class ImageryRaster {
public:
    ImageryRaster() = delete;

    /// Opens a raster.
    ///
    /// Fails: io if it cannot be opened, and for pipes and devices; bad_data for bands that are not 8-bit
    ///        without limits and percentiles, for complex ones, for a palette that is to be stretched, cells without
    ///        area, and a CRS that cannot be converted to the DEM's; invalid_argument for settings out of range and
    ///        bands that the file does not have; timed_out after read_timeout. Messages name the file
    /// Cost:  opening the file; no samples are read, except a grid of them for percentiles
    static Result<std::shared_ptr<const ImagerySource>> open(
        const std::string& path, const ImageryRasterSettings& settings = {},
        ImageryRasterInfo* info_out = nullptr);
};

}  // namespace terrane
