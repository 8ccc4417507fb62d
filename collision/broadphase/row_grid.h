// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/pair_list.h"

namespace terrane::internal {

/// Sparse grid with cells as large as the largest box, so that the low corners of overlapping boxes are in the same
/// cell or in neighbouring ones.
///
/// Sources:    M. Teschner et al. Optimized spatial hashing for collision detection of deformable objects. 2003 (hash).
///             NVIDIA. GPU Gems 3. 2007, chapter 32 (a cell is compared with half of its neighbours).
/// Deviations: rows of cells along x are hashed, instead of single cells. A counting sort fills as many buckets as
///             there are boxes, so an update is linear in the number of boxes, whatever volume they occupy. The rows
///             of an 8 x 8 block are adjacent in memory. Each row is swept along x against itself and four of its
///             eight neighbours.
class RowGrid {
public:
    explicit RowGrid(double margin) : margin_(margin) {}

    void update(std::span<const Aabb> boxes);
    template <class Visitor>
    void visit_pairs(Visitor&& visitor) {
        sort_rows();
        candidate_count_ = 0;
        for (const Row& row : rows_) {
            for (std::uint32_t i = row.first; i < row.last; ++i) {
                visit(entries_[i], i + 1, row.last, visitor);
            }
            for (const auto& [y, z] : {Step{1, 0}, Step{-1, 1}, Step{0, 1}, Step{1, 1}}) {
                if (const Row* const other = find_row(row.y + y, row.z + z)) {
                    sweep(row, *other, visitor);
                }
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
        std::uint32_t first, last;  ///< range of entries
    };
    struct Entry {
        SweepBox box;
        std::int32_t y, z;
        std::uint32_t body;
    };

    void choose_cell_size(std::span<const Aabb> boxes);
    bool count_rows(std::span<const Aabb> boxes);
    void sort_rows();
    std::int32_t cell_of(double p, int axis) const {
        const double cells = (p - origin_[axis]) * per_cell_;
        const auto whole = static_cast<std::int32_t>(cells);
        return whole - static_cast<std::int32_t>(cells < static_cast<double>(whole));
    }
    std::uint32_t bucket_of(std::int32_t y, std::int32_t z) const;
    const Row* find_row(std::int32_t y, std::int32_t z) const;

    // Visits the pairs of boxes of two rows that overlap along x.
    template <class Visitor>
    void sweep(const Row& from, const Row& to, Visitor&& visitor) {
        std::uint32_t first = to.first;
        for (std::uint32_t i = from.first; i < from.last; ++i) {
            const Entry& entry = entries_[i];
            // No box is longer than a cell.
            const float earliest = entry.box.start - longest_;
            while (first < to.last && entries_[first].box.start < earliest) ++first;
            if (first == to.last) return;
            visit(entry, first, to.last, visitor);
        }
    }
    template <class Visitor>
    void visit(const Entry& entry, std::uint32_t first, std::uint32_t last, Visitor&& visitor) {
        for (; first < last && entries_[first].box.start <= entry.box.end; ++first) {
            const Entry& other = entries_[first];
            if (other.box.end < entry.box.start) continue;
            ++candidate_count_;
            if (entry.box.overlaps_across(other.box)) visitor(entry.body, other.body);
        }
    }

    double margin_;
    double cell_ = 0.0;  ///< metres; 0: not chosen yet
    double per_cell_ = 0.0;
    float longest_ = 0.0f;  ///< upper bound of the widened boxes' lengths along x
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    std::span<const Aabb> boxes_;
    std::vector<std::uint32_t> bucket_of_body_;
    std::vector<std::uint32_t> first_of_bucket_;
    std::vector<std::uint32_t> bodies_;  ///< bucket by bucket
    std::vector<Entry> entries_;         ///< row by row
    std::vector<Row> rows_;
    std::vector<std::uint32_t> first_row_of_bucket_;
    std::uint64_t candidate_count_ = 0;
    std::uint64_t update_operations_ = 0;
};

}  // namespace terrane::internal
