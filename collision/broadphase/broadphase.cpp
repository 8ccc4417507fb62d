// SPDX-License-Identifier: MIT
#include "broadphase/pair_list.h"
#include "broadphase/row_grid.h"
#include "broadphase/sweep_and_prune.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace terrane::internal {

/// Boxes enlarged by a skin and kept while the bodies stay inside, so that the overlapping pairs of enlarged boxes
/// include all overlapping pairs of boxes.
///
/// Sources:    L. Verlet. Computer "experiments" on classical fluids I. 1967 (lists of neighbours with a skin).
/// Deviations: the skin is relative to the size of each body, so that sizes may differ by any factor. If only a few
///             bodies leave their boxes, only these get new boxes. If bodies leave too soon, boxes are not enlarged for
///             some updates.
class FatBoxes {
public:
    /// What the last update() did.
    enum class Change {
        none,    ///< every body is still inside its enlarged box
        few,     ///< the bodies in moved() got new enlarged boxes
        all,     ///< every enlarged box is new
        without  ///< there are no enlarged boxes
    };

    /// Cost: O(bodies)
    Change update(std::span<const Aabb> boxes);

    /// Enlarged boxes; empty if the body's box is empty. Invalid after Change::without.
    std::span<const Aabb> boxes() const { return fat_; }
    /// Bodies with new enlarged boxes, ascending. Valid after Change::few.
    std::span<const std::uint32_t> moved() const { return moved_; }
    /// Bodies read or written by the last update().
    std::uint64_t operations() const { return operations_; }

private:
    void find_moved(std::span<const Aabb> boxes);
    void enlarge(const Aabb& box, Aabb& fat_out) const;

    std::vector<Aabb> fat_;
    std::vector<std::uint32_t> moved_;
    std::size_t count_ = 0;  ///< of the last update
    bool is_kept_ = false;   ///< whether there are enlarged boxes
    int age_ = 0;            ///< updates since all enlarged boxes were new
    int wait_ = 0;           ///< updates until skins are tried again
    int next_wait_ = 0;
    std::uint64_t operations_ = 0;
};

/// Caches the candidate pairs of a method while the bodies stay inside enlarged boxes. Meanwhile only the boxes of
/// these pairs are compared, and no sorting is needed.
///
/// @tparam Method has update(), visit_pairs(), candidate_count() and update_operations(), as SweepAndPrune
template <class Method>
class KeptPairs {
public:
    explicit KeptPairs(double margin) : margin_(margin), method_(margin) {}

    /// @param boxes [bodies] read by this call, and by find() if no enlarged boxes are kept
    void update(std::span<const Aabb> boxes) {
        count_ = boxes.size();
        const FatBoxes::Change change = fat_.update(boxes);
        update_operations_ = fat_.operations();
        is_kept_ = change != FatBoxes::Change::without;
        if (change == FatBoxes::Change::none) return;
        // If find() was not called after an earlier update, one search covers all changes.
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

    /// The pairs (i, j) for which is_pair(i, j) is true, ascending. is_pair must be false if the boxes do not overlap.
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

    // Replaces the pairs of the bodies that have new enlarged boxes.
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
    std::vector<std::uint32_t> moved_;    ///< bodies whose pairs are outdated
    std::vector<std::uint8_t> is_moved_;  ///< [bodies] used only while pairs are replaced
    bool is_kept_ = false;                ///< whether there are enlarged boxes
    bool is_stale_ = false;               ///< whether `candidates_` are outdated
    std::uint64_t candidate_count_ = 0;
    std::uint64_t update_operations_ = 0;
};

void PairList::sort(std::size_t body_count) {
    first_.assign(body_count + 1, 0);
    for (const BodyPair& pair : found_) ++first_[pair.a + 1];
    for (std::size_t i = 1; i <= body_count; ++i) first_[i] += first_[i - 1];
    sorted_.resize(found_.size());
    for (const BodyPair& pair : found_) sorted_[first_[pair.a]++] = pair;
    // At this point first_[i] is the end of the pairs of body i.
    std::size_t begin = 0;
    while (begin < sorted_.size()) {
        const std::size_t end = first_[sorted_[begin].a];
        std::sort(sorted_.begin() + static_cast<std::ptrdiff_t>(begin),
                  sorted_.begin() + static_cast<std::ptrdiff_t>(end),
                  [](const BodyPair& x, const BodyPair& y) { return x.b < y.b; });
        begin = end;
    }
}

namespace {

// Skin on each side, as a fraction of the box's longest side. Larger skins last longer but give more pairs. As measured
// with spheres that move by 1/60 of their diameter in an update, fractions of 1/8 to 1/2 cost the same.
constexpr double kSkin = 0.125;
// Largest number of bodies that get new boxes individually. Each is compared with all others, which costs a few percent
// of a new list of pairs.
constexpr std::size_t kMostMoved = 8;
// A list of pairs that lasts for fewer updates than this costs more than it saves.
constexpr int kLeastAge = 3;
// Updates without skins after such a short-lived list; doubled after each further one, up to kMostWait.
constexpr int kFirstWait = 2;
constexpr int kMostWait = 64;

bool contains(const Aabb& fat, const Aabb& box) {
    int is = 1;
    for (int i = 0; i < 3; ++i) {
        is &= static_cast<int>(fat.low[i] <= box.low[i]) &
              static_cast<int>(box.low[i] <= box.high[i]) &
              static_cast<int>(box.high[i] <= fat.high[i]);
    }
    return is != 0;
}

bool is_empty(const Aabb& fat) { return !(fat.low[0] <= fat.high[0]); }

}  // namespace

FatBoxes::Change FatBoxes::update(std::span<const Aabb> boxes) {
    operations_ = 0;
    moved_.clear();
    if (boxes.size() != count_) {
        // The motion of the bodies is not known yet, so boxes get skins only from the next update on.
        count_ = boxes.size();
        is_kept_ = false;
        wait_ = 1;
        next_wait_ = kFirstWait;
    }
    if (is_kept_) {
        find_moved(boxes);
        ++age_;
        if (moved_.empty()) return Change::none;
        if (moved_.size() <= kMostMoved) {
            for (const std::uint32_t i : moved_) enlarge(boxes[i], fat_[i]);
            return Change::few;
        }
        is_kept_ = false;
        if (age_ >= kLeastAge) {
            next_wait_ = kFirstWait;
        } else {
            wait_ = next_wait_;
            next_wait_ = std::min(2 * next_wait_, kMostWait);
        }
    }
    if (wait_ > 0) {
        --wait_;
        return Change::without;
    }
    fat_.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) enlarge(boxes[i], fat_[i]);
    operations_ += count_;
    is_kept_ = true;
    age_ = 0;
    return Change::all;
}

