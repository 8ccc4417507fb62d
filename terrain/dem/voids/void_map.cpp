// SPDX-License-Identifier: MIT
//
// Sources: L. He, Y. Chao, K. Suzuki, A Run-Based Two-Scan Labeling Algorithm, IEEE Transactions on
//          Image Processing 17(5), 2008.
// Deviations: a plain union-find whose roots are the smallest labels; the second scan is over runs.
#include "voids/void_map.h"

#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::internal {

VoidMap::VoidMap(int columns, int rows, bool from_north)
    : columns_(columns),
      rows_(rows),
      from_north_(from_north),
      blocks_x_((columns + kBlockSide - 1) / kBlockSide) {
    row_begin_.push_back(0);
}

std::size_t VoidMap::run_bytes() const {
    return runs_.capacity() * sizeof(Run) + parent_.capacity() * sizeof(std::int32_t);
}

std::int32_t VoidMap::find(std::int32_t label) {
    while (parent_[static_cast<std::size_t>(label)] != label) {
        std::int32_t& up = parent_[static_cast<std::size_t>(label)];
        up = parent_[static_cast<std::size_t>(up)];
        label = up;
    }
    return label;
}

void VoidMap::unite(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    if (a != b) parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
}

void VoidMap::add_row(std::span<const double> samples) {
    const std::size_t row_start = runs_.size();
    std::size_t below = row_begin_.size() >= 2 ? row_begin_[row_begin_.size() - 2] : row_start;
    for (int column = 0; column < columns_;) {
        if (!std::isnan(samples[static_cast<std::size_t>(column)])) {
            ++column;
            continue;
        }
        Run run{column, column, static_cast<std::int32_t>(parent_.size())};
        while (column < columns_ && std::isnan(samples[static_cast<std::size_t>(column)])) ++column;
        run.end = column;
        nodata_count_ += run.end - run.begin;

        // Runs of the row before that touch this one, corners included.
        bool labelled = false;
        while (below < row_start && runs_[below].end < run.begin) ++below;
        for (std::size_t i = below; i < row_start && runs_[i].begin <= run.end; ++i) {
            if (labelled) {
                unite(run.label, runs_[i].label);
            } else {
                run.label = runs_[i].label;
                labelled = true;
            }
        }
        if (!labelled) parent_.push_back(run.label);
        runs_.push_back(run);
    }
    row_begin_.push_back(runs_.size());
}

void VoidMap::finish() {
    std::vector<std::uint8_t> touches_border(parent_.size(), 0);
    const auto for_each_run = [this](auto&& visit) {
        for (int row = 0; row < rows_; ++row) {
            const std::size_t end = row_begin_[order_of(row) + 1];
            for (std::size_t i = row_begin_[order_of(row)]; i < end; ++i) {
                visit(row, runs_[i]);
            }
        }
    };
    for_each_run([&](int row, Run& run) {
        run.label = find(run.label);
        if (row == 0 || row == rows_ - 1 || run.begin == 0 || run.end == columns_) {
            touches_border[static_cast<std::size_t>(run.label)] = 1;
        }
    });
    const std::size_t blocks_y = static_cast<std::size_t>((rows_ + kBlockSide - 1) / kBlockSide);
    if (!runs_.empty()) block_flags_.assign(static_cast<std::size_t>(blocks_x_) * blocks_y, 0);
    for_each_run([&](int row, Run& run) {
        const bool outside = touches_border[static_cast<std::size_t>(run.label)] != 0;
        run.label = outside ? cell_outside : cell_filled;
        if (!outside) void_count_ += run.end - run.begin;
        for (int block = run.begin / kBlockSide; block <= (run.end - 1) / kBlockSide; ++block) {
            std::uint8_t& flags = block_flags_[static_cast<std::size_t>(row / kBlockSide) *
                                                   static_cast<std::size_t>(blocks_x_) +
                                               static_cast<std::size_t>(block)];
            flags = static_cast<std::uint8_t>(flags | run.label);
        }
    });
    parent_ = {};
}

std::uint8_t VoidMap::row_flags(int row, int west, int east) const {
    const auto begin = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[order_of(row)]);
    const auto end = runs_.begin() + static_cast<std::ptrdiff_t>(row_begin_[order_of(row) + 1]);
    std::uint8_t flags = 0;
    for (auto run = std::upper_bound(begin, end, west,
                                     [](int column, const Run&r) { return column < r.end; });
         run != end && run->begin <= east; ++run) {
        flags = static_cast<std::uint8_t>(flags | run->label);
    }
    return flags;
}

std::uint8_t VoidMap::flags(int west, int south, int east, int north) const {
    if (runs_.empty()) return 0;
    std::uint8_t flags = 0;
    for (int by = south / kBlockSide; by <= north / kBlockSide; ++by) {
        for (int bx = west / kBlockSide; bx <= east / kBlockSide; ++bx) {
            const std::uint8_t block =
                block_flags_[static_cast<std::size_t>(by) * static_cast<std::size_t>(blocks_x_) +
                             static_cast<std::size_t>(bx)];
            if ((block | flags) == flags) continue;
            const int row_end = std::min(north, by * kBlockSide + kBlockSide - 1);
            const int begin = std::max(west, bx * kBlockSide);
            const int end = std::min(east, bx * kBlockSide + kBlockSide - 1);
            for (int row = std::max(south, by * kBlockSide); row <= row_end; ++row) {
                flags = static_cast<std::uint8_t>(flags | row_flags(row, begin, end));
            }
        }
    }
    return flags;
}

}  // namespace terrane::internal
