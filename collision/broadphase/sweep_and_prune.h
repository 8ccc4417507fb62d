// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/pair_list.h"

namespace terrane::internal {

/// Finds overlapping boxes by sweep-and-prune along the axis of largest spread.
/// Sources:    D. Baraff. Dynamic simulation of nonpenetrating rigid bodies. 1992, section 5.1 (insertion sort).
///             J. Cohen et al. I-COLLIDE. 1995 (sweep-and-prune of boxes).
/// Deviations: the other two axes are compared for many boxes at a time, without sorted lists or stored overlaps.
class SweepAndPrune {
public:
    explicit SweepAndPrune(double margin) : margin_(margin) {}

    void update(std::span<const Aabb> boxes);
    /// Calls visitor(i, j) once for each pair of boxes that overlap when rounded outwards.
    template <class Visitor>
    void visit_pairs(Visitor&& visitor) {
        candidate_count_ = 0;
        const std::size_t count = order_.size();
        for (std::size_t place = 0; place + 1 < count; ++place) {
            const float end = columns_.end(place);
            std::size_t last = place + 1;
            while (last < count && columns_.start(last) <= end) ++last;
            candidate_count_ += last - place - 1;
            columns_.visit_across(place, place + 1, last, [&](std::size_t other) {
                visitor(columns_.body(place), columns_.body(other));
            });
        }
    }

    std::uint64_t candidate_count() const { return candidate_count_; }
    std::uint64_t update_operations() const { return update_operations_; }

private:
    void choose_axis(std::span<const Aabb> boxes);
    void collect(std::span<const Aabb> boxes);
    bool sort_by_insertion();

    struct Entry {
        double low;
        std::uint32_t body;
    };
    static bool is_before(const Entry& a, const Entry& b) {
        return a.low != b.low ? a.low < b.low : a.body < b.body;
    }

    double margin_;
    int axis_ = -1;
    std::size_t body_count_ = 0;  ///< of the last update
    std::size_t box_count_ = 0;   ///< of these bodies, those with a non-empty box
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    std::vector<Entry> order_;
    BoxColumns columns_;
    std::uint64_t candidate_count_ = 0;
    std::uint64_t update_operations_ = 0;
};

}  // namespace terrane::internal
