// SPDX-License-Identifier: MIT
#pragma once

#include "voids/void_map.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Fills nodata, voids and outside, with smooth heights. Memory grows with the rim of the nodata, not with its area.
///
/// Far from data: bilinear between the nodes of a coarse field, one node a block of 8 x 8 samples,
/// the mean of the block where it has data and relaxed towards a harmonic field where it has none.
/// Within two blocks of data: individual samples, relaxed between the data and that field.
/// The same bits for rasters in memory and read by window.
class VoidFill {
public:
    VoidFill(int columns, int rows);

    /// First pass, rows in any order, each once; NaN is nodata.
    void add_row(int row, std::span<const double> samples);
    /// Between the passes: computes the coarse field. Requires at least one sample with data.
    void make_field();
    /// Bytes of the second pass, which grow with the rim of the nodata.
    std::size_t rim_bytes() const { return rim_count_ * sizeof(Block); }
    /// Before the second pass.
    void begin_rim();
    /// Whether the second pass needs this row.
    bool needs_row(int row) const;
    /// Second pass: the needed rows again.
    void add_rim_row(int row, std::span<const double> samples);
    /// After the second pass.
    void relax();

    /// Height of a sample without data, metres.
    float height(int column, int row) const;

private:
    struct Block {
        std::int32_t bx, by;
        std::array<float, kBlockSide * kBlockSide> heights{};
        std::uint64_t missing = 0;  ///< bit of each sample without data
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
    std::vector<float> field_;             ///< [blocks] sum, then mean or relaxed height
    std::vector<std::uint8_t> counts_;     ///< [blocks] samples with data
    std::vector<std::int32_t> rim_index_;  ///< [blocks] into rim_, or -1
    std::size_t rim_count_ = 0;
    std::vector<Block> rim_;
};

}  // namespace terrane::internal
