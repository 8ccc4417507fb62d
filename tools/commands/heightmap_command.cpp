// SPDX-License-Identifier: MIT
#include "program/command.h"
#include "program/options.h"
#include "program/output_file.h"
#include "program/summary.h"
#include "scene/terrain_options.h"

#include <terrane/adapters/heightmap.h>
#include <terrane/base/result.h>

#include <CLI/CLI.hpp>
#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// File formats of heightmaps.
enum class RasterFormat {
    png,   ///< grey, 16 bits: quantise()
    tiff,  ///< GeoTIFF, 32-bit float: heights in metres, placed in the world's x and y without a CRS
};

/// The format of a file extension (.png, .tif, .tiff), in any case; absent for another one.
std::optional<RasterFormat> raster_format(const std::string& path);

/// Writes a heightmap; replaces an existing file.
///
/// Fails: io, naming the path and the cause. An existing file is then unchanged
Result<void> write_heightmap(const adapters::Heightmap& map, RasterFormat format,
                             const std::string& path);

namespace {

struct CloseDataset {
    void operator()(void* dataset) const { GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

struct FreeBytes {
    void operator()(void* bytes) const { VSIFree(bytes); }
};

// A file in memory, removed together with GDAL's sidecar files.
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
    return write_file(path, std::string_view(reinterpret_cast<const char*>(bytes.get()),
                                             static_cast<std::size_t>(size)));
}

namespace {

constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();
constexpr double kMostPlace = 0x1p39;  // limit of HeightmapSettings

struct HeightmapOptions {
    TerrainOptions terrain;
    double centre_x_m = kNotGiven, centre_y_m = kNotGiven;
    std::size_t side = 513;
    double spacing_m = kNotGiven;
    double absent_m = kNotGiven;
    std::string out, sdf;
    bool json = false;
};

std::string file_name(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }

CommandResult<void> run_heightmap(const HeightmapOptions& options) {
    const std::optional<RasterFormat> format = raster_format(options.out);
    if (!options.out.empty() && !format) {
        return usage_error(fmt::format("--out must end in .png or .tif, got '{}'", options.out));
    }
    if (!options.sdf.empty() && format != RasterFormat::png) {
        return usage_error(
            "--sdf needs --out FILE.png: simulators scale the heights of other rasters by rules of "
            "their own");
    }
    if (((options.side - 1) & (options.side - 2)) != 0) {
        return usage_error(fmt::format("--side must be 2^n + 1, got {}", options.side));
    }
    TERRANE_TRY(const Terrain terrain, open_terrain(options.terrain));
    const std::shared_ptr<const HeightSource> source = heightfield_of(terrain);
    const Lattice& lattice = source->lattice();
    const WorldVec2 start = start_of(terrain);
    adapters::HeightmapSettings settings;
    settings.centre_x = given(options.centre_x_m).value_or(start.x());
    settings.centre_y = given(options.centre_y_m).value_or(start.y());
    settings.side = static_cast<int>(options.side);
    settings.absent_height = given(options.absent_m);
    settings.level = lattice.level_for_spacing(given(options.spacing_m).value_or(lattice.spacing));
    const Result<adapters::Heightmap> map = adapters::make_heightmap(*source, settings);
    if (!map) {
        const bool has_holes = map.error().message.find("no holes") != std::string::npos;
        return failure(map.error().message +
                       (has_holes ? "; --absent-m says what stands there" : ""));
    }
    if (!options.out.empty()) {
        TERRANE_TRY(write_heightmap(*map, *format, options.out));
    }
    if (!options.sdf.empty()) {
        TERRANE_TRY(write_file(
            options.sdf, adapters::sdf_model(*map, "terrane_ground", file_name(options.out))));
    }

    nlohmann::ordered_json summary;
    summary["side"] = map->side;
    summary["spacing_m"] = map->spacing;
    summary["width_m"] = map->width();
    summary["west_m"] = map->west;
    summary["north_m"] = map->north;
    summary["low_m"] = map->low;
    summary["high_m"] = map->high;
    summary["quantisation_error_m"] = format == RasterFormat::png ? quantisation_error(*map) : 0.0;
    summary["absent"] = map->absent_count;
    if (!options.out.empty()) summary["out"] = options.out;
    if (!options.sdf.empty()) summary["sdf"] = options.sdf;
    print_summary(summary, options.json);
    return {};
}

}  // namespace

void add_heightmap_command(CLI::App& app, CommandContext& context) {
    const auto options = std::make_shared<HeightmapOptions>();
    CLI::App* command = app.add_subcommand("heightmap",
                                           "Writes a square of 2^n + 1 heights for Gazebo and "
                                           "other simulators: a raster and an SDF model");
    add_terrain_options(*command, options->terrain, {});
    add_in_range(*command, "--centre-x-m", options->centre_x_m, -kMostPlace, kMostPlace,
                 "World x of the square's centre, metres; without it that of --start-m");
    add_in_range(*command, "--centre-y-m", options->centre_y_m, -kMostPlace, kMostPlace,
                 "World y of the square's centre, metres; without it that of --start-m");
    add_count(*command, "--side", options->side, 3, "Samples along a side, 2^n + 1",
              static_cast<std::size_t>(adapters::kMostHeightmapSide));
    add_positive(*command, "--spacing-m", options->spacing_m,
                 "Most metres between samples: the coarsest level with at most this spacing; "
                 "without it the finest level");
    add_in_range(
        *command, "--absent-m", options->absent_m, -kMostHeight, kMostHeight,
        "Height where there is no ground, metres; without it a square with such samples is "
        "refused");
    command
        ->add_option("--out", options->out,
                     "File to write: .png (grey, 16 bits from the lowest to the highest height) or "
                     ".tif (heights as float). A file of that name is replaced")
        ->type_name("FILE");
    command
        ->add_option(
            "--sdf", options->sdf,
            "SDF model of the .png, with its size and position; the image is expected beside it")
        ->type_name("FILE");
    command->add_flag("--json", options->json, "Print one JSON object");
    command->footer(
        "Example: terrane heightmap --dem tools/data/jacksboro.tif --side 257 --out ground.png "
        "--sdf ground.sdf");
    command->callback(
        [&context, options] { context.run = [options] { return run_heightmap(*options); }; });
}

}  // namespace terrane::tools
