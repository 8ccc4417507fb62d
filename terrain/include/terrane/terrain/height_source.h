// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>

namespace terrane {

struct Chunk;

/// A closed interval of heights, metres.
struct HeightInterval {
    double low = 0.0;
    double high = 0.0;
};

/// What a cell of the ground is. Bits, because a filled void may touch the outside.
enum CellFlag : std::uint8_t {
    cell_ground = 0,
    cell_outside = 1,  ///< beyond the surveyed area, or nodata connected to its border
    cell_filled = 2,   ///< an enclosed void that was filled smoothly
};

/// A rectangle in the world's plane, metres.
struct WorldRect {
    double west = 0.0, south = 0.0, east = 0.0, north = 0.0;
    bool contains(double x, double y) const {
        return x >= west && x <= east && y >= south && y <= north;
    }
};

/// Where heights come from: a fractal, a file, a test plane.
///
/// The true surface is z = height(x, y). The same question always gives the same bits, on any
/// thread, in any order: the pager may evict a chunk and ask for it again.
///
/// Vertices of the triangulation. A *vertex of spacing s* (s in finest spacings, a power of two)
/// is a lattice point whose coordinates are multiples of s, not both of 2s: the *centre* of a
/// square of side 2s (both odd multiples), or the *midpoint* of such a square's edge. It splits the
/// edge between its ends: a midpoint's ends are its two neighbours at distance s along that edge; a
/// centre's are the two corners of its square whose index sum, in units of 2s, is even. Its *diamond*
/// is the two triangles that share that edge. Its *children* are the vertices that split the
/// diamond's halves' halves: of a centre of spacing s the four midpoints of spacing s on its
/// square's edges, of a midpoint of spacing s the four (two on a border) centres of spacing s / 2
/// of the squares of side s around it.
///
/// Bounds. vertex_bounds() certifies e(v): nowhere in the diamond of v does the true surface leave
/// the two triangles (over unquantised heights) by more than e(v), vertically. cell_bounds() does
/// the same for the two triangles of a cell of side s, cut by the diagonal that joins its corners of
/// even index sum (indices in units of s). Bounds are pure functions of the address, rounded outward, and
/// nested within a spacing: a centre's are at least those of its midpoints (theirs, of fractals, at
/// least those of the cells around). To the next spacing they are nested too, but for fractals: there
/// a few centres have up to 1.5 times as much as the midpoints whose children they are.
///
/// Everything that Terrane certifies rests on these laws. check_source() in check_source.h tries whether
/// a source keeps them; docs/height_source.md shows how to write one.
class HeightSource {
public:
    virtual ~HeightSource() = default;

    /// The integers that name this source's samples.
    const Lattice& lattice() const { return lattice_; }

    /// Whether fractal or surveyed ground lies here; what is outside is drawn, but is no ground.
    const WorldRect& extent() const { return extent_; }

    /// The true surface, world z in metres, at any finite x, y; beyond the extent it goes on
    /// smoothly. At a lattice point it is what sample() gives, to 1e-9 m.
    ///
    /// Fails:   NaN where the source cannot be read
    /// Threads: callable from several threads at once, as everything here
    virtual double height(double x, double y) const = 0;

    /// Fills the heights of a grid of lattice points.
    ///
    /// @param heights_out [grid.size()] world z, metres; a chunk with one beyond kMostHeight, or
    ///     beyond kMostQuanta quanta, is not made
    ///
    /// Fails: io where the source cannot be read
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

    /// Both of these in one go, which may cost less. Default: one after the other.
    ///
    /// @param vertex_bounds_out  as vertex_bounds() takes it
    /// @param cell_bounds_out    as cell_bounds() takes it
    virtual Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                     std::span<float> cell_bounds_out) const;

    /// What the cells of a grid are, as bits of CellFlag. Default: all of them ground.
    ///
    /// @param flags_out [(columns - 1) * (rows - 1)]
    virtual Result<void> cell_flags(const SampleGrid& grid,
                                    std::span<std::uint8_t> flags_out) const;

    /// Heights of the true surface over a closed rectangle: contains every one, metres. Asked for in
    /// every frame: answered from memory, without waiting for storage.
    virtual HeightInterval interval(const WorldRect& rect) const = 0;

    /// No two points of the surface at most `distance` apart in the plane differ more in height.
    /// Not decreasing in distance. Metres.
    virtual double rise_bound(double distance) const = 0;

    /// A chunk that the source holds ready made, as a baked store does: what make_chunk() gives then, in
    /// place of asking for its parts. Default: null, it holds none.
    ///
    /// @param key  names a chunk of the source's world
    /// @param stop a long answer may be given up with `cancelled` where this is requested
    ///
    /// Fails: io; bad_data where what it holds is damaged
    virtual Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                              const std::stop_token& stop) const;

protected:
    HeightSource(const Lattice& lattice, const WorldRect& extent)
        : lattice_(lattice), extent_(extent) {}

private:
    Lattice lattice_;
    WorldRect extent_;
};

}  // namespace terrane
