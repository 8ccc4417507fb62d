// SPDX-License-Identifier: MIT
#include "broadphase/fat_boxes.h"

#include <algorithm>
#include <limits>

namespace terrane::internal {
namespace {

// Skin on each side, as a share of the box's longest side. Larger ones last longer but have more pairs: measured, an
// eighth to a half cost the same for spheres that move by 1/60 of their diameter.
constexpr double kSkin = 0.125;
// Bodies that get new boxes alone: each is compared with all others, which costs a few percent of a new list.
constexpr std::size_t kMostMoved = 8;
// A list that lasted for fewer updates than this cost more than it saved.
constexpr int kLeastAge = 3;
// Updates without skins after such a list; twice as many after the next one, up to the limit.
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
        // Nothing is known of how they move; skins from the next update on.
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

// Collects the bodies that have left their enlarged boxes, at most one more than get new boxes alone.
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
