// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/bilinear_grid.h"
#include "bilinear/kinked_surface.h"
#include "bilinear/raster_samples.h"

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// Adds a nanometre for the rounding of previous sums, and rounds outward to float. Non-decreasing; 0 at 0.
float round_outward(double deviation);

/// A rectangle of lattice points, with the surface between them and the bounds of the vertices at these points.
///
/// Distances are in units of the window's spacing. The bound of a vertex depends only on the surface within three times
/// (centres) or twice (midpoints) its spacing: two windows that contain this region agree on the bound bit for bit.
struct DiamondWindow {
    std::int64_t first_x = 0, first_y = 0;  ///< index of the south-western point
    int columns = 0, rows = 0;              ///< points
    std::vector<double> heights;            ///< [rows * columns]

    /// The surface over the window, if a cell of the window may overlap several raster cells. Null: over each cell the
    /// surface is the bilinear interpolant of the cell's corners.
    std::shared_ptr<KinkedSurface> kinked;

    /// [(rows - 1) * (columns - 1)] bound of the vertex in the middle of each cell, a vertex of the next finer spacing.
    /// May be empty.
    std::vector<float> middle_bounds;

    /// [rows * columns] bounds of vertices, up to the spacing for which they were computed; otherwise 0.
    std::vector<float> bounds;

    /// [rows], [columns] first of the equal rows, or columns, that end at this one: beyond the raster all are equal.
    /// Empty: none is known to be equal to another one.
    std::vector<int> row_runs, column_runs;

    /// Finds equal rows and columns. The surface must not be kinked: what lies between equal rows depends on x only.
    void find_runs();
    bool has_equal_rows(int first, int last) const {
        return !row_runs.empty() && row_runs[static_cast<std::size_t>(last)] <= first;
    }
    bool has_equal_columns(int first, int last) const {
        return !column_runs.empty() && column_runs[static_cast<std::size_t>(last)] <= first;
    }

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(x);
    }
    std::size_t cell_at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns - 1) +
               static_cast<std::size_t>(x);
    }
};

/// Largest deviation of the surface from the two triangles of the square of side n whose south-western corner is window
/// point (x, y). Requires x and y to be multiples of n, and the square to lie in the window.
float cell_deviation(const DiamondWindow& window, int x, int y, int n);

/// Adds the range of surface minus plane over a triangle that is part of a larger triangle with the same plane.
void add_triangle_part(const DiamondWindow& window, const RightTriangle& t, Range& range);
/// The same over the square of side n whose south-western corner is window point (x, y); the plane has the given
/// heights at that corner, n to the east of it and n to the north of it.
void add_square(const DiamondWindow& window, int x, int y, int n, double at_corner, double at_x_end,
                double at_y_end, Range& range);

/// Range of the true surface minus the bilinear interpolant of the corners of the square of side n whose south-western
/// corner is window point (x, y).
HeightInterval bilinear_deviation(const DiamondWindow& window, int x, int y, int n);

/// Computes the bounds of the vertices of spacing 1, 2, 4 ... last_n. Bounds that depend on the surface outside the
/// window are too small.
void compute_bounds(DiamondWindow& window, int last_n);

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
