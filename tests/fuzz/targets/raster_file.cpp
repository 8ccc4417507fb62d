// SPDX-License-Identifier: MIT
// Files of rasters. The first byte chooses: changes to a GeoTIFF (support/input.h), or any bytes.
#include "support/input.h"
#include "support/raster_probe.h"

#include <cpl_vsi.h>
#include <ogr_spatialref.h>

#include <array>
#include <vector>

using namespace terrane;

namespace {

constexpr int kSide = 9;

/// A GeoTIFF of kSide x kSide samples.
std::vector<std::uint8_t> geotiff(GDALDataType type, int bands, const char* crs,
                                  std::array<double, 6> transform) {
    const char* const path = "/vsimem/valid.tif";
    auto file = fuzz::create_geotiff(path, kSide, kSide, bands, type);
    file->SetGeoTransform(transform.data());
    OGRSpatialReference reference;
    reference.SetFromUserInput(crs);
    file->SetSpatialRef(&reference);
    std::vector<double> values;
    for (int i = 0; i < kSide * kSide; ++i) values.push_back(i % 7 + i / kSide);
    for (int band = 1; band <= bands; ++band) file->GetRasterBand(band)->SetNoDataValue(3.0);
    fuzz::require(fuzz::write_samples(*file, values), "GDAL writes samples");
    file.reset();
    vsi_l_offset size = 0;
    GByte* const bytes = VSIGetMemFileBuffer(path, &size, FALSE);
    std::vector<std::uint8_t> copy(bytes, bytes + size);
    VSIUnlink(path);
    return copy;
}

std::vector<std::vector<std::uint8_t>> valid_files() {
    fuzz::keep_plain_drivers();
    const std::array<double, 6> north{1000.0, 10.0, 0.0, 5000.0, 0.0, -10.0};
    const std::array<double, 6> turned{1000.0, 8.0, 6.0, 5000.0, 6.0, -8.0};
    const std::array<double, 6> degrees{12.0, 0.001, 0.0, 41.0, 0.0, -0.001};
    return {
        geotiff(GDT_Float32, 1, "EPSG:32633", north), geotiff(GDT_Int16, 1, "EPSG:4326", degrees),
        geotiff(GDT_Float64, 1, "EPSG:32633", turned), geotiff(GDT_Byte, 3, "EPSG:32633", north)};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const std::vector<std::vector<std::uint8_t>> valid = valid_files();
    fuzz::Input input(data, size);
    const auto kind = static_cast<std::size_t>(input.below(5));
    std::vector<std::uint8_t> bytes;
    if (kind < valid.size()) {
        bytes = fuzz::patched(valid[kind], input);
    } else {
        const auto rest = input.rest();
        bytes.assign(rest.begin(), rest.end());
    }
    if (fuzz::names_other_files(bytes)) return -1;
    const std::string path = fuzz::write_memory_file("raster", bytes);
    fuzz::probe_raster(path);
    VSIUnlink(path.c_str());
    return 0;
}
