// SPDX-License-Identifier: MIT
#include "raster_files.h"

#include <ogr_spatialref.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

namespace terrane::test {
namespace {

void require(bool ok, const char* what, const std::string& path) {
    if (ok) return;
    std::fprintf(stderr, "cannot make test raster %s: %s\n", path.c_str(), what);
    std::abort();
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
    std::random_device entropy;
    path_ = (std::filesystem::temp_directory_path() / ("terrane_dem_" + std::to_string(entropy())))
                .string();
    std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

void write_raster(const std::string& path, const RasterSpec& spec) {
    GDALAllRegister();
    CPLSetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    require(driver != nullptr, "no GTiff driver", path);
    GDALDataset* file =
        driver->Create(path.c_str(), spec.columns, spec.rows, 1, spec.type, nullptr);
    require(file != nullptr, "Create", path);
    if (spec.has_place) {
        std::array<double, 6> transform = spec.transform;
        require(file->SetGeoTransform(transform.data()) == CE_None, "SetGeoTransform", path);
    }
    if (!spec.crs.empty()) {
        OGRSpatialReference crs;
        require(crs.SetFromUserInput(spec.crs.c_str()) == OGRERR_NONE, "CRS", path);
        require(file->SetSpatialRef(&crs) == CE_None, "SetSpatialRef", path);
    }
    GDALRasterBand* band = file->GetRasterBand(1);
    if (spec.nodata) band->SetNoDataValue(*spec.nodata);
    if (spec.scale != 1.0 || spec.offset != 0.0) {
        band->SetScale(spec.scale);
        band->SetOffset(spec.offset);
    }
    if (!spec.unit.empty()) band->SetUnitType(spec.unit.c_str());
    std::vector<double> values;
    for (int row = 0; row < spec.rows; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            values.push_back(spec.value(column, row));
        }
    }
    require(band->RasterIO(GF_Write, 0, 0, spec.columns, spec.rows, values.data(), spec.columns,
                           spec.rows, GDT_Float64, 0, 0, nullptr) == CE_None,
            "write", path);
    if (!spec.mask.empty()) {
        require(file->CreateMaskBand(GMF_PER_DATASET) == CE_None, "CreateMaskBand", path);
        std::vector<std::uint8_t> mask = spec.mask;
        require(band->GetMaskBand()->RasterIO(GF_Write, 0, 0, spec.columns, spec.rows, mask.data(),
                                              spec.columns, spec.rows, GDT_Byte, 0, 0,
                                              nullptr) == CE_None,
                "write mask", path);
    }
    GDALClose(GDALDataset::ToHandle(file));
}

std::string real_data(const std::string& name) {
    const char* folder = std::getenv("TERRANE_DATA");
    const std::string path =
        (folder != nullptr ? std::string(folder)
                           : std::string(TERRANE_SOURCE_DIR) + "/../shared/data") +
        "/dem/" + name;
    return std::filesystem::exists(path) ? path : std::string();
}

}  // namespace terrane::test
