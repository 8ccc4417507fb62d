// SPDX-License-Identifier: MIT
#pragma once

#include "broadphase/fat_boxes.h"

#include <algorithm>

namespace terrane::internal {

/// Pairs of a method, kept while the bodies stay inside enlarged boxes: until then only their own boxes are compared,
/// and the order needs no sorting.
///
/// @tparam Method update(boxes), visit_pairs(take), candidate_count() and update_operations() of SweepAndPrune
template <class Method>
class KeptPairs {
public:
    explicit KeptPairs(double margin) : margin_(margin), method_(margin) {}

    /// @param boxes [bodies] read by this call only, and by find() until enlarged boxes are kept
    void update(std::span<const Aabb> boxes) {
        count_ = boxes.size();
        const FatBoxes::Change change = fat_.update(boxes);
        update_operations_ = fat_.operations();
        is_kept_ = change != FatBoxes::Change::without;
        if (change == FatBoxes::Change::none) return;
        // Pairs of an earlier update were not asked for: search once for all of them.
        const bool is_pending = is_stale_ || !moved_.empty();
        if (change == FatBoxes::Change::few && !is_pending) {
            moved_.assign(fat_.moved().begin(), fat_.moved().end());
            return;
        }
        moved_.clear();
        is_stale_ = is_kept_;
        method_.update(is_kept_ ? fat_.boxes() : boxes);
        update_operations_ += method_.update_operations();
    }

    /// The pairs (i, j) for which is_pair(i, j), ascending. It must be false where boxes do not overlap.
    template <class IsPair>
    std::span<const BodyPair> find(IsPair&& is_pair) {
        if (!is_kept_) {
            collect(is_pair);
            candidate_count_ = method_.candidate_count();
            return candidates_.sorted();
        }
        candidate_count_ = 0;
        const auto are_near = [fat = fat_.boxes(), this](std::uint32_t i, std::uint32_t j) {
            return overlap(fat[i], fat[j], margin_);
        };
        if (is_stale_) {
            collect(are_near);
            candidate_count_ = method_.candidate_count();
            is_stale_ = false;
        }
        if (!moved_.empty()) replace_moved(are_near);
        const std::span<const BodyPair> kept = candidates_.sorted();
        candidate_count_ += kept.size();
        found_.resize(kept.size());
        std::size_t count = 0;
        for (const BodyPair& pair : kept) {
            found_[count] = pair;
            count += static_cast<std::size_t>(is_pair(pair.a, pair.b));
        }
        return std::span(found_).first(count);
    }

    std::uint64_t candidate_count() const { return candidate_count_; }
    std::uint64_t update_operations() const { return update_operations_; }

private:
    template <class IsPair>
    void collect(IsPair&& is_pair) {
        candidates_.clear();
        method_.visit_pairs([&](std::uint32_t i, std::uint32_t j) {
            if (is_pair(i, j)) candidates_.add(i, j);
        });
        candidates_.sort(count_);
    }

    // New pairs of the bodies that have new enlarged boxes.
    template <class AreNear>
    void replace_moved(AreNear&& are_near) {
        is_moved_.resize(count_, 0);
        for (const std::uint32_t i : moved_) is_moved_[i] = 1;
        candidates_.restart_without(
            [&](const BodyPair& pair) { return (is_moved_[pair.a] | is_moved_[pair.b]) != 0; });
        for (const std::uint32_t i : moved_) {
            for (std::uint32_t j = 0; j < count_; ++j) {
                if (!are_near(i, j) || i == j || (is_moved_[j] != 0 && j < i)) continue;
                candidates_.add(i, j);
            }
            candidate_count_ += count_;
        }
        candidates_.sort(count_);
        for (const std::uint32_t i : moved_) is_moved_[i] = 0;
        moved_.clear();
    }

    double margin_;
    std::size_t count_ = 0;  ///< bodies
    FatBoxes fat_;
    Method method_;
    PairList candidates_;
    std::vector<BodyPair> found_;
    std::vector<std::uint32_t> moved_;    ///< whose pairs are those of their former boxes
    std::vector<std::uint8_t> is_moved_;  ///< [bodies] while pairs are replaced
    bool is_kept_ = false;                ///< whether there are enlarged boxes
    bool is_stale_ = false;  ///< whether `candidates_` are those of former enlarged boxes
    std::uint64_t candidate_count_ = 0;
    std::uint64_t update_operations_ = 0;
};

}  // namespace terrane::internal
