// SPDX-License-Identifier: MIT
#include "scene/raster_options.h"

#include "program/options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

struct EncodingName {
    std::string_view name;
    HeightEncoding encoding;
};
constexpr EncodingName kEncodings[] = {{"numbers", HeightEncoding::numbers},
                                       {"terrarium", HeightEncoding::terrarium},
                                       {"mapbox", HeightEncoding::mapbox}};

constexpr std::string_view kProjections[] = {"none", "local"};
constexpr DemProjection kProjectionOf[] = {DemProjection::own, DemProjection::local};

/// Parses "A,B,C"; absent for anything else.
std::optional<std::vector<double>> parse_numbers(const std::string& text) {
    std::vector<double> values;
    const std::optional<std::vector<std::string>> items = parse_list(text);
    if (!items) return std::nullopt;
    for (const std::string& item : *items) {
        const std::optional<double> value = parse_number(item);
        if (!value) return std::nullopt;
        values.push_back(*value);
    }
    return values;
}

/// An array of numbers; absent for anything else.
std::optional<std::vector<double>> numbers_of(const Json& value) {
    const auto is_number = [](const Json& each) { return each.is_number(); };
    if (!value.is_array() || !std::ranges::all_of(value, is_number)) return std::nullopt;
    return value.get<std::vector<double>>();
}

/// Parses "none" or "A,B,C"; absent for anything else.
std::optional<std::vector<double>> parse_nodata(const std::string& text) {
    if (text == "none") return std::vector<double>();
    return parse_numbers(text);
}

/// The same for a key of a scene: "none", a number or an array of numbers.
std::optional<std::vector<double>> nodata_of(const Json& value) {
    if (value == "none") return std::vector<double>();
    if (value.is_number()) return std::vector<double>{value.get<double>()};
    return numbers_of(value);
}

constexpr const char* kCropText =
    "west,south,east,north with west below east and south below north";

/// Absent if the numbers are no rectangle: see kCropText.
std::optional<std::array<double, 4>> crop_of(const std::vector<double>& numbers) {
    if (numbers.size() != 4) return std::nullopt;
    const std::array<double, 4> crop{numbers[0], numbers[1], numbers[2], numbers[3]};
    if (!(crop[0] < crop[2] && crop[1] < crop[3])) return std::nullopt;
    return crop;
}

std::optional<HeightEncoding> encoding_of(const Json& value) {
    for (const EncodingName& each : kEncodings) {
        if (value == each.name) return each.encoding;
    }
    return std::nullopt;
}

/// Adds a flag with one number that meets a condition.
void add_number(CLI::App& app, const std::string& flag, std::optional<double>& value,
                bool (*is_met)(double), const char* wanted, const char* help) {
    app.add_option_function<std::string>(
           flag,
           [&value, flag, is_met, wanted](const std::string& text) {
               value = parse_number(text);
               if (value && is_met(*value)) return;
               throw CLI::ValidationError(flag,
                                          fmt::format("must be {}, got '{:.60}'", wanted, text));
           },
           help)
        ->type_name("X")
        ->group("Terrain");
}

bool is_above_0(double value) { return value > 0.0; }
bool is_not_0(double value) { return value != 0.0; }

}  // namespace

const char* const kRasterFlags =
    "--height-unit, --height-scale, --nodata, --encoding, --cell-m, --project and --crop";

bool RasterOptions::is_empty() const {
    return !height_unit && !height_scale && !nodata && !encoding && !cell_m && !project && !crop;
}

void RasterOptions::override_by(const RasterOptions& other) {
    if (other.height_unit) height_unit = other.height_unit;
    if (other.height_scale) height_scale = other.height_scale;
    if (other.nodata) nodata = other.nodata;
    if (other.encoding) encoding = other.encoding;
    if (other.cell_m) cell_m = other.cell_m;
    if (other.project) project = other.project;
    if (other.crop) crop = other.crop;
}

void RasterOptions::apply(DemSettings& settings_out) const {
    settings_out.height_unit = height_unit.value_or(settings_out.height_unit);
    settings_out.height_scale = height_scale.value_or(settings_out.height_scale);
    settings_out.nodata = nodata;
    settings_out.encoding = encoding.value_or(settings_out.encoding);
    settings_out.cell = cell_m.value_or(settings_out.cell);
    settings_out.projection = project.value_or(settings_out.projection);
    settings_out.crop = crop;
}

