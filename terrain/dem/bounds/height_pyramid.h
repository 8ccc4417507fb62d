// SPDX-License-Identifier: MIT
#pragma once

#include "raster/opening_progress.h"
#include "raster/raster_store.h"
#include "surface/bilinear_grid.h"

#include <terrane/store/bytes.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Lowest and highest sample of the closed squares of 8, 16, 32 ... raster cells, and the steepest slope: bounds of the
/// bilinear surface. Heights are metres from the store's base.
class HeightPyramid {
public:
    /// Fails: io; cancelled
    static Result<HeightPyramid> create(const BilinearGrid& grid, const RasterStore& store,
                                        OpeningProgress& progress);

    /// For opening_cache; read() fails with bad_data if the bytes are not of this grid.
    void write(ByteWriter& out) const;
    static Result<HeightPyramid> read(const BilinearGrid& grid, ByteReader& in);

    /// Contains every height over a closed rectangle of the plane.
    HeightInterval interval(const WorldRect& rect) const;
    /// As HeightSource::rise_bound.
    double rise_bound(double distance) const;
    HeightInterval range() const { return levels_.back().nodes.front(); }

private:
    struct Level {
        int columns = 0, rows = 0;
        std::vector<HeightInterval> nodes;
        double rise = 0.0;  ///< largest range of 2 x 2 adjacent nodes
    };

    Result<void> add_samples(const RasterStore& store, OpeningProgress& progress);
    void add_levels();

    BilinearGrid grid_;
    std::vector<Level> levels_;  ///< level k: nodes of 8 * 2^k cells
    double slope_ = 0.0;         ///< largest gradient
};

}  // namespace terrane::internal
