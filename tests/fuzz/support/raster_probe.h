// SPDX-License-Identifier: MIT
#pragma once

#include <gdal_priv.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace terrane::fuzz {

/// Leaves GDAL the drivers of files that name no other file, GTiff, AAIGrid, USGSDEM, DTED, PNG, BMP and ENVI, and VRT,
/// by which the library warps; see names_other_files().
void keep_plain_drivers();

/// Whether a file is of the driver VRT, and may name others.
bool names_other_files(std::span<const std::uint8_t> bytes);

/// Opens a raster as heights, imagery and surface map, and reads some of each. Larger ones than 2^16 samples are left
/// out, because their cost is that of their samples.
void probe_raster(const std::string& path);

/// A new GeoTIFF in GDAL's memory.
GDALDatasetUniquePtr create_geotiff(const std::string& path, int columns, int rows, int bands,
                                    GDALDataType type);

/// Writes the same samples to all bands; false where GDAL refuses them.
bool write_samples(GDALDataset& file, std::vector<double>& samples);

/// Writes a file in GDAL's memory. Returns its path.
std::string write_memory_file(const std::string& name, std::span<const std::uint8_t> bytes);

}  // namespace terrane::fuzz
