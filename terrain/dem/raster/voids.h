// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace terrane::internal {

/// Side, in samples, of the blocks with aggregated flags and heights.
inline constexpr int kBlockSide = 8;

/// The nodata of a raster, as runs along its rows, with a flag for enclosed voids.
///
/// Nodata samples are 8-connected, so a void is enclosed by a 4-connected ring of valid samples. A component connected
/// to the raster's border is outside, any other is a void. Memory: 12 bytes a run.
class VoidMap {
public:
    /// @param from_north whether add_row() gets the rows from north to south
    /// @param memory     of the blocks' flags
    VoidMap(int columns, int rows, bool from_north, std::pmr::memory_resource* memory);

    /// Adds the next row; NaN is nodata.
    void add_row(std::span<const double> samples);
    /// Classifies components as void or outside. Call after the last row.
    void finish();

    bool empty() const { return runs_.empty(); }
    /// Bytes of the runs.
    std::size_t run_bytes() const;
    std::int64_t nodata_count() const { return nodata_count_; }
    std::int64_t void_count() const { return void_count_; }

    /// Bits of CellFlag over the samples of a closed rectangle inside the raster.
    std::uint8_t flags(int west, int south, int east, int north) const;
    /// Bits of CellFlag of one sample.
    std::uint8_t flags(int column, int row) const { return row_flags(row, column, column); }

private:
    struct Run {
        std::int32_t begin, end;  ///< columns, end excluded
        std::int32_t label;       ///< of its component; after finish(), bits of CellFlag
    };

    std::uint8_t row_flags(int row, int west, int east) const;
    /// Index of a row in the order of add_row().
    std::size_t order_of(int row) const {
        return static_cast<std::size_t>(from_north_ ? rows_ - 1 - row : row);
    }
    std::int32_t find(std::int32_t label);
    void unite(std::int32_t a, std::int32_t b);

    int columns_, rows_;
    bool from_north_;
    int blocks_x_ = 0;
    std::vector<Run> runs_;
    std::vector<std::size_t> row_begin_;  ///< [rows + 1] each row's first run; rows as in add_row()
    std::vector<std::int32_t> parent_;    ///< union-find: the smallest label is the root
    std::pmr::vector<std::uint8_t> block_flags_;  ///< [blocks] bits of the samples of each block
    std::int64_t nodata_count_ = 0, void_count_ = 0;
};

/// Computes smooth heights for all nodata. Memory grows with the rim of the nodata, not with its area.
///
/// Far from data, heights are interpolated bilinearly between the nodes of a coarse field, one per block of 8 x 8
/// samples. A node is the mean of its block if the block has data, else it is relaxed towards a harmonic field.
/// Within two blocks of data (the *rim*), individual samples are relaxed between the data and the coarse field.
/// Rasters in memory and rasters read by window give the same bits.
class VoidFill {
public:
    /// @param memory of the arrays with an entry for each block
    VoidFill(int columns, int rows, std::pmr::memory_resource* memory);

    /// First pass: adds a row, in any order, each once; NaN is nodata.
    void add_row(int row, std::span<const double> samples);
    /// Between the passes: computes the coarse field. Requires at least one sample with data.
    void make_field();
    /// Bytes of the second pass, which grow with the rim of the nodata.
    std::size_t rim_bytes() const { return rim_count_ * sizeof(Block); }
    /// Call before the second pass.
    void begin_rim();
    /// Whether the second pass needs this row.
    bool needs_row(int row) const;
    /// Second pass: adds a needed row again.
    void add_rim_row(int row, std::span<const double> samples);
    /// Computes the heights of the rim; call after the second pass.
    void relax();

    /// Height of a sample without data, metres.
    float height(int column, int row) const;

private:
    struct Block {
        std::int32_t bx, by;
        std::array<float, kBlockSide * kBlockSide> heights{};
        std::uint64_t missing = 0;  ///< a bit for each sample without data
    };

    std::size_t node(int bx, int by) const {
        return static_cast<std::size_t>(by) * static_cast<std::size_t>(blocks_x_) +
               static_cast<std::size_t>(bx);
    }
    void choose_rim();
    float field_height(int column, int row) const;
    float rim_or_field(int column, int row) const;
    double relax_block(Block& block, double gain) const;

    int columns_, rows_, blocks_x_, blocks_y_;
    std::pmr::vector<float> field_;  ///< [blocks] mean of the samples; later relaxed heights too
    std::pmr::vector<std::uint8_t> counts_;     ///< [blocks] number of samples with data
    std::pmr::vector<std::int32_t> rim_index_;  ///< [blocks] into rim_, or -1
    std::size_t rim_count_ = 0;
    std::vector<Block> rim_;
};

}  // namespace terrane::internal
