// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/result.h>

#include <array>
#include <cstddef>
#include <string>

class GDALRasterBand;

namespace terrane::internal {

/// Cells longer than this times their width, or wider than this times their length, are refused: the
/// lattice is square and as fine as the shorter side, so that it has that many points for a sample.
inline constexpr double kMostCellRatio = 32.0;

/// What a raster can be refused for before its samples are read. Every message is one sentence that
/// names the raster and the value. `raster` stands for the raster's path everywhere.

/// Fails: io for what is there and is no file or folder: a pipe, a socket or a device gives no answer
///        to a reader that seeks, or makes it wait for ever
Result<void> check_is_file(const std::string& raster);

/// Fails: bad_data for complex numbers, and for a scale or offset that make no heights
Result<void> check_band(const std::string& raster, GDALRasterBand& band);

/// Fails: bad_data for coefficients that are not finite, and cells without area
Result<void> check_geotransform(const std::string& raster, const std::array<double, 6>& transform);

/// Fails: bad_data for cells below 1e-6 m, above 1e7 m or too oblong
Result<void> check_cells(const std::string& raster, const DemInfo& info);

/// Fails: bad_data for what is wider than the earth, or no longitude at all
///
/// @param west, east  of the outer edges, degrees
/// @param cell        degrees
Result<void> check_longitudes(const std::string& raster, double west, double east, double cell);

/// Fails: out_of_memory where a raster needs more than the limit
Result<void> check_memory(const std::string& raster, int columns, int rows, double needed_bytes,
                          std::size_t limit_bytes);

}  // namespace terrane::internal
