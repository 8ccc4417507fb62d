// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <cstdint>
#include <span>

namespace terrane {

/// A closed interval of heights, metres.
struct HeightInterval {
    double low = 0.0;   ///< metres
    double high = 0.0;  ///< metres, >= low
};

/// Flags of a cell of the ground. They are bits, because a cell may touch both a filled void and the outside.
enum CellFlag : std::uint8_t {
    cell_ground = 0,   ///< valid ground
    cell_outside = 1,  ///< beyond the surveyed area, or nodata connected to its border
    cell_filled = 2,   ///< an enclosed void that was filled smoothly
};

/// A rectangle in the world's plane, metres.
struct WorldRect {
    double west = 0.0, south = 0.0, east = 0.0, north = 0.0;  ///< metres
    /// Whether a point is in the rectangle, edges included.
    bool contains(double x, double y) const {
        return x >= west && x <= east && y >= south && y <= north;
    }
    friend bool operator==(const WorldRect&, const WorldRect&) = default;
};

/// A source of heights, such as a fractal, a file or a test plane. If some chunks are not computed from its heights, it
/// is also a ChunkSource.
///
/// The true surface is z = height(x, y). The same call always gives the same bits, on any thread and in any order,
/// because the pager may evict a chunk and load it again.
///
/// Vertices of the triangulation. A *vertex of spacing s* (s in finest spacings, a power of two) is a lattice point
/// whose coordinates are multiples of s, but not both multiples of 2s. If both are odd multiples of s, it is the
/// *centre* of a square of side 2s; otherwise it is the *midpoint* of an edge of such a square. A vertex splits the
/// edge between its two *ends*. The ends of a midpoint are its neighbours at distance s along the square's edge; the
/// ends of a centre are the two corners of its square whose index sum, in units of 2s, is even. The *diamond* of a
/// vertex is the two triangles that share the edge. Its *children* are the vertices that split the outer edges of the
/// diamond. The children of a centre are the four midpoints of spacing s on the edges of its square. The children of a
/// midpoint are the centres of spacing s / 2 of the four squares of side s around it (of two on a border).
///
/// Bounds. vertex_bounds() certifies e(v): over the diamond of v, the vertical distance between the true surface and
/// the two triangles (with heights that are not quantised) is at most e(v). cell_bounds() does the same for the two
/// triangles of a cell of side s, which is cut between its corners of even index sum (in units of s). Bounds are pure
/// functions of the address and rounded outward. They are nested within a spacing: the bound of a centre is at least
/// the bounds of the midpoints that are its children; for fractals, the bound of a midpoint is also at least the bounds
/// of the cells around it. They are nested from spacing to spacing too, except for fractals, where a few centres have
/// up to 1.5 times the bounds of their parent midpoints.
///
/// Everything that Terrane certifies depends on these properties. check_source() in check_source.h checks them by
/// sampling; docs/height_source.md shows how to write a source.
class HeightSource {
public:
    virtual ~HeightSource() = default;

    /// The integer addresses of this source's samples.
    const Lattice& lattice() const { return lattice_; }

    /// The rectangle with ground. The surface beyond it is drawn, but is not ground.
    const WorldRect& extent() const { return extent_; }

    /// Height of the true surface at (x, y), world z in metres. Requires finite x and y; the surface continues smoothly
    /// beyond the extent. At a lattice point the height equals that of sample() to 1e-9 m.
    ///
    /// Fails:   NaN if the source cannot be read
    /// Threads: any number at once, as all functions here
    virtual double height(double x, double y) const = 0;

    /// Computes the heights at a grid of lattice points.
    ///
    /// @param heights_out [grid.size()] world z, metres; make_chunk() refuses heights beyond kMostHeight or kMostQuanta
    ///     quanta
    ///
    /// Fails: io if the source cannot be read
    virtual Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const = 0;

    /// Certified bounds of the vertices of spacing `grid.step` among a grid's points. Requires a grid whose corner is a
    /// multiple of 2 * step.
    ///
    /// @param bounds_out [grid.size()] metres; 0 at points that are not vertices of that spacing
    virtual Result<void> vertex_bounds(const SampleGrid& grid,
                                       std::span<float> bounds_out) const = 0;

    /// Certified bounds of a grid's cells. The side of the cells, `grid.step`, is at most Lattice::step(0).
    ///
    /// @param bounds_out [(columns - 1) * (rows - 1)] metres
    virtual Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const = 0;

    /// The bounds of both functions above in one call, which may cost less. Default: calls one after the other.
    ///
    /// @param vertex_bounds_out  as for vertex_bounds()
    /// @param cell_bounds_out    as for cell_bounds()
    virtual Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                     std::span<float> cell_bounds_out) const;

    /// CellFlag bits of a grid's cells. Default: all cells are ground.
    ///
    /// @param flags_out [(columns - 1) * (rows - 1)]
    virtual Result<void> cell_flags(const SampleGrid& grid,
                                    std::span<std::uint8_t> flags_out) const;

    /// An interval that contains all heights of the true surface over a closed rectangle, metres. Must answer from
    /// memory, without waiting for storage: in every frame, drawing asks for a few squares around each eye, and the
    /// pager for chunks that bodies are about to reach.
    virtual HeightInterval interval(const WorldRect& rect) const = 0;

    /// Upper bound of the height difference, metres, between any two points of the true surface that are at most
    /// `distance` metres apart in plan. Does not decrease with distance.
    virtual double rise_bound(double distance) const = 0;

    /// Whether bounds, intervals and rises are certified. If not, they are estimates: triangles and loads are still
    /// chosen by them, but the results that they would certify (TerrainMesh::error_px, error_m of the ground's answers)
    /// are infinite. Default: true.
    virtual bool is_certified() const;

protected:
    /// Lattice and extent, metres, are fixed for the life of the source.
    HeightSource(const Lattice& lattice, const WorldRect& extent)
        : lattice_(lattice), extent_(extent) {}

private:
    Lattice lattice_;
    WorldRect extent_;
};

}  // namespace terrane
