// SPDX-License-Identifier: MIT
#include "heightmap/raster_file.h"

#include "output/output_file.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <memory>
#include <string_view>
#include <vector>

namespace terrane::tools {
namespace {

struct CloseDataset {
    void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

struct FreeBytes {
    void operator()(void* bytes) const { VSIFree(bytes); }
};

// A file in memory, removed with what GDAL writes beside it.
struct MemoryFile {
    explicit MemoryFile(std::string name) : path(std::move(name)) {}
    ~MemoryFile() {
        VSIUnlink(path.c_str());
        VSIUnlink((path + ".aux.xml").c_str());
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    std::string path;
};

tl::unexpected<Error> gdal_failure(const std::string& path) {
    std::string cause = CPLGetLastErrorMsg();
    if (cause.empty()) cause = "GDAL gives no reason";
    return fail(ErrorCode::io, fmt::format("{} cannot be made: {}", path, cause));
}

}  // namespace

std::optional<RasterFormat> raster_format(const std::string& path) {
    std::string ending = path.substr(std::min(path.find_last_of('.'), path.size()));
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
    if (ending == ".png") return RasterFormat::png;
    if (ending == ".tif" || ending == ".tiff") return RasterFormat::tiff;
    return std::nullopt;
}

Result<void> write_heightmap(const adapters::Heightmap& map, RasterFormat format,
                             const std::string& path) {
    GDALAllRegister();
    CPLErrorReset();
    const bool is_png = format == RasterFormat::png;
    const std::vector<std::uint16_t> pixels =
        is_png ? adapters::quantise(map) : std::vector<std::uint16_t>();
    const std::vector<float> heights =
        is_png ? std::vector<float>() : std::vector<float>(map.heights.begin(), map.heights.end());
    const GDALDriverH memory = GDALGetDriverByName("MEM");
    const GDALDriverH driver = GDALGetDriverByName(is_png ? "PNG" : "GTiff");
    if (memory == nullptr || driver == nullptr) return gdal_failure(path);
    const GDALDataType type = is_png ? GDT_UInt16 : GDT_Float32;
    CPLPushErrorHandler(CPLQuietErrorHandler);
    const Dataset raster(GDALCreate(memory, "", map.side, map.side, 1, type, nullptr));
    static std::atomic<int> count{0};
    const MemoryFile file(fmt::format("/vsimem/terrane_heightmap_{}", count.fetch_add(1)));
    bool is_made = raster != nullptr;
    if (is_made) {
        // corner of the first pixel: samples are the centres of pixels
        std::array<double, 6> placement{map.west - 0.5 * map.spacing,  map.spacing, 0.0,
                                        map.north + 0.5 * map.spacing, 0.0,         -map.spacing};
        if (!is_png) GDALSetGeoTransform(raster.get(), placement.data());
        const void* const source =
            is_png ? static_cast<const void*>(pixels.data()) : heights.data();
        is_made =
            GDALRasterIO(GDALGetRasterBand(raster.get(), 1), GF_Write, 0, 0, map.side, map.side,
                         const_cast<void*>(source), map.side, map.side, type, 0, 0) == CE_None;
    }
    if (is_made) {
        const Dataset copy(
            GDALCreateCopy(driver, file.path.c_str(), raster.get(), 0, nullptr, nullptr, nullptr));
        is_made = copy != nullptr;
    }
    CPLPopErrorHandler();
    if (!is_made) return gdal_failure(path);
    vsi_l_offset size = 0;
    const std::unique_ptr<GByte, FreeBytes> bytes(VSIGetMemFileBuffer(file.path.c_str(), &size, 1));
    if (bytes == nullptr) return gdal_failure(path);
    Result<OutputFile> out = OutputFile::create(path);
    if (!out) return tl::unexpected(out.error());
    out->write(std::string_view(reinterpret_cast<const char*>(bytes.get()),
                                static_cast<std::size_t>(size)));
    return out->commit();
}

}  // namespace terrane::tools
