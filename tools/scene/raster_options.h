// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"

#include <terrane/dem/dem_heights.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace terrane::tools {

/// What a raster means where its file does not say it, the plane of its world, and its crop: flags, or keys of a scene
/// with the same names. The fields are those of DemSettings; absent: the file's.
struct RasterOptions {
    std::optional<std::string> height_unit;
    std::optional<double> height_scale;
    std::optional<std::vector<double>> nodata;
    std::optional<HeightEncoding> encoding;
    std::optional<double> cell_m;
    std::optional<DemProjection> project;
    std::optional<std::array<double, 4>> crop;

    bool is_empty() const;
    /// Replaces these options by the given ones of `other`.
    void override_by(const RasterOptions& other);
    void apply(DemSettings& settings_out) const;
};

/// The flags, for messages: "--height-unit, ..., --project and --crop".
extern const char* const kRasterFlags;

/// Adds the flags. `options` must outlive the app's parse().
void add_raster_options(CLI::App& app, RasterOptions& options);

/// Reads a key of a scene. Returns false for any other key. The error says what the value must be.
Parsed<bool> read_raster_key(const std::string& key, const nlohmann::ordered_json& value,
                             RasterOptions& options_out);

/// The path of a raster that a scene names, relative to the scene's folder. In a name that GDAL reads with a prefix,
/// such as NETCDF:"file.nc":height, GTIFF_DIR:2:file.tif or vrt://file.tif?bands=2, the file is relative.
std::string raster_path(const std::filesystem::path& folder, const std::string& name);

}  // namespace terrane::tools
