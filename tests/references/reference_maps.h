// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace terrane::test {

/// A rectangle of heights, metres; row 0 south, column 0 west.
struct HeightTable {
    int columns = 0, rows = 0;
    double spacing = 1.0;        ///< between neighbours, metres
    std::vector<float> heights;  ///< [rows * columns]

    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(x);
    }
    float at(int x, int y) const { return heights[index(x, y)]; }
    /// Highest minus lowest sample, metres.
    double range() const;
};

/// The fractal maps of published triangulation figures, 513 to 4097 samples a side: ten
/// octaves of gradient noise, the first of amplitude 100 m and wavelength 512 m, 1 m between
/// samples.
HeightTable make_fbm_table(int side);

/// The map of published contact figures, 1025 samples a side at 1 m: ten octaves of value
/// noise, the first of amplitude 30 m and wavelength 256 m; mean slope 0.375, steepest 1.59. Another
/// `spacing`, metres, samples the same hills more or less finely.
HeightTable make_contact_table(int side, double spacing);

/// A square of a source's lattice points: south-west corner `corner`, a step of the finest spacing.
/// Fails: io if the source does
Result<HeightTable> read_table(const HeightSource& source, const LatticePoint& corner, int side);

/// The bilinear surface of a table, repeated beyond its edge, with exact bounds of all vertices
/// held in memory. World (0, 0) is the south-western sample; one root square where a side of the
/// table is 128 * 2^n + 1 samples, up to four along the longer side otherwise.
///
/// Bounds are exact maxima over diamonds, the bend of the surface within a cell included, saturated
/// from fine to coarse. Diamonds are cut at the world's border; beyond it every bound is the
/// largest.
class TableHeights final : public HeightSource {
public:
    /// Cost: seconds and 500 MB for 4097 samples a side
    explicit TableHeights(HeightTable table);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

    /// The table, made up to whole root squares by repeating its edge.
    const HeightTable& padded() const { return padded_; }
    /// [as padded().heights] nested bound of each vertex, metres; 0 at the root squares' corners.
    std::span<const float> bounds() const { return bounds_; }

private:
    /// Lowest and highest sample of squares of 2^n cells, edges included.
    struct Ranges {
        int columns = 0, rows = 0;
        std::vector<float> low, high;
    };
    void make_ranges();
    void make_steepness();

    HeightTable padded_;
    std::vector<float> bounds_;
    std::vector<float> square_bounds_;  ///< at a centre: of its square's two triangles alone
    float largest_bound_ = 0.0f;
    std::vector<Ranges> ranges_;  ///< by n
    double steepness_ = 0.0;
    std::vector<double> rises_;  ///< by n: over distances up to 2^n cells
};

/// Bounds of TableHeights: the largest deviation of the bilinear surface of a table from the two
/// triangles of each vertex's diamond, alone and with all that lies below the vertex.
struct DiamondBounds {
    std::vector<float> own;     ///< [columns * rows]
    std::vector<float> nested;  ///< [columns * rows]
};

/// Requires columns - 1 and rows - 1 multiples of root_cells, a power of two.
DiamondBounds make_diamond_bounds(const HeightTable& table, int root_cells);

}  // namespace terrane::test
