// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>

#include <memory>
#include <mutex>
#include <span>
#include <string>

class GDALDataset;
class GDALRasterBand;

namespace terrane::internal {

/// While it exists, captures GDAL's messages on this thread for use in errors; nothing is written to standard error.
class QuietGdal {
public:
    QuietGdal();
    ~QuietGdal();
    QuietGdal(const QuietGdal&) = delete;
    QuietGdal& operator=(const QuietGdal&) = delete;

    /// The last message, on one line.
    std::string message() const;
};

/// Registers GDAL's drivers, once.
void register_drivers();

/// Meaning of a raster's numbers.
enum class RasterNumbers {
    heights,  ///< in metres or another unit, which is converted; a rotated raster is interpolated between samples
    plain,  ///< without a unit, possibly codes; a rotated raster is resampled by nearest neighbour
};

/// The first band of a raster on a grid in metres. Rows run from south to north, whatever their order in the file.
class RasterReader {
public:
    /// Opens any dataset that GDAL can open. Rotated rasters are read through GDAL's warped, unrotated view.
    ///
    /// Fails: io if GDAL cannot open it; bad_data if there are fewer than 2 x 2 heights or the geometry is invalid
    static Result<std::unique_ptr<RasterReader>> open(
        const std::string& path, RasterNumbers numbers = RasterNumbers::heights);
    /// The same on a separate thread, with a timeout.
    ///
    /// Fails: as open(); timed_out
    static Result<std::unique_ptr<RasterReader>> open(
        const std::string& path, double patience_s, RasterNumbers numbers = RasterNumbers::heights);
    ~RasterReader();
    RasterReader(const RasterReader&) = delete;
    RasterReader& operator=(const RasterReader&) = delete;

    const std::string& path() const { return path_; }
    /// Size and georeferencing of the raster; the range of heights and the shares of nodata are not set.
    const DemInfo& info() const { return info_; }
    /// Whether the file's first row is the southernmost.
    bool rows_go_north() const { return rows_go_north_; }

    /// Position of a sample in the file, for messages: "column 7, row 19 of the file (both from 0)".
    std::string place_in_file(int column, int row) const;

    /// Reads a window: scale and offset applied, for heights also the unit; NaN: no data.
    ///
    /// @param heights_out [rows * columns] metres or plain numbers, from the south-west
    ///
    /// Fails:   io; bad_data if a height is beyond kMostHeight
    /// Threads: any; reads are serialised
    Result<void> read(int column, int row, int columns, int rows,
                      std::span<double> heights_out) const;

    /// Whether every number of the band, before scale and offset, is exact as a float.
    bool has_float_numbers() const;
    /// Metres per unit of the band's numbers, and the offset, metres.
    double scale() const { return scale_; }
    double offset() const { return offset_; }

private:
    struct CloseDataset {
        void operator()(GDALDataset* dataset) const;
    };

    RasterReader() = default;
    Result<void> find_place();
    Result<void> straighten();
    void find_scale(GDALRasterBand& band);
    Error too_high(double height, int column, int row) const;

    std::string path_;
    RasterNumbers numbers_ = RasterNumbers::heights;
    DemInfo info_;
    std::unique_ptr<GDALDataset, CloseDataset> file_;
    std::unique_ptr<GDALDataset, CloseDataset> warped_;  ///< view of file_; closed before it
    GDALRasterBand* band_ = nullptr;
    GDALRasterBand* mask_ = nullptr;  ///< null: every sample is valid
    double scale_ = 1.0, offset_ = 0.0;
    bool rows_go_north_ = false, columns_go_west_ = false;
    mutable std::mutex mutex_;  ///< a GDAL dataset serves one thread at a time
};

/// The error of a raster whose read timed out.
tl::unexpected<Error> stopped_answering(const std::string& path, double patience_s);

}  // namespace terrane::internal
