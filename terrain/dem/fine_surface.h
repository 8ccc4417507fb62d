// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear_grid.h"
#include "diamond_window.h"
#include "raster_patch.h"
#include "raster_store.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Samples that bounds need beyond those around their grid: what lies below a vertex reaches one and
/// a half cells, second differences one sample more.
inline constexpr int kBoundsMargin = 4;

/// The bilinear surface between samples, and its bounds up to the base spacing.
class FineSurface {
public:
    FineSurface(const BilinearGrid& grid, std::shared_ptr<const RasterStore> store)
        : grid_(grid), store_(std::move(store)) {}

    const BilinearGrid& grid() const { return grid_; }
    const RasterStore& store() const { return *store_; }

    /// One height; fails with io.
    Result<double> height(SamplePlace column, SamplePlace row) const;

    /// Reads the samples around a grid of lattice points, `margin` more on every side.
    Result<RasterPatch> patch(const SampleGrid& grid, int margin) const;

    /// Heights of the lattice points of a grid.
    void sample(const RasterPatch& patch, const SampleGrid& grid,
                std::span<double> heights_out) const;

    /// Bounds of the vertices of spacing grid.step < base step among a grid's points.
    ///
    /// @param patch with a margin of kBoundsMargin, here and below
    void vertex_bounds(const RasterPatch& patch, const SampleGrid& grid,
                       std::span<float> bounds_out) const;

    /// Bounds of the cells of side grid.step <= base step.
    void cell_bounds(const RasterPatch& patch, const SampleGrid& grid,
                     std::span<float> bounds_out) const;

    /// A window of the lattice of base spacing, indices in base spacings: heights, what the surface
    /// does between them, and the bounds of the vertices in the middle of the cells.
    Result<DiamondWindow> base_window(std::int64_t first_x, std::int64_t first_y, int columns,
                                      int rows) const;

private:
    struct Reach;
    /// Where equally spaced lattice indices lie between the samples.
    std::vector<SamplePlace> places(std::int64_t first, std::int64_t step, int count,
                                    bool along_x) const;
    std::vector<Reach> reaches(std::int64_t first, std::int64_t step, int count, std::int64_t reach,
                               bool along_x) const;
    float aligned_bound(const RasterPatch& patch, LatticePoint v, std::int64_t step) const;
    /// Bounds of a grid of vertices of one spacing and kind: all centres, or all midpoints of edges
    /// along the same axis.
    void aligned_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                        std::span<float> bounds_out) const;
    void kinked_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                       std::span<float> bounds_out) const;

    BilinearGrid grid_;
    std::shared_ptr<const RasterStore> store_;
};

}  // namespace terrane::internal
