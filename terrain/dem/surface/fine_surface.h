// SPDX-License-Identifier: MIT
#pragma once

#include "raster/raster_store.h"
#include "surface/bilinear_grid.h"
#include "surface/diamond_window.h"
#include "surface/raster_patch.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Margin of samples around a grid that bounds need: the descendants of a vertex extend one and a half cells, second
/// differences one sample more.
inline constexpr int kBoundsMargin = 4;

/// The bilinear surface between samples, and its bounds up to the base spacing. Heights are metres from
/// the store's base.
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

    /// As HeightSource::vertex_bounds, up to 64 base spacings.
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;

    /// As HeightSource::cell_bounds, up to 128 base spacings.
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;

    /// A window of a lattice of at most base spacing, indices in its steps: heights, and the surface between them.
    Result<DiamondWindow> surface_window(const SampleGrid& grid) const;
    /// The same with bounds of the vertices in the middle of its cells that cover all their descendants.
    Result<DiamondWindow> bounds_window(const SampleGrid& grid) const;

private:
    struct Reach;
    DiamondWindow make_window(const RasterPatch& patch, const SampleGrid& grid) const;
    /// Positions of equally spaced lattice indices between the samples.
    std::vector<SamplePlace> places(std::int64_t first, std::int64_t step, int count,
                                    bool along_x) const;
    std::vector<Reach> reaches(std::int64_t first, std::int64_t step, int count, std::int64_t reach,
                               bool along_x) const;
    /// Bounds of the vertices of spacing grid.step < base step, if samples are lattice points.
    Result<void> aligned_vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    float aligned_bound(const RasterPatch& patch, LatticePoint v, std::int64_t step) const;
    /// Bounds of a grid of vertices of one spacing and kind: all centres, or all midpoints of edges
    /// along the same axis.
    void aligned_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                        std::span<float> bounds_out) const;
    /// Bounds of a grid of centres that cover their descendants, too.
    void kinked_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                       std::span<float> bounds_out) const;

    BilinearGrid grid_;
    std::shared_ptr<const RasterStore> store_;
};

}  // namespace terrane::internal
