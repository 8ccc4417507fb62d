// SPDX-License-Identifier: MIT
#pragma once

#include "raster/raster_reader.h"

#include <terrane/dem/surface_raster.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// The samples of a surface raster, in 32 bits each: a material's number, or the bits of a friction as a float.
struct SurfaceSamples {
    /// Stands for nodata: no material has this number, and no float in range these bits.
    static constexpr std::uint32_t kNodata = ~std::uint32_t{0};

    /// Reads all samples, from the first row of the file to the last.
    ///
    /// Fails: io; timed_out; bad_data for a sample out of range; out_of_memory above the settings' limit, before
    ///        anything is read
    static Result<SurfaceSamples> read(std::shared_ptr<const RasterReader> reader,
                                       const SurfaceRasterSettings& settings);

    std::vector<std::uint32_t> all;  ///< row by row from the south-west
    std::size_t nodata_count = 0;
};

}  // namespace terrane::internal
