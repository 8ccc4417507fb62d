// SPDX-License-Identifier: MIT
#pragma once

// Exports a square of terrain as a heightmap for Gazebo and other simulators that read SDF: a 16-bit image with 2^n + 1
// samples along each side, and an SDF model that places it. `terrane heightmap` writes both as files.
//
// Units: metres. Frame: the world's axes (x east, y north, z up); sdf_model() subtracts an origin.
// Layout: row by row from the north-west, as images are; samples lie on points of the source's lattice, and the square
// spans (side - 1) * spacing from the first to the last.
// Heights: from HeightSource::sample(). In the image, 0 is the lowest height and 65535 the highest, so that
// Gazebo's scale (size z over the brightest pixel) is exact; quantisation_error() bounds the rounding. Flat ground is
// all 0. Simulators choose cell diagonals by their own rules, so between samples their surface differs from the contact
// surface by up to half of a cell's twist. Volumes are not included: only the heightfield is exported.
//
// Absent ground: a heightmap has no holes. A square with points beyond the extent or over nodata is rejected with an
// error that gives their number, unless HeightmapSettings::absent_height is set to replace them.
//
// Threads: any number. Source: the SDF specification (sdformat.org), element heightmap.

#include <terrane/base/math.h>
#include <terrane/base/text.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::adapters {

/// Most samples along a side of a heightmap.
inline constexpr int kMostHeightmapSide = 8193;

/// Settings of make_heightmap().
struct HeightmapSettings {
    double centre_x = 0.0;  ///< world, rounded to the nearest lattice point of the level
    double centre_y = 0.0;  ///< as centre_x
    int side = 513;         ///< samples along a side, 2^n + 1, 3 to kMostHeightmapSide
    int level = 0;          ///< lattice level, which sets the sample spacing
    /// World z for samples without ground; if it is not set, such samples are an error.
    std::optional<double> absent_height = {};
};

/// A square of heights.
struct Heightmap {
    int side = 0;                      ///< samples along a side
    double spacing = 0.0;              ///< metres between samples
    double west = 0.0;                 ///< world x of the first column
    double north = 0.0;                ///< world y of the first row
    std::vector<double> heights = {};  ///< [side * side] world z, row by row from the north-west
    double low = 0.0, high = 0.0;      ///< lowest and highest height
    std::int64_t absent_count = 0;     ///< samples replaced by absent_height

    double width() const { return spacing * (side - 1); }  ///< from the first to the last sample
};

namespace internal {

// Flags, in a strip of rows, the lattice points that lie within the extent and are a corner of a cell of ground.
inline Result<std::vector<std::uint8_t>> find_ground(const HeightSource& source,
                                                     const SampleGrid& strip) {
    SampleGrid wider = strip;
    wider.corner = {strip.corner.x - strip.step, strip.corner.y - strip.step};
    wider.columns += 2;
    wider.rows += 2;
    const auto cells = static_cast<std::size_t>(wider.columns - 1);
    std::vector<std::uint8_t> flags(cells * static_cast<std::size_t>(wider.rows - 1));
    TERRANE_TRY(source.cell_flags(wider, flags));
    const Lattice& lattice = source.lattice();
    std::vector<std::uint8_t> is_ground(strip.size());
    std::size_t i = 0;
    for (int row = 0; row < strip.rows; ++row) {
        for (int column = 0; column < strip.columns; ++column, ++i) {
            const std::size_t sw =
                static_cast<std::size_t>(row) * cells + static_cast<std::size_t>(column);
            const bool has_cell =
                ((flags[sw] & flags[sw + 1] & flags[sw + cells] & flags[sw + cells + 1]) &
                 cell_outside) == 0;
            is_ground[i] = has_cell && source.extent().contains(
                                           lattice.x(strip.corner.x + column * strip.step),
                                           lattice.y(strip.corner.y + row * strip.step))
                               ? 1
                               : 0;
        }
    }
    return is_ground;
}

}  // namespace internal

