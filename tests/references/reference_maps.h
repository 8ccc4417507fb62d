// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <span>
#include <vector>

namespace terrane::test {

/// A rectangle of heights, metres; row 0 south, column 0 west.
struct HeightTable {
    int columns = 0, rows = 0;
    double spacing = 1.0;             ///< between neighbours, metres
    std::vector<float> heights = {};  ///< [rows * columns]

    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
               static_cast<std::size_t>(x);
    }
    float at(int x, int y) const { return heights[index(x, y)]; }
};

/// The map of published contact figures, 1025 samples a side at 1 m: ten octaves of value
/// noise, the first of amplitude 30 m and wavelength 256 m; mean slope 0.375, steepest 1.59. Another
/// `spacing`, metres, samples the same hills more or less finely.
HeightTable make_contact_table(int side, double spacing);

/// The bilinear surface of a table, repeated beyond its edge. World (0, 0) is the south-western sample; one root square
/// where the longer side of the table is 128 * 2^n + 1 samples, up to four along it otherwise.
///
/// It is ground for contact: every bound, interval and rise is the range of all heights.
class TableHeights final : public HeightSource {
public:
    explicit TableHeights(HeightTable table);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

private:
    HeightTable table_;
    HeightInterval range_;
};

}  // namespace terrane::test
