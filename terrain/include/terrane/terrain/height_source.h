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

/// Kind of a cell of the ground. Bits, because a cell may touch both a filled void and the outside.
enum CellFlag : std::uint8_t {
    cell_ground = 0,   ///< valid ground
    cell_outside = 1,  ///< beyond the surveyed area, or nodata connected to its border
    cell_filled = 2,   ///< an enclosed void that was filled smoothly
};

/// A rectangle in the world's plane, metres.
struct WorldRect {
    double west = 0.0, south = 0.0, east = 0.0, north = 0.0;  ///< metres
    /// True on the edges too.
    bool contains(double x, double y) const {
        return x >= west && x <= east && y >= south && y <= north;
    }
    friend bool operator==(const WorldRect&, const WorldRect&) = default;
};

/// A source of heights: a fractal, a file, a test plane. One that has chunks of its own is a ChunkSource too.
///
/// The true surface is z = height(x, y). The same call always gives the same bits, on any thread and in any
/// order: the pager may evict a chunk and load it again.
///
/// Vertices of the triangulation. A *vertex of spacing s* (s in finest spacings, a power of two)
/// is a lattice point whose coordinates are multiples of s, not both of 2s: the *centre* of a
/// square of side 2s (both odd multiples), or the *midpoint* of such a square's edge. It splits the
/// edge between its ends: a midpoint's ends are its two neighbours at distance s along that edge; a
/// centre's are the two corners of its square whose index sum, in units of 2s, is even. Its *diamond*
/// is the two triangles that share that edge. Its *children* are the vertices of the next
/// level of bisection inside the diamond: of a centre of spacing s the four midpoints of spacing s on its
/// square's edges, of a midpoint of spacing s the four (two on a border) centres of spacing s / 2
/// of the squares of side s around it.
///
/// Bounds. vertex_bounds() certifies e(v): in the diamond of v the vertical distance of the true surface from the
/// two triangles (over unquantised heights) is at most e(v). cell_bounds() does
/// the same for the two triangles of a cell of side s, cut by the diagonal that joins its corners of
/// even index sum (indices in units of s). Bounds are pure functions of the address, rounded outward, and
/// nested within a spacing: a centre's are at least those of its midpoints (theirs, of fractals, at
/// least those of the cells around). To the next spacing they are nested too, but for fractals: there
/// a few centres have bounds of up to 1.5 times those of their parent midpoints.
///
/// Everything that Terrane certifies depends on these laws. check_source() in check_source.h checks them by
/// sampling; docs/height_source.md shows how to write a source.
class HeightSource {
public:
    virtual ~HeightSource() = default;

    /// The integer addresses of this source's samples.
    const Lattice& lattice() const { return lattice_; }

    /// The rectangle of the ground; what is outside is drawn, but is no ground.
    const WorldRect& extent() const { return extent_; }

    /// The true surface, world z in metres, at any finite x, y; continues smoothly beyond the extent. At a lattice
    /// point it equals sample() to 1e-9 m.
    ///
    /// Fails:   NaN if the source cannot be read
    /// Threads: any number at once, as all functions here
    virtual double height(double x, double y) const = 0;

    /// Fills the heights of a grid of lattice points.
    ///
    /// @param heights_out [grid.size()] world z, metres; a chunk with one beyond kMostHeight, or
    ///     beyond kMostQuanta quanta, is not made
    ///
    /// Fails: io if the source cannot be read
    virtual Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const = 0;

    /// Certified bounds of the vertices of spacing `grid.step` among a grid's points. The corner
    /// must be a multiple of 2 * step.
    ///
    /// @param bounds_out [grid.size()] metres; 0 at points that are no vertices of that spacing
    virtual Result<void> vertex_bounds(const SampleGrid& grid,
                                       std::span<float> bounds_out) const = 0;

    /// Certified bounds of the cells of side `grid.step` of a grid, which is at most Lattice::step(0).
    ///
    /// @param bounds_out [(columns - 1) * (rows - 1)] metres
    virtual Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const = 0;

    /// Both bounds in one call, which may cost less. Default: one after the other.
    ///
    /// @param vertex_bounds_out  as of vertex_bounds()
    /// @param cell_bounds_out    as of cell_bounds()
    virtual Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                     std::span<float> cell_bounds_out) const;

    /// Bits of CellFlag of the cells of a grid. Default: all ground.
    ///
    /// @param flags_out [(columns - 1) * (rows - 1)]
    virtual Result<void> cell_flags(const SampleGrid& grid,
                                    std::span<std::uint8_t> flags_out) const;

    /// An interval that contains all heights of the true surface over a closed rectangle, metres. Called in every
    /// frame, by drawing for a few squares around each eye and by the pager for chunks that bodies reach first: must
    /// answer from memory, without waiting for storage.
    virtual HeightInterval interval(const WorldRect& rect) const = 0;

    /// Upper bound of the height difference of two points of the surface at most `distance` apart in the plane,
    /// metres. Not decreasing in distance.
    virtual double rise_bound(double distance) const = 0;

    /// Whether the bounds, intervals and rises are certified. Where they are estimates (false), they choose triangles
    /// and loads as others do, and whatever is certified from them is infinite: TerrainMesh::error_px, error_m of the
    /// ground's answers. Default: true.
    virtual bool is_certified() const;

protected:
    /// Of a source whose heights are defined over `extent`, metres; both are fixed for its life.
    HeightSource(const Lattice& lattice, const WorldRect& extent)
        : lattice_(lattice), extent_(extent) {}

private:
    Lattice lattice_;
    WorldRect extent_;
};

}  // namespace terrane
