// SPDX-License-Identifier: MIT
#pragma once

#include "bounds/bound_tiers.h"
#include "bounds/height_pyramid.h"

#include <terrane/store/sealed_file.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::internal {

/// What opening a raster computes from its samples.
struct OpeningBounds {
    HeightPyramid pyramid;
    std::unique_ptr<const BoundTiers> tiers;
};

/// How an opening used the cache: see DemInfo.
struct CacheUse {
    bool is_hit = false;
    std::string note;
};

/// Stores the bounds of a raster in a file. The key is a hash of every sample, of the lattice and of the format's
/// version, so that bounds of other heights are never read. Several programs may open one raster at once: files
/// appear atomically.
class OpeningCache {
public:
    /// Computes the key: one pass over the samples, unless the cache is off.
    /// Fails: io if the raster cannot be read
    static Result<OpeningCache> create(const DemCache& cache, const std::string& raster_path,
                                       const FineSurface& fine);

    /// The stored bounds; nothing if there are none with this key.
    std::optional<OpeningBounds> load(const std::shared_ptr<const FineSurface>& fine);
    /// Stores bounds in the first of the files that can be written.
    void save(const OpeningBounds& bounds);

    const CacheUse& use() const { return use_; }

private:
    std::vector<std::string> paths_;  ///< files, in the order in which they are tried
    ContentHash key_;
    CacheUse use_;
};

}  // namespace terrane::internal
