// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Side of the blocks in which rasters are summed up, samples.
inline constexpr int kBlockSide = 8;

/// Where a raster has no data, as runs along its rows, and which of it is enclosed.
///
/// Nodata samples are connected through edges and corners (8 neighbours): what surveyed ground
/// encloses is enclosed by a closed fence of samples that share edges. Connected to the raster's
/// border: outside; otherwise a void. Memory: 12 bytes a run.
class VoidMap {
public:
    /// @param from_north  order of the rows in add_row()
    VoidMap(int columns, int rows, bool from_north);

    /// Adds the next row; NaN is nodata.
    void add_row(std::span<const double> samples);
    /// Tells voids from the outside; after the last row.
    void finish();

    bool empty() const { return runs_.empty(); }
    /// Bytes of the runs, which depend on where nodata is.
    std::size_t run_bytes() const;
    std::int64_t nodata_count() const { return nodata_count_; }
    std::int64_t void_count() const { return void_count_; }

    /// Bits of CellFlag of the samples of a closed rectangle inside the raster.
    std::uint8_t flags(int west, int south, int east, int north) const;
    /// Bits of CellFlag of one sample.
    std::uint8_t flags(int column, int row) const { return row_flags(row, column, column); }

private:
    struct Run {
        std::int32_t begin, end;  ///< columns, end excluded
        std::int32_t label;       ///< of its connected part; bits of CellFlag when finished
    };

    std::uint8_t row_flags(int row, int west, int east) const;
    /// Place in the order of add_row().
    std::size_t order_of(int row) const {
        return static_cast<std::size_t>(from_north_ ? rows_ - 1 - row : row);
    }
    std::int32_t find(std::int32_t label);
    void unite(std::int32_t a, std::int32_t b);

    int columns_, rows_;
    bool from_north_;
    int blocks_x_ = 0;
    std::vector<Run> runs_;
    std::vector<std::size_t> row_begin_;     ///< [rows + 1] into runs_, in the order of add_row()
    std::vector<std::int32_t> parent_;       ///< union-find; the smaller label is the root
    std::vector<std::uint8_t> block_flags_;  ///< [blocks] bits of the samples of each block
    std::int64_t nodata_count_ = 0, void_count_ = 0;
};

}  // namespace terrane::internal
