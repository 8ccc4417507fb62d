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

/// What opening a raster makes of its samples.
struct OpeningBounds {
    HeightPyramid pyramid;
    std::unique_ptr<const BoundTiers> tiers;
};

/// How an opening used its cache: see DemInfo.
struct CacheUse {
    bool is_hit = false;
    std::string note;
};

/// Keeps the bounds of a raster in a file. The key is a hash of every sample, of the lattice and of the
/// version of what is kept: there is no other way to get at bounds of other heights. Several programs may
/// open one raster at once: a file is whole or not there.
class OpeningCache {
public:
    /// Makes the key: one pass over the samples, unless nothing is kept.
    /// Fails: io where the raster cannot be read
    static Result<OpeningCache> create(const DemCache& cache, const std::string& raster_path,
                                       const FineSurface& fine);

    /// What was kept; nothing where there is nothing that is right.
    std::optional<OpeningBounds> load(const std::shared_ptr<const FineSurface>& fine);
    /// Keeps it, in the first place that takes it.
    void save(const OpeningBounds& bounds);

    const CacheUse& use() const { return use_; }

private:
    std::vector<std::string> places_;  ///< files, in the order in which they are tried
    ContentHash key_;
    CacheUse use_;
};

}  // namespace terrane::internal
