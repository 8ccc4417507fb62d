// SPDX-License-Identifier: MIT
#include "dem_source.h"

#include <terrane/base/text.h>
#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace terrane::internal {

/// Fails: invalid_argument if the detail's roughness is out of range
Result<void> check_detail(const DemSettings& settings);

/// Adds fractal detail between the samples of a raster, with an amplitude proportional to the local roughness. The
/// detail vanishes at the samples and outside the surveyed ground.
///
/// Fails: io; invalid_argument
Result<std::shared_ptr<const HeightSource>> add_dem_detail(std::shared_ptr<const DemSource> source,
                                                           const DemSettings& settings);

namespace {

/// Amplitude of the first octave relative to the samples' mean second difference. If the raster is continued as a
/// fractal with a gain of 1/2, it is the amplitude of the sine with half the shortest wavelength that samples resolve.
constexpr double kAmplitudeOverBend = 0.5;
constexpr int kMaxOctaves = 24;

/// Number of octaves, with wavelengths from the cell downward; the shortest is at least two finest spacings.
int octaves_below(double cell, double finest) {
    int count = 1;
    for (double wavelength = 0.5 * cell; wavelength >= 2.0 * finest && count < kMaxOctaves;
         wavelength *= 0.5) {
        ++count;
    }
    return count;
}

/// Mean absolute second difference, along rows and columns, of the samples of a block. Differences that would need
/// samples beyond the raster are left out.
double mean_bend(const RasterPatch& patch, const BilinearGrid& grid, int west, int south, int east,
                 int north) {
    double sum = 0.0;
    int count = 0;
    for (int row = south; row <= north; ++row) {
        for (int column = west; column <= east; ++column) {
            if (column > 0 && column + 1 < grid.columns) {
                sum += std::fabs(patch.bend_x(column, row));
                ++count;
            }
            if (row > 0 && row + 1 < grid.rows) {
                sum += std::fabs(patch.bend_y(column, row));
                ++count;
            }
        }
    }
    return count > 0 ? sum / count : 0.0;
}

}  // namespace

Result<void> check_detail(const DemSettings& settings) {
    constexpr double kMostRoughness = 100.0;
    if (!(settings.detail_roughness >= 0.0 && settings.detail_roughness <= kMostRoughness)) {
        return fail(ErrorCode::invalid_argument, "detail_roughness must be 0 to 100, got " +
                                                     number_text(settings.detail_roughness));
    }
    return {};
}

Result<std::shared_ptr<const HeightSource>> add_dem_detail(std::shared_ptr<const DemSource> source,
                                                           const DemSettings& settings) {
    const BilinearGrid& grid = source->grid();
    const RasterStore& store = source->store();
    DetailField field;
    field.origin_x = grid.west;
    field.origin_y = grid.south;
    field.cell_x = grid.cell_x;
    field.cell_y = grid.cell_y;
    field.columns = (grid.columns + kBlockSide - 1) / kBlockSide;
    field.rows = (grid.rows + kBlockSide - 1) / kBlockSide;
    const double middle = 0.5 * (kBlockSide - 1);
    field.node_origin_x = grid.west + middle * grid.cell_x;
    field.node_origin_y = grid.south + middle * grid.cell_y;
    field.node_spacing_x = kBlockSide * grid.cell_x;
    field.node_spacing_y = kBlockSide * grid.cell_y;

    RasterPatch patch;
    patch.column = -1;
    patch.columns = grid.columns + 2;
    patch.rows = kBlockSide + 2;
    patch.samples.resize(static_cast<std::size_t>(patch.columns) *
                         static_cast<std::size_t>(patch.rows));
    for (int y = 0; y < field.rows; ++y) {
        const int south = y * kBlockSide;
        const int north = std::min(south + kBlockSide, grid.rows) - 1;
        patch.row = south - 1;
        if (auto read =
                store.read(patch.column, patch.row, patch.columns, patch.rows, patch.samples);
            !read) {
            return tl::unexpected(read.error());
        }
        for (int x = 0; x < field.columns; ++x) {
            const int west = x * kBlockSide;
            const int east = std::min(west + kBlockSide, grid.columns) - 1;
            // No detail outside the survey.
            TERRANE_TRY(const auto flags, store.flags(west, south, east, north));
            const bool is_outside = (flags & cell_outside) != 0;
            const double amplitude = is_outside
                                         ? 0.0
                                         : settings.detail_roughness * kAmplitudeOverBend *
                                               mean_bend(patch, grid, west, south, east, north);
            field.amplitude.push_back(static_cast<float>(amplitude));
        }
    }
    DetailSettings detail;
    detail.seed = settings.detail_seed.value_or(1);
    detail.octave_count = octaves_below(std::min(grid.cell_x, grid.cell_y), grid.lattice.spacing);
    return add_detail(std::move(source), std::move(field), detail);
}

}  // namespace terrane::internal

namespace terrane {
namespace {

Result<void> check(const DemSettings& settings) {
    if (!(settings.read_timeout > 0.0)) {
        char text[80];
        std::snprintf(text, sizeof text, "read_timeout must be above 0 s, got %g",
                      settings.read_timeout);
        return fail(ErrorCode::invalid_argument, text);
    }
    if (!(settings.spacing_tolerance >= 1.0 && settings.spacing_tolerance <= 2.0)) {
        char text[80];
        std::snprintf(text, sizeof text, "spacing_tolerance must be 1 to 2, got %g",
                      settings.spacing_tolerance);
        return fail(ErrorCode::invalid_argument, text);
    }
    return internal::check_detail(settings);
}

Result<std::shared_ptr<const HeightSource>> open_source(const std::string& path,
                                                        const DemSettings& settings,
                                                        DemInfo* info_out) {
    internal::StoreSettings store;
    store.limit_bytes = settings.memory_bytes;
    store.patience_s = settings.read_timeout;
    store.bounds_cache = settings.cache;
    store.scan_file = settings.scan_file;
    TERRANE_TRY(store.reading, internal::number_reading(settings));
    TERRANE_TRY(auto source,
                internal::DemSource::create(path, settings.finest_spacing, store, settings.progress,
                                            settings.spacing_tolerance));
    if (info_out != nullptr) {
        *info_out = source->info();
        info_out->from_cache = source->cache_use().is_hit;
        info_out->cache_note = source->cache_use().note;
        info_out->samples_hash = source->cache_use().samples_hash;
    }
    if (!settings.detail_seed) return source;
    return internal::add_dem_detail(source, settings);
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> DemHeights::open(const std::string& path,
                                                             const DemSettings& settings,
                                                             DemInfo* info_out) {
    TERRANE_TRY(check(settings));
    try {
        return open_source(path, settings, info_out);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory,
                    "out of memory while opening raster \"" + path + "\"");
    }
}

}  // namespace terrane