void add_raster_options(CLI::App& app, RasterOptions& options) {
    app.add_option_function<std::string>(
           "--height-unit",
           [&options](const std::string& text) {
               if (text.empty())
                   throw CLI::ValidationError("--height-unit", "must name a unit, got ''");
               options.height_unit = text;
           },
           "Unit of a raster's numbers, such as m, foot or us-ft; replaces the unit that the file "
           "names")
        ->type_name("UNIT")
        ->group("Terrain");
    add_number(app, "--height-scale", options.height_scale, is_not_0, "a number other than 0",
               "Factor of a raster's heights, after its scale, offset and unit; -1 for depths");
    app.add_option_function<std::string>(
           "--nodata",
           [&options](const std::string& text) {
               options.nodata = parse_nodata(text);
               if (options.nodata) return;
               throw CLI::ValidationError(
                   "--nodata",
                   fmt::format("must be numbers separated by commas, or none, got '{:.60}'", text));
           },
           "Numbers of a raster that are nodata, besides those that the file declares; 'none': "
           "numbers such as -9999 are heights")
        ->type_name("X,...")
        ->group("Terrain");
    std::vector<std::string> names;
    for (const EncodingName& each : kEncodings) names.emplace_back(each.name);
    add_choice(
        app, "--encoding", std::move(names), 0,
        [&options](std::size_t number) { options.encoding = kEncodings[number].encoding; },
        "How a raster of colours encodes heights: the first band's numbers, or red, green and blue "
        "as in Terrarium or Mapbox tiles")
        ->default_str("")
        ->group("Terrain");
    add_number(
        app, "--cell-m", options.cell_m, is_above_0, "a number above 0",
        "Side of the cells of a raster without georeferencing, metres; 1 unless said. Also of "
        "one that is resampled: rotated, or with --project local; its own cells unless said");
    add_choice(
        app, "--project", {std::begin(kProjections), std::end(kProjections)}, 0,
        [&options](std::size_t number) { options.project = kProjectionOf[number]; },
        "Plane of a raster's world: that of its own CRS, or the local tangent plane at its middle, "
        "in "
        "which lengths and angles are true and the ground falls away with the Earth's curvature; "
        "none unless said: that of its CRS")
        ->default_str("")
        ->group("Terrain");
    app.add_option_function<std::string>(
           "--crop",
           [&options](const std::string& text) {
               const std::optional<std::vector<double>> numbers = parse_numbers(text);
               if (numbers) options.crop = crop_of(*numbers);
               if (options.crop) return;
               throw CLI::ValidationError(
                   "--crop", fmt::format("must be {}, got '{:.120}'", kCropText, text));
           },
           "Rectangle to which a raster is cropped, in the units of its CRS (without "
           "georeferencing: "
           "metres from its south-west corner); other samples are not read")
        ->type_name("W,S,E,N")
        ->group("Terrain");
}

Parsed<bool> read_raster_key(const std::string& key, const Json& value,
                             RasterOptions& options_out) {
    if (key == "height_unit") {
        if (!value.is_string() || value.get<std::string>().empty()) return wrong("a unit");
        options_out.height_unit = value.get<std::string>();
    } else if (key == "height_scale") {
        if (!value.is_number() || !is_not_0(value.get<double>()))
            return wrong("a number other than 0");
        options_out.height_scale = value.get<double>();
    } else if (key == "nodata") {
        options_out.nodata = nodata_of(value);
        if (!options_out.nodata) return wrong("a number, a list of numbers or none");
    } else if (key == "encoding") {
        options_out.encoding = encoding_of(value);
        if (!options_out.encoding) return wrong("numbers, terrarium or mapbox");
    } else if (key == "cell_m") {
        if (!value.is_number() || !is_above_0(value.get<double>())) return wrong("above 0");
        options_out.cell_m = value.get<double>();
    } else if (key == "project") {
        const auto* const found = std::ranges::find_if(
            kProjections, [&value](std::string_view name) { return value == name; });
        if (found == std::end(kProjections)) return wrong("none or local");
        options_out.project = kProjectionOf[found - std::begin(kProjections)];
    } else if (key == "crop") {
        const std::optional<std::vector<double>> numbers = numbers_of(value);
        if (numbers) options_out.crop = crop_of(*numbers);
        if (!options_out.crop) return wrong(kCropText);
    } else {
        return false;
    }
    return true;
}

std::string raster_path(const std::filesystem::path& folder, const std::string& name) {
    std::string joined = (folder / name).string();
    std::error_code error;
    const std::size_t colon = name.find(':');
    const auto is_of_prefix = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
    const bool has_prefix =
        colon != std::string::npos && colon > 0 &&
        std::all_of(name.begin(), name.begin() + static_cast<std::ptrdiff_t>(colon), is_of_prefix);
    if (!has_prefix || std::filesystem::exists(joined, error)) return joined;
    constexpr std::string_view kVirtual = "vrt://";
    const bool is_virtual = name.starts_with(kVirtual);
    std::size_t begin = is_virtual ? kVirtual.size() : colon + 1;
    while (begin < name.size()) {
        const bool is_quoted = name[begin] == '"';
        begin += is_quoted ? 1 : 0;
        const char* const end_of_file = is_virtual ? "?" : is_quoted ? "\"" : ":";
        const std::size_t end = std::min(name.find(end_of_file, begin), name.size());
        const std::filesystem::path file = folder / name.substr(begin, end - begin);
        if (end > begin && std::filesystem::is_regular_file(file, error)) {
            return name.substr(0, begin) + file.string() + name.substr(end);
        }
        begin = end + 1;
    }
    return name;
}

}  // namespace terrane::tools
