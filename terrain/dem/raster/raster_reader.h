// SPDX-License-Identifier: MIT
#pragma once

#include "raster/crs_frame.h"
#include "raster/height_numbers.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/height_source.h>

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

class GDALDataset;
class GDALRasterBand;
class OGRSpatialReference;

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

/// Reads heights on a grid in metres. Rows run from south to north.
class HeightReader {
public:
    HeightReader() = default;
    virtual ~HeightReader() = default;
    HeightReader(const HeightReader&) = delete;
    HeightReader& operator=(const HeightReader&) = delete;

    virtual const std::string& path() const = 0;
    /// Size and georeferencing; the range of heights and the shares of nodata are not set.
    virtual const DemInfo& info() const = 0;
    /// Whether the first rows to read are the southernmost.
    virtual bool rows_go_north() const = 0;

    /// Reads a window; NaN: no data.
    ///
    /// @param heights_out [rows * columns] metres, from the south-west
    ///
    /// Fails:   io; bad_data if a height is beyond kMostHeight
    /// Threads: any
    virtual Result<void> read(int column, int row, int columns, int rows,
                              std::span<double> heights_out) const = 0;

    /// Whether every height is scale() times a float, plus offset().
    virtual bool has_float_numbers() const = 0;
    virtual double scale() const = 0;
    virtual double offset() const = 0;
    /// Contains all heights; absent: not known before they are read.
    virtual std::optional<HeightInterval> range() const { return std::nullopt; }
    /// Fails: bad_data if heights are commonly nodata and far from all others
    virtual Result<void> check_extremes(const ExtremeHeights&) const { return {}; }
    /// Upper bound of the vertical distance between the surface of these heights and that of the file, over a closed
    /// rectangle of cells, metres. Cell (0, 0) is north-east of sample (0, 0); cells beyond the raster have none. Does
    /// not decrease when the rectangle grows.
    virtual double error_over(std::int64_t, std::int64_t, std::int64_t, std::int64_t) const {
        return 0.0;
    }
    virtual bool has_errors() const { return false; }
};

/// The first band of a raster on a grid in metres. Rows run from south to north, whatever their order in the file.
class RasterReader final : public HeightReader {
public:
    /// Opens any dataset that GDAL can open. Heights of a raster that is rotated, or placed by ground control points,
    /// are read as they are in the file: see is_resampled(). Other numbers of such rasters are read through GDAL's
    /// warped, unrotated view.
    ///
    /// Fails: io if GDAL cannot open it; bad_data for fewer than 2 x 2 heights, an invalid geometry, or if the
    ///        file does not say what its numbers mean
    static Result<std::unique_ptr<RasterReader>> open(
        const std::string& path, RasterNumbers numbers = RasterNumbers::heights,
        const NumberReading& reading = {});
    /// The same on a separate thread, with a timeout.
    ///
    /// Fails: as open(); timed_out
    static Result<std::unique_ptr<RasterReader>> open(
        const std::string& path, double patience_s, RasterNumbers numbers = RasterNumbers::heights,
        const NumberReading& reading = {});
    ~RasterReader() override;

    const std::string& path() const override { return path_; }
    const DemInfo& info() const override { return info_; }
    /// Whether the file's first row is the southernmost.
    bool rows_go_north() const override { return rows_go_north_; }

    /// Whether the samples do not lie on the axes of the world, so that heights must be resampled: see PlaneMap.
    bool is_resampled() const;
    /// From columns and rows of samples to the CRS, as a geotransform; whole numbers are samples. Not valid if there
    /// are control_points().
    const std::array<double, 6>& crs_from_sample() const { return crs_from_sample_; }
    /// The same by polynomials, for heights that ground control points place; otherwise null.
    const std::shared_ptr<const ControlPoints>& control_points() const { return points_; }
    /// The raster's outer edges in the CRS.
    const CrsRect& rect() const { return rect_; }

    /// Position of a sample in the file, for messages: "column 7, row 19 of the file (both from 0)".
    std::string place_in_file(int column, int row) const;

    /// Reads a window: scale and offset applied, for heights also the unit; NaN: no data.
    ///
    /// @param heights_out [rows * columns] metres or plain numbers, from the south-west
    ///
    /// Threads: any; reads are serialised
    Result<void> read(int column, int row, int columns, int rows,
                      std::span<double> heights_out) const override;

    /// Whether every number of the band, before scale and offset, is exact as a float.
    bool has_float_numbers() const override;
    /// Metres per unit of the band's numbers, and the offset, metres.
    double scale() const override { return meaning_.scale; }
    double offset() const override { return meaning_.offset; }
    Result<void> check_extremes(const ExtremeHeights& extremes) const override;
    const NumberReading& reading() const { return reading_; }
    /// Names without folders, sizes and modification times of the files of the raster, with the tiles of a mosaic.
    /// Empty if it has no files.
    std::string file_versions() const;

private:
    struct CloseDataset {
        void operator()(GDALDataset* dataset) const;
    };

    RasterReader() = default;
    /// Replaces the file by GDAL's cropped view of it.
    Result<void> crop();
    Result<void> find_place();
    Result<void> choose_plane(const OGRSpatialReference& crs, const CrsRect& rect);
    Result<void> straighten();
    Result<void> warp();
    Result<void> check_placement();
    /// Reads the numbers of a window, and whether GDAL's mask shows them as valid, in the order of the file.
    bool read_numbers(int file_x, int file_y, int columns, int rows, std::span<double> numbers_out,
                      std::span<std::uint8_t> valid_out) const;
    Error too_high(double height, int column, int row) const;

    std::string path_;
    RasterNumbers numbers_ = RasterNumbers::heights;
    NumberReading reading_;
    BandNumbers meaning_;
    DemInfo info_;
    std::unique_ptr<GDALDataset, CloseDataset>
        whole_;  ///< of which file_ is a cropped view; null: file_ is the file
    std::unique_ptr<GDALDataset, CloseDataset> file_;
    std::unique_ptr<GDALDataset, CloseDataset> warped_;  ///< view of file_
    GDALRasterBand* band_ = nullptr;
    GDALRasterBand* mask_ = nullptr;  ///< null: every sample is valid
    /// From raster coordinates to the CRS; absent: no georeferencing.
    std::optional<std::array<double, 6>> transform_;
    std::array<double, 6> crs_from_sample_{};
    std::shared_ptr<const ControlPoints> points_;
    CrsRect rect_;
    bool is_rotated_ =
        false;  ///< heights, and not by a multiple of 90 degrees, or by control points
    bool is_transposed_ = false;  ///< the file's rows run along the world's columns
    bool rows_go_north_ = false, columns_go_west_ = false;
    mutable std::mutex mutex_;  ///< a GDAL dataset serves one thread at a time
};

/// The error of a raster whose read timed out.
tl::unexpected<Error> stopped_answering(const std::string& path, double patience_s);

}  // namespace terrane::internal
