// SPDX-License-Identifier: MIT
// Rasters that GDAL itself writes, with any size, type, place, scale, nodata and samples.
#include "support/input.h"
#include "support/raster_probe.h"

#include <cpl_error.h>
#include <cpl_vsi.h>
#include <ogr_spatialref.h>

#include <array>
#include <vector>

using namespace terrane;

namespace {

GDALDatasetUniquePtr create(fuzz::Input& input, const char* path) {
    constexpr std::array<GDALDataType, 8> kTypes{GDT_Float32, GDT_Float64, GDT_Int16, GDT_UInt16,
                                                 GDT_Int32,   GDT_UInt32,  GDT_Byte,  GDT_CFloat32};
    const GDALDataType type = input.one_of(kTypes);
    const int columns = 1 + input.below(40), rows = 1 + input.below(40);
    const int bands = 1 + input.below(4);
    return fuzz::create_geotiff(path, columns, rows, bands, type);
}

void place(fuzz::Input& input, GDALDataset& file) {
    constexpr std::array<const char*, 5> kReferences{"EPSG:32633", "EPSG:4326", "EPSG:2264",
                                                     "EPSG:5514", "EPSG:4979"};
    const int reference = input.below(6);
    if (reference < 5) {
        OGRSpatialReference crs;
        crs.SetFromUserInput(kReferences[static_cast<std::size_t>(reference)]);
        file.SetSpatialRef(&crs);
    }
    const int kind = input.below(4);
    if (kind == 0) return;
    const double cell = reference == 1 || reference == 4 ? 0.001 : 10.0;
    std::array<double, 6> transform{input.number(-180.0, 180.0), cell, 0.0,
                                    input.number(-90.0, 90.0),   0.0,  -cell};
    if (kind > 1) transform[1] = input.number(0.0, 30.0 * cell);
    if (kind > 1) transform[5] = input.number(-30.0 * cell, 0.0);
    if (kind > 2) transform[2] = input.number(-cell, cell);
    if (kind > 2) transform[4] = input.number(-cell, cell);
    file.SetGeoTransform(transform.data());
}

void fill(fuzz::Input& input, GDALDataset& file) {
    const int columns = file.GetRasterXSize(), rows = file.GetRasterYSize();
    if (input.flag()) file.GetRasterBand(1)->SetNoDataValue(input.number(-10.0, 10.0));
    if (input.flag()) file.GetRasterBand(1)->SetScale(input.number(-4.0, 4.0));
    if (input.flag()) file.GetRasterBand(1)->SetOffset(input.number(-1e4, 1e4));
    if (input.flag()) file.GetRasterBand(1)->SetUnitType("ft");
    const double range = input.flag() ? 1e6 : 10.0;
    std::vector<double> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    for (double& value : values) {
        if (input.is_empty()) break;
        value = input.number(-range, range);
    }
    fuzz::write_samples(file, values);  // GDAL may refuse some
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const bool is_ready = [] {
        fuzz::keep_plain_drivers();
        return true;
    }();
    fuzz::require(is_ready, "GDAL has drivers");
    const char* const path = "/vsimem/made.tif";
    fuzz::Input input(data, size);
    CPLPushErrorHandler(CPLQuietErrorHandler);
    auto file = create(input, path);
    place(input, *file);
    fill(input, *file);
    file.reset();
    CPLPopErrorHandler();
    fuzz::probe_raster(path);
    VSIUnlink(path);
    VSIUnlink("/vsimem/made.tif.aux.xml");
    return 0;
}
