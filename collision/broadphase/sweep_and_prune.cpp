// SPDX-License-Identifier: MIT
#include "broadphase/sweep_and_prune.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Moves per box after which the insertion sort is abandoned for a full sort.
constexpr std::uint64_t kMaxMovesPerBox = 8;
// The sweep axis changes if the relative spread along another axis is larger by this factor.
constexpr double kAxisSwitchRatio = 1.5;

}  // namespace

void SweepAndPrune::update(std::span<const Aabb> boxes) {
    update_operations_ = boxes.size();
    const int axis = axis_;
    choose_axis(boxes);
    const bool is_known = axis == axis_ && body_count_ == boxes.size();
    body_count_ = boxes.size();
    if (is_known) {
        // Drops boxes that have become empty; the others keep their order.
        std::size_t kept = 0;
        for (const Entry& entry : order_) {
            if (!is_box(boxes[entry.body])) continue;
            order_[kept++] = {boxes[entry.body].low[axis_], entry.body};
        }
        const bool is_all = kept == order_.size();
        order_.resize(kept);
        update_operations_ += boxes.size();
        if (!is_all || box_count_ != kept) collect(boxes);
    } else {
        collect(boxes);
    }
    if (!is_known || !sort_by_insertion()) {
        std::sort(order_.begin(), order_.end(), [this](const Entry& a, const Entry& b) {
            ++update_operations_;
            return is_before(a, b);
        });
    }
    columns_.resize(order_.size());
    for (std::size_t i = 0; i < order_.size(); ++i) {
        const std::uint32_t body = order_[i].body;
        columns_.set(i, body, make_sweep_box(boxes[body], axis_, margin_, origin_));
    }
    update_operations_ += order_.size();
}

// Chooses the axis along which the boxes have the largest variance relative to their mean size.
void SweepAndPrune::choose_axis(std::span<const Aabb> boxes) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    Eigen::Vector3d sizes = Eigen::Vector3d::Zero();
    box_count_ = 0;
    for (const Aabb& box : boxes) {
        if (!is_box(box)) continue;
        if (box_count_ == 0) origin_ = box.low;
        const Eigen::Vector3d from = box.low - origin_;
        sum += from;
        squares += from.cwiseProduct(from);
        sizes += box.high - box.low;
        ++box_count_;
    }
    if (box_count_ == 0) {
        axis_ = std::max(axis_, 0);
        return;
    }
    const auto count = static_cast<double>(box_count_);
    Eigen::Vector3d spread;
    for (int i = 0; i < 3; ++i) {
        const double mean = sum[i] / count;
        const double variance = std::max(0.0, squares[i] / count - mean * mean);
        const double size = sizes[i] / count + 2.0 * margin_;
        spread[i] = size > 0.0 ? variance / (size * size) : variance;
    }
    int best = 0;
    for (int i = 1; i < 3; ++i) {
        if (spread[i] > spread[best]) best = i;
    }
    if (axis_ < 0 || !(spread[best] <= kAxisSwitchRatio * kAxisSwitchRatio * spread[axis_])) {
        axis_ = best;
    }
}

void SweepAndPrune::collect(std::span<const Aabb> boxes) {
    order_.clear();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (is_box(boxes[i])) {
            order_.push_back({boxes[i].low[axis_], static_cast<std::uint32_t>(i)});
        }
    }
    update_operations_ += boxes.size();
}

// Sorts nearly sorted boxes. Gives up after too many moves: returns false and leaves an arbitrary order.
bool SweepAndPrune::sort_by_insertion() {
    const std::uint64_t most = kMaxMovesPerBox * order_.size();
    std::uint64_t moves = 0;
    for (std::size_t i = 1; i < order_.size() && moves <= most; ++i) {
        const Entry entry = order_[i];
        std::size_t place = i;
        while (place > 0 && is_before(entry, order_[place - 1])) {
            order_[place] = order_[place - 1];
            --place;
        }
        order_[place] = entry;
        moves += i - place;
    }
    update_operations_ += moves;
    return moves <= most;
}

}  // namespace terrane::internal
