// SPDX-License-Identifier: MIT
#pragma once

#include "store/test_files.h"

#include <terrane/dem/dem_heights.h>

#include <gdal_priv.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace terrane::test {

/// What a test raster is written as; heights are what a reader must find, before scale and offset.
struct RasterSpec {
    int columns = 0, rows = 0;
    GDALDataType type = GDT_Float32;
    std::array<double, 6> transform{1000.0, 10.0, 0.0, 5000.0, 0.0, -10.0};
    std::string crs = "EPSG:32633";  ///< "": none
    std::optional<double> nodata{};
    double scale = 1.0, offset = 0.0;
    std::string unit{};
    bool has_place = true;                               ///< false: no geotransform
    std::vector<std::uint8_t> mask{};                    ///< a mask band of its own; empty: none
    std::function<double(int column, int row)> value{};  ///< rows from the north
};

/// Writes a GeoTIFF; aborts the test program where it cannot.
void write_raster(const std::string& path, const RasterSpec& spec);

/// The path of a file of the real data, or "" where it is absent.
std::string real_data(const std::string& name);

/// A mosaic of a pipe in a folder: whoever reads it waits until the object's end.
class HungMosaic {
public:
    /// @param type the band's, as in a VRT file
    HungMosaic(const TemporaryFolder& folder, const std::string& type);
    ~HungMosaic();
    HungMosaic(const HungMosaic&) = delete;
    HungMosaic& operator=(const HungMosaic&) = delete;
    std::string path;

private:
    std::string pipe_;
};

/// A number in [0, 1), the same everywhere.
inline double random_unit(std::mt19937& random) {
    return static_cast<double>(random() & 0xffffffu) / 16777216.0;
}

/// World x of a column and y of a row that counts from the north.
inline double sample_x(const DemInfo& info, int column) {
    return (column + 0.5 - 0.5 * info.columns) * info.cell_x;
}
inline double sample_y(const DemInfo& info, int row) {
    return (0.5 * info.rows - row - 0.5) * info.cell_y;
}

/// A raster that is open.
struct OpenedDem {
    std::shared_ptr<const HeightSource> source;
    DemInfo info;

    double at(int column, int row) const {
        return source->height(sample_x(info, column), sample_y(info, row));
    }
};
/// Opens a raster; throws, with a failure of the test, where it does not open.
OpenedDem open_dem(const std::string& path, const DemSettings& settings = {});
/// Writes and opens a raster.
OpenedDem open_dem(const RasterSpec& spec, const DemSettings& settings = {});

/// Two sources answer everything with the same bits.
void expect_same_answers(const HeightSource& a, const HeightSource& b);

}  // namespace terrane::test
