// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/diamond_window.h"
#include "bilinear/raster_samples.h"

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Width of the margin of samples around a grid on which the grid's bounds depend: the descendants of a vertex extend
/// one and a half cells from it, and second differences one sample more.
inline constexpr int kBoundsMargin = 4;

/// The bilinear surface between samples, and its bounds up to the base spacing. Heights are metres relative to the
/// base of the samples.
class FineSurface {
public:
    FineSurface(const BilinearGrid& grid, std::shared_ptr<const RasterSamples> samples)
        : grid_(grid), samples_(std::move(samples)) {}

    const BilinearGrid& grid() const { return grid_; }
    const RasterSamples& samples() const { return *samples_; }

    /// One height; fails with io.
    Result<double> height(SamplePlace column, SamplePlace row) const;

    /// Reads the samples around a grid of lattice points, with a margin on every side.
    Result<RasterPatch> patch(const SampleGrid& grid, int margin) const;

    /// Heights of the lattice points of a grid.
    void sample(const RasterPatch& patch, const SampleGrid& grid,
                std::span<double> heights_out) const;

    /// As HeightSource::vertex_bounds, up to 64 base spacings.
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;

    /// As HeightSource::cell_bounds, up to 128 base spacings.
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;

    /// Both, as HeightSource::mesh_bounds, up to 64 base spacings. Reads and interpolates the samples once if it can.
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const;

    /// Heights of a grid's points and the surface between them, without bounds. Requires a step of at most the base
    /// spacing; indices of the window are in steps of the grid.
    Result<DiamondWindow> surface_window(const SampleGrid& grid) const;
    /// The same with middle_bounds, which cover all descendants of the vertices in the middle of the cells.
    Result<DiamondWindow> bounds_window(const SampleGrid& grid) const;

private:
    struct Reach;
    DiamondWindow make_window(const RasterPatch& patch, const SampleGrid& grid) const;
    /// Sample positions of equally spaced lattice indices.
    std::vector<SamplePlace> places(std::int64_t first, std::int64_t step, int count,
                                    bool along_x) const;
    std::vector<Reach> reaches(std::int64_t first, std::int64_t step, int count, std::int64_t reach,
                               bool along_x) const;
    /// Spacings of the windows in which the bounds of vertices and of cells of a grid are computed.
    std::int64_t vertex_window_step(const SampleGrid& grid) const;
    std::int64_t cell_window_step(const SampleGrid& grid) const;
    /// Bounds of vertices and, if the span is not empty, of cells of a grid from a window of vertex_window_step().
    Result<void> window_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                               std::span<float> cell_bounds_out) const;
    /// Bounds of the vertices of spacing grid.step < base step, for aligned grids.
    Result<void> aligned_vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const;
    float aligned_bound(const RasterPatch& patch, LatticePoint v, std::int64_t step) const;
    /// Bounds of a grid of vertices of one spacing and kind: all centres, or all midpoints of edges
    /// along the same axis.
    void aligned_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                        std::span<float> bounds_out) const;
    /// Bounds of a grid of centres that also cover the centres' descendants.
    void kinked_bounds(const RasterPatch& patch, const SampleGrid& grid, std::int64_t vertex_step,
                       std::span<float> bounds_out) const;

    BilinearGrid grid_;
    std::shared_ptr<const RasterSamples> samples_;
};

/// Upper bound of the distance between the surface of some samples and the true surface, over a closed rectangle of the
/// lattice, metres.
using SurfaceError = std::function<double(LatticePoint low, LatticePoint high)>;

/// Adds to the bound of each vertex of a grid the error over its diamond and the diamonds of its descendants.
void add_vertex_error(const SampleGrid& grid, const SurfaceError& error_over,
                      std::span<float> bounds);
/// Adds the error to the bounds of a grid's cells.
void add_cell_error(const SampleGrid& grid, const SurfaceError& error_over,
                    std::span<float> bounds);

/// Implemented by height sources that may consist of a FineSurface, so that other components can keep its samples
/// instead of heights and bounds.
class BilinearSource {
public:
    virtual ~BilinearSource() = default;
    /// The surface that gives the source its heights. Its bounds plus the rounding of its samples are the source's
    /// bounds of vertices and cells up to kFineCells base spacings. Null if the source has no such surface.
    virtual const FineSurface* bilinear_surface() const = 0;
};

/// Greatest spacing, in base spacings, of the vertices and cells whose bounds a source takes from its FineSurface.
inline constexpr std::int64_t kFineCells = 2;

}  // namespace terrane::internal
