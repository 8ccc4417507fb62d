// SPDX-License-Identifier: MIT
#pragma once

#include "box_columns.h"

namespace terrane::internal {

/// A sparse grid of cells as large as the largest box: boxes that overlap start in the same cell or in two of
/// the 27 around it.
///
/// Sources:    M. Teschner et al. Optimized spatial hashing for collision detection of deformable objects. 2003
///             (cells by a hash). NVIDIA. GPU Gems 3. 2007, chapter 32 (half of the neighbours).
/// Deviations: not cells but rows of cells along x are hashed, into as many buckets as there are boxes, by
///             counting: an update is linear in the boxes, whatever the volume. A row is swept along x, with
///             itself and four of the eight rows around it.
class RowGrid {
public:
    explicit RowGrid(double margin) : margin_(margin) {}

    void update(std::span<const Bounds> boxes);
    template <class Take>
    void visit_pairs(Take&& take) {
        sort_rows();
        candidate_count_ = 0;
        for (const Row& row : rows_) {
            sweep_itself(row, take);
            for (const auto& [y, z] : {Step{1, 0}, Step{-1, 1}, Step{0, 1}, Step{1, 1}}) {
                const Row* const other = find_row(row.y + y, row.z + z);
                if (other == nullptr) continue;
                sweep(row, *other, take);
                sweep(*other, row, take);
            }
        }
    }

    std::uint64_t candidate_count() const { return candidate_count_; }
    std::uint64_t update_operations() const { return update_operations_; }

private:
    struct Step {
        int y, z;
    };
    struct Row {
        std::int32_t y, z;
        std::uint32_t first, last;  ///< places of its boxes
    };
    struct Entry {
        double low;  ///< along x
        std::int32_t y, z;
        std::uint32_t body;
    };

    void measure(std::span<const Bounds> boxes);
    void sort_rows();
    std::int32_t cell_of(double p, int axis) const;
    std::uint32_t bucket_of(std::int32_t y, std::int32_t z) const;
    const Row* find_row(std::int32_t y, std::int32_t z) const;

    // Boxes of one row that start behind a box of another and not behind its end, or of the same row.
    template <class Take>
    void sweep_itself(const Row& row, Take&& take) {
        for (std::uint32_t place = row.first; place < row.last; ++place) {
            visit(place, place + 1, row.last, take);
        }
    }
    template <class Take>
    void sweep(const Row& from, const Row& to, Take&& take) {
        std::uint32_t first = to.first;
        for (std::uint32_t place = from.first; place < from.last; ++place) {
            const float start = columns_.start(place);
            // Of two that start together only one sees the other.
            const bool is_later = &from > &to;
            while (first < to.last && (columns_.start(first) < start ||
                                       (is_later && columns_.start(first) == start))) {
                ++first;
            }
            visit(place, first, to.last, take);
        }
    }
    template <class Take>
    void visit(std::uint32_t place, std::uint32_t first, std::uint32_t end_of_row, Take&& take) {
        const float end = columns_.end(place);
        std::uint32_t last = first;
        while (last < end_of_row && columns_.start(last) <= end) ++last;
        candidate_count_ += last - first;
        columns_.visit_across(place, first, last, [&](std::size_t other) {
            take(columns_.body(place), columns_.body(other));
        });
    }

    double margin_;
    double per_cell_ = 1.0;  ///< of a metre
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    std::span<const Bounds> boxes_;
    std::vector<std::uint32_t> bucket_of_body_;
    std::vector<std::uint32_t> first_of_bucket_;
    std::vector<std::uint32_t> bodies_;  ///< bucket by bucket
    std::vector<Entry> entries_;
    std::vector<Row> rows_;
    std::vector<std::uint32_t> first_row_of_bucket_;
    BoxColumns columns_;
    std::uint64_t candidate_count_ = 0;
    std::uint64_t update_operations_ = 0;
};

}  // namespace terrane::internal