// Collects the bodies that have left their enlarged boxes, at most kMostMoved + 1.
void FatBoxes::find_moved(std::span<const Aabb> boxes) {
    for (std::size_t i = 0; i < count_; ++i) {
        if (contains(fat_[i], boxes[i])) continue;
        if (is_empty(fat_[i]) && !is_box(boxes[i])) continue;
        moved_.push_back(static_cast<std::uint32_t>(i));
        if (moved_.size() > kMostMoved) break;
    }
    operations_ += count_;
}

void FatBoxes::enlarge(const Aabb& box, Aabb& fat_out) const {
    if (!is_box(box)) {
        fat_out = empty_box();
        return;
    }
    const double skin = kSkin * (box.high - box.low).maxCoeff();
    for (int i = 0; i < 3; ++i) {
        fat_out.low[i] = std::max(box.low[i] - skin, -kLargestCoordinate);
        fat_out.high[i] = std::min(box.high[i] + skin, kLargestCoordinate);
    }
}

}  // namespace terrane::internal

namespace terrane {
namespace {

using namespace internal;

// A Broadphase that takes its candidates from a method.
template <class Method>
class Boxes final : public Broadphase {
public:
    explicit Boxes(double margin) : margin_(margin), kept_(margin) {}

    void update(std::span<const Aabb> bounds) override {
        bounds_ = bounds;
        kept_.update(bounds);
    }
    std::span<const BodyPair> find_pairs() override {
        return kept_.find([this](std::uint32_t i, std::uint32_t j) {
            return overlap(bounds_[i], bounds_[j], margin_);
        });
    }
    std::uint64_t candidate_count() const override { return kept_.candidate_count(); }
    std::uint64_t update_operations() const override { return kept_.update_operations(); }

private:
    double margin_;
    std::span<const Aabb> bounds_;
    KeptPairs<Method> kept_;
};

}  // namespace

std::unique_ptr<Broadphase> make_broadphase(BroadphaseKind kind, double margin) {
    TERRANE_ASSERT(margin >= 0.0 && std::isfinite(margin), "margin must be finite and >= 0");
    if (kind == BroadphaseKind::grid) return std::make_unique<Boxes<RowGrid>>(margin);
    return std::make_unique<Boxes<SweepAndPrune>>(margin);
}

std::string_view to_string(BroadphaseKind kind) {
    switch (kind) {
        case BroadphaseKind::grid:
            return "grid";
        case BroadphaseKind::two_scene:
            return "two-scene";
        case BroadphaseKind::sap:
            break;
    }
    return "sap";
}

}  // namespace terrane
