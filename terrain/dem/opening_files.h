// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/fine_surface.h"
#include "bounds/level_bounds.h"
#include "raster/raster_store.h"
#include "raster/scanned_samples.h"

#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>
#include <terrane/store/sealed_file.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

// Files with what opening a raster found.
namespace terrane::internal {

/// Bounds that opening a raster computes from its samples.
struct OpeningBounds {
    HeightPyramid pyramid;
    std::unique_ptr<BoundTiers> tiers;
};

/// How files of earlier openings were used: see DemInfo.
struct CacheUse {
    bool is_hit = false;
    std::string note;
    std::string samples_hash;  ///< as in DemInfo
};

/// Stores the bounds of a raster in a file. Its key is a hash of all samples, their rounding and the lattice, so that
/// bounds of other heights are never used. Several programs may open one raster at once: files appear atomically.
class OpeningCache {
public:
    /// Computes the key: one pass over the samples, unless the cache is off.
    /// Fails: io if the raster cannot be read
    static Result<OpeningCache> create(const DemCache& cache, const std::string& raster_path,
                                       const FineSurface& fine);

    /// The stored bounds; absent if there are none with this key.
    std::optional<OpeningBounds> load(const std::shared_ptr<const FineSurface>& fine);
    /// Stores the bounds in the first file that can be written.
    void save(const OpeningBounds& bounds);

    const CacheUse& use() const { return use_; }

private:
    std::vector<std::string> paths_;  ///< candidate files, in order of preference
    ContentHash key_;
    CacheUse use_;
};

/// What opening a raster found: statistics, hashes of samples, filled nodata, and all bounds. With this file the raster
/// is opened without a pass over its samples, which are compared with their hashes when they are read.
class RasterScan {
public:
    using GetFlags = std::function<Result<void>(const SampleGrid& grid, std::span<std::uint8_t>)>;

    /// Fails: io; bad_data if the file is damaged; invalid_argument if it is of another raster or lattice
    static Result<RasterScan> open(const std::string& path, const std::string& raster_path,
                                   const BilinearGrid& grid);
    /// Reads all samples once more. Flags of cells are added to the tiers.
    ///
    /// @param store     not resampled, and not reopened
    /// @param get_flags as HeightSource::cell_flags()
    /// @param file_versions RasterReader::file_versions()
    ///
    /// Fails: io
    static Result<void> write(const std::string& path, const std::string& file_versions,
                              const RasterStore& store, const BilinearGrid& grid,
                              OpeningBounds& bounds, const GetFlags& get_flags);

    const std::shared_ptr<const ScannedSamples>& samples() const { return samples_; }
    const std::string& file_versions() const { return file_versions_; }
    /// Fails: io; bad_data
    Result<OpeningBounds> bounds(const std::shared_ptr<const FineSurface>& fine) const;

private:
    RasterScan() = default;

    std::shared_ptr<const SealedReader> file_;
    std::string file_versions_;
    std::shared_ptr<const ScannedSamples> samples_;
    std::optional<HeightPyramid> pyramid_;
    SealedRecord tiers_;
};

}  // namespace terrane::internal
