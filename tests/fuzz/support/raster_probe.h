// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace terrane::fuzz {

/// Leaves GDAL the drivers of files that name no other file, GTiff, AAIGrid, USGSDEM, DTED, PNG, BMP and ENVI, and VRT,
/// by which the library warps; see names_other_files().
void keep_plain_drivers();

/// Whether a file is of the driver VRT, and may name others.
bool names_other_files(std::span<const std::uint8_t> bytes);

/// Opens a raster as heights, imagery and surface map, and reads some of each. Larger ones than 2^16 samples are left
/// out, because their cost is that of their samples.
void probe_raster(const std::string& path);

/// Writes a file in GDAL's memory. Returns its path.
std::string write_memory_file(const std::string& name, std::span<const std::uint8_t> bytes);

}  // namespace terrane::fuzz