/// Reads a square of heights from a source.
///
/// Fails: invalid_argument, naming the field and its value, or the number of samples without ground; io and bad_data of
///        the source
/// Cost:  O(side^2) samples of the source, and 8 bytes per sample
inline Result<Heightmap> make_heightmap(const HeightSource& source,
                                        const HeightmapSettings& settings) {
    const Lattice& lattice = source.lattice();
    const int side = settings.side;
    if (side < 3 || side > kMostHeightmapSide || ((side - 1) & (side - 2)) != 0) {
        return fail(ErrorCode::invalid_argument, "side must be 2^n + 1 from 3 to " +
                                                     number_text(kMostHeightmapSide) + ", got " +
                                                     number_text(side));
    }
    if (settings.level < 0 || settings.level > lattice.finest_level) {
        return fail(ErrorCode::invalid_argument, "level must be 0 to " +
                                                     number_text(lattice.finest_level) + ", got " +
                                                     number_text(settings.level));
    }
    for (const auto& [name, value] :
         {std::pair{"centre_x", settings.centre_x}, std::pair{"centre_y", settings.centre_y}}) {
        if (std::abs(value) <= 0x1p39) continue;
        return fail(ErrorCode::invalid_argument,
                    std::string(name) + " must be within 2^39 m, got " + number_text(value));
    }
    if (settings.absent_height && !(std::abs(*settings.absent_height) <= kMostHeight)) {
        return fail(ErrorCode::invalid_argument, "absent_height must be within 2^38 m, got " +
                                                     number_text(*settings.absent_height));
    }
    Heightmap map;
    map.side = side;
    map.spacing = lattice.level_spacing(settings.level);
    const std::int64_t step = lattice.step(settings.level);
    const auto first = [&](double centre, double origin) {
        return (std::llround((centre - origin) / map.spacing) - (side - 1) / 2) * step;
    };
    const LatticePoint corner{first(settings.centre_x, lattice.origin_x),
                              first(settings.centre_y, lattice.origin_y)};
    map.west = lattice.x(corner.x);
    map.north = lattice.y(corner.y + (side - 1) * step);
    map.heights.resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    constexpr int kStripRows = 64;  // bounds the memory of a source in one call
    std::vector<double> heights;
    for (int row = 0; row < side; row += kStripRows) {
        const SampleGrid strip{
            {corner.x, corner.y + row * step}, step, side, std::min(kStripRows, side - row)};
        heights.resize(strip.size());
        TERRANE_TRY(source.sample(strip, heights));
        TERRANE_TRY(const std::vector<std::uint8_t> is_ground,
                    internal::find_ground(source, strip));
        for (std::size_t i = 0; i < heights.size(); ++i) {
            if (is_ground[i] != 0) continue;
            ++map.absent_count;
            heights[i] = settings.absent_height.value_or(0.0);
        }
        for (int i = 0; i < strip.rows; ++i) {
            std::copy_n(
                heights.begin() + static_cast<std::ptrdiff_t>(i) * side, side,
                map.heights.begin() + static_cast<std::ptrdiff_t>(side - 1 - row - i) * side);
        }
    }
    if (map.absent_count > 0 && !settings.absent_height) {
        return fail(ErrorCode::invalid_argument,
                    "a heightmap has no holes, and " + number_text(map.absent_count) + " of its " +
                        number_text(map.heights.size()) + " samples are no ground");
    }
    map.low = map.high = map.heights.front();
    for (const double height : map.heights) {
        if (!std::isfinite(height))
            return fail(ErrorCode::bad_data, "a height of the source is not finite");
        map.low = std::min(map.low, height);
        map.high = std::max(map.high, height);
    }
    return map;
}

/// Bound of the rounding error of quantise(), metres: half a 16-bit step.
inline double quantisation_error(const Heightmap& map) {
    return (map.high - map.low) * (0.5 / 65535.0) * (1.0 + 1e-9);
}

/// [side * side] heights as 16-bit pixels: height = low + pixel / 65535 * (high - low).
inline std::vector<std::uint16_t> quantise(const Heightmap& map) {
    std::vector<std::uint16_t> pixels(map.heights.size());
    const double range = map.high - map.low;
    if (!(range > 0.0)) return pixels;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = static_cast<std::uint16_t>(
            std::floor((map.heights[i] - map.low) / range * 65535.0 + 0.5));
    }
    return pixels;
}

/// An SDF document with a static model of the heightmap image, for collision and visuals.
///
/// @param uri          of the image, as resolved by the simulator
/// @param origin_world origin of the simulator's frame
inline std::string sdf_model(const Heightmap& map, std::string_view name, std::string_view uri,
                             const WorldPos& origin_world = WorldPos::Zero()) {
    const auto escape = [](std::string_view text) {
        std::string out;
        for (const char letter : text) {
            switch (letter) {
                case '&':
                    out += "&amp;";
                    break;
                case '<':
                    out += "&lt;";
                    break;
                case '>':
                    out += "&gt;";
                    break;
                case '"':
                    out += "&quot;";
                    break;
                default:
                    out += letter;
            }
        }
        return out;
    };
    const auto numbers = [](double x, double y, double z) {
        char text[96];
        std::snprintf(text, sizeof text, "%.17g %.17g %.17g", x, y, z);
        return std::string(text);
    };
    const double range = map.high - map.low;
    const double half = 0.5 * map.width();
    const std::string geometry =
        "        <geometry>\n          <heightmap>\n            <uri>" + escape(uri) +
        "</uri>\n            <size>" +
        numbers(map.width(), map.width(), range > 0.0 ? range : 1.0) +
        "</size>\n            <pos>" +
        numbers(map.west + half - origin_world.x(), map.north - half - origin_world.y(),
                map.low - origin_world.z()) +
        "</pos>\n          </heightmap>\n        </geometry>\n";
    return "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n  <model name=\"" + escape(name) +
           "\">\n    <static>true</static>\n    <link name=\"ground\">\n      <collision "
           "name=\"collision\">\n" +
           geometry + "      </collision>\n      <visual name=\"visual\">\n" + geometry +
           "      </visual>\n    </link>\n  </model>\n</sdf>\n";
}

}  // namespace terrane::adapters
