// SPDX-License-Identifier: MIT
#include "support/raster_probe.h"

#include "support/input.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/dem/imagery_raster.h>
#include <terrane/dem/surface_raster.h>
#include <terrane/terrain/chunk.h>

#include <cpl_error.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

namespace terrane::fuzz {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();  // libFuzzer has its own
constexpr std::size_t kMemoryLimit = std::size_t{512} << 20;
constexpr double kMostSamples = 65'536.0;

bool is_small(const std::string& path) {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
    CPLPopErrorHandler();
    return file == nullptr ||
           static_cast<double>(file->GetRasterXSize()) * file->GetRasterYSize() <= kMostSamples;
}

void probe_heights(const std::string& path, DemInfo& info) {
    DemSettings settings;
    settings.memory_bytes = kMemoryLimit;
    settings.read_timeout = kNoLimit;
    const auto heights = DemHeights::open(path, settings, &info);
    if (!is_accepted(heights)) return;
    const HeightSource& source = **heights;
    require(info.min_m <= info.max_m, "a raster's lowest sample is at most its highest");
    const HeightInterval all = source.interval(source.extent());
    require(all.low <= info.max_m && all.high >= info.min_m, "the interval contains the samples");
    require(std::isfinite(source.height(0.0, 0.0)), "a height is finite");
    const Lattice& lattice = source.lattice();
    SampleGrid grid{{lattice.west(), lattice.south()}, lattice.chunk_side(0) / 8, 9, 9};
    std::vector<double> samples(grid.size());
    require(source.sample(grid, samples).has_value(), "samples can be read");
    require(std::ranges::all_of(samples, [](double z) { return std::isfinite(z); }),
            "samples are finite");
    const ChunkKey root{lattice.first_root_x, lattice.first_root_y, 0};
    const auto chunk = make_chunk(source, root);
    if (!chunk) require(chunk.error().code != ErrorCode::io, chunk.error().message);
}

void probe_imagery(const std::string& path, const DemInfo* dem) {
    ImageryRasterSettings settings;
    settings.read_timeout = kNoLimit;
    if (dem != nullptr) settings.aligned_with = *dem;
    ImageryRasterInfo info;
    const auto imagery = ImageryRaster::open(path, settings, &info);
    if (!imagery) return;
    constexpr int kSide = 16;
    std::vector<ImageryTexel> texels(std::size_t{kSide} * kSide);
    const WorldRect& rect = info.rect;
    static_cast<void>((*imagery)->read(rect, kSide, texels));
    const double middle = 0.5 * (rect.west + rect.east);
    static_cast<void>(
        (*imagery)->read({middle, rect.south, middle + 3.0, rect.south + 3.0}, kSide, texels));
}

void probe_surface(const std::string& path, SurfaceNumbers numbers) {
    SurfaceRasterSettings settings;
    settings.numbers = numbers;
    settings.memory_bytes = kMemoryLimit;
    settings.read_timeout = kNoLimit;
    if (numbers == SurfaceNumbers::material) settings.materials = {{0.9, 0.1, 1}, {0.2, 0.0, 7}};
    SurfaceRasterInfo info;
    const auto surface = SurfaceRaster::open(path, settings, &info);
    if (!surface) return;
    for (const double x : {info.rect.west, 0.0, info.rect.east, 1e300}) {
        require((*surface)->at(x, info.rect.north).validate().has_value(),
                "surface properties are in range");
    }
}

}  // namespace

void keep_plain_drivers() {
    constexpr std::array<std::string_view, 8> kKept{"VRT",  "GTiff", "AAIGrid", "USGSDEM",
                                                    "DTED", "PNG",   "BMP",     "ENVI"};
    GDALAllRegister();
    GDALDriverManager& drivers = *GetGDALDriverManager();
    std::string skipped;
    for (int i = 0; i < drivers.GetDriverCount(); ++i) {
        const char* const name = drivers.GetDriver(i)->GetDescription();
        if (std::ranges::find(kKept, name) != kKept.end()) continue;
        skipped.append(skipped.empty() ? "" : ",").append(name);
    }
    // which the library's own registration heeds, too
    CPLSetConfigOption("GDAL_SKIP", skipped.c_str());
    GDALAllRegister();
    CPLSetConfigOption("GDAL_DISABLE_READDIR_ON_OPEN", "EMPTY_DIR");
}

bool names_other_files(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kRoot = "VRTDataset";
    return std::search(bytes.begin(), bytes.end(), kRoot.begin(), kRoot.end()) != bytes.end();
}

void probe_raster(const std::string& path) {
    if (!is_small(path)) return;
    DemInfo dem;
    probe_heights(path, dem);
    probe_imagery(path, nullptr);
    if (dem.columns > 0) probe_imagery(path, &dem);
    probe_surface(path, SurfaceNumbers::material);
    probe_surface(path, SurfaceNumbers::friction);
}

GDALDatasetUniquePtr create_geotiff(const std::string& path, int columns, int rows, int bands,
                                    GDALDataType type) {
    GDALDriver* const driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    GDALDatasetUniquePtr file(driver->Create(path.c_str(), columns, rows, bands, type, nullptr));
    require(file != nullptr, "GDAL makes a GeoTIFF");
    return file;
}

bool write_samples(GDALDataset& file, std::vector<double>& samples) {
    const int columns = file.GetRasterXSize(), rows = file.GetRasterYSize();
    for (int band = 1; band <= file.GetRasterCount(); ++band) {
        if (file.GetRasterBand(band)->RasterIO(GF_Write, 0, 0, columns, rows, samples.data(),
                                               columns, rows, GDT_Float64, 0, 0,
                                               nullptr) != CE_None) {
            return false;
        }
    }
    return true;
}

std::string write_memory_file(const std::string& name, std::span<const std::uint8_t> bytes) {
    std::string path = "/vsimem/" + name;
    VSIUnlink(path.c_str());
    VSILFILE* const file = VSIFOpenL(path.c_str(), "wb");
    require(file != nullptr, "GDAL opens a file in memory");
    VSIFWriteL(bytes.data(), 1, bytes.size(), file);
    VSIFCloseL(file);
    return path;
}

}  // namespace terrane::fuzz
