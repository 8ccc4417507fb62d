// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>

#include <array>
#include <cstddef>
#include <string>

class GDALRasterBand;

namespace terrane::internal {

/// Largest accepted ratio of a cell's sides. The lattice is square and as fine as the shorter side, so this is also the
/// largest number of lattice points per sample.
inline constexpr double kMostCellRatio = 32.0;

/// The subject of messages: raster "PATH".
std::string named_raster(const std::string& path);

/// The checks below are made before the samples of a raster are read. Every message is one sentence that names the
/// raster and the value. `raster` is the raster's path.

/// Fails: io for a path that exists but is neither a file nor a folder: a pipe, socket or device cannot seek, or blocks
///        when it is read
Result<void> check_is_file(const std::string& raster);

/// Fails: bad_data for complex numbers, and for a scale or offset that is not finite or makes every number infinite or
///        NaN
Result<void> check_band(const std::string& raster, GDALRasterBand& band);

/// Fails: bad_data for coefficients that are not finite, and cells without area
Result<void> check_geotransform(const std::string& raster, const std::array<double, 6>& transform);

/// Fails: bad_data for cells below 1e-6 m, above 1e7 m or too oblong
Result<void> check_cells(const std::string& raster, const DemInfo& info);

/// Fails: bad_data for a width of more than a full turn, or values that cannot be longitudes
///
/// @param west, east longitudes of the outer edges, degrees
/// @param cell       width of a cell, degrees
Result<void> check_longitudes(const std::string& raster, double west, double east, double cell);

/// Fails: out_of_memory if a raster needs more than the limit
///
/// @param setting name of the limit's setting, for the message
Result<void> check_memory(const std::string& raster, int columns, int rows, double needed_bytes,
                          std::size_t limit_bytes,
                          const char* setting = "DemSettings::memory_bytes, --dem-memory-mb");

}  // namespace terrane::internal
