// SPDX-License-Identifier: MIT
#include "broadphase/row_grid.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr std::uint32_t kSide = 8;  // rows along a side of a block
constexpr std::uint32_t kBlock = kSide * kSide;
constexpr std::uint32_t kNoBucket = 0xffffffffu;  // for empty boxes
// Share by which cells are larger than the largest box; exceeds the rounding of quotients.
constexpr double kRoundingMargin = 0x1p-18;
// Largest number of cells along an axis, so that cell indices fit 32 bits and quotients are precise to kRoundingMargin.
constexpr double kMostCells = 0x1p28;

void prefetch(const Aabb& box) {
#if defined(__GNUC__)
    __builtin_prefetch(&box.low);
    __builtin_prefetch(&box.high[2]);
#else
    static_cast<void>(box);
#endif
}

}  // namespace

void RowGrid::choose_cell_size(std::span<const Aabb> boxes) {
    double largest = 0.0;
    Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector3d high = -low;
    for (const Aabb& box : boxes) {
        ++update_operations_;
        if (!is_box(box)) continue;
        largest = std::max(largest, (box.high - box.low).maxCoeff());
        low = low.cwiseMin(box.low);
        high = high.cwiseMax(box.low);
    }
    if (!(low[0] <= high[0])) return;
    origin_ = 0.5 * low + 0.5 * high;
    cell_ = std::max((largest + 2.0 * margin_) * (1.0 + kRoundingMargin),
                     (high - low).maxCoeff() / kMostCells);
    per_cell_ = cell_ > 0.0 ? 1.0 / cell_ : 0.0;
}

std::uint32_t RowGrid::bucket_of(std::int32_t y, std::int32_t z) const {
    const auto row = static_cast<std::uint32_t>(y);
    const auto layer = static_cast<std::uint32_t>(z);
    std::uint64_t hash = static_cast<std::uint64_t>(row / kSide) << 32 | layer / kSide;
    hash *= 0x9e3779b97f4a7c15u;
    hash ^= hash >> 29;
    hash *= 0xbf58476d1ce4e5b9u;
    // The upper half of the product maps the hash to the number of blocks; the lower bits permute the rows inside a
    // block.
    const std::uint64_t blocks = (first_of_bucket_.size() - 1) / kBlock;
    const std::uint64_t block = (hash >> 32) * blocks >> 32;
    const std::uint32_t inside = row % kSide + kSide * (layer % kSide);
    return static_cast<std::uint32_t>(block * kBlock + (inside ^ (hash & (kBlock - 1))));
}

// Counts the boxes of each bucket. False if the cell size does not fit any more: it is too small for a box, more than
// twice as large as needed, or gives too many cells.
bool RowGrid::count_rows(std::span<const Aabb> boxes) {
    std::fill(first_of_bucket_.begin(), first_of_bucket_.end(), 0u);
    update_operations_ += first_of_bucket_.size();
    double largest = 0.0;
    double farthest = 0.0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const Aabb& box = boxes[i];
        ++update_operations_;
        if (!is_box(box)) {
            bucket_of_body_[i] = kNoBucket;
            continue;
        }
        const Eigen::Vector3d from = box.low - origin_;
        largest = std::max(largest, (box.high - box.low).maxCoeff());
        farthest = std::max(farthest, from.cwiseAbs().maxCoeff());
        if (farthest > kMostCells * cell_) return false;
        const std::uint32_t bucket = bucket_of(cell_of(box.low[1], 1), cell_of(box.low[2], 2));
        bucket_of_body_[i] = bucket;
        ++first_of_bucket_[bucket];
    }
    const double needed = (largest + 2.0 * margin_) * (1.0 + kRoundingMargin);
    return needed <= cell_ && (cell_ <= 2.0 * needed || 4.0 * farthest > kMostCells * cell_);
}

void RowGrid::update(std::span<const Aabb> boxes) {
    boxes_ = boxes;
    update_operations_ = 0;
    const std::size_t count = boxes.size();
    bucket_of_body_.resize(count);
    first_of_bucket_.resize((count + kBlock - 1) / kBlock * kBlock + 1);
    if (!count_rows(boxes)) {
        choose_cell_size(boxes);
        count_rows(boxes);
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& first : first_of_bucket_) {
        sum += first;
        first = sum;
        ++update_operations_;
    }
    bodies_.resize(sum);
    // Iterates backwards, so that bodies keep their order and each counter ends at the start of its bucket.
    for (std::size_t i = count; i-- > 0;) {
        const std::uint32_t bucket = bucket_of_body_[i];
        if (bucket == kNoBucket) continue;
        bodies_[--first_of_bucket_[bucket]] = static_cast<std::uint32_t>(i);
        ++update_operations_;
    }
}

void RowGrid::sort_rows() {
    // Reads the boxes in one pass with prefetching, because most are far apart in memory.
    constexpr std::size_t kAhead = 24;
    entries_.resize(bodies_.size());
    longest_ = 0.0f;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        if (i + kAhead < bodies_.size()) prefetch(boxes_[bodies_[i + kAhead]]);
        const Aabb& box = boxes_[bodies_[i]];
        entries_[i] = {make_sweep_box(box, 0, margin_, origin_), cell_of(box.low[1], 1),
                       cell_of(box.low[2], 2), bodies_[i]};
        longest_ = std::max(longest_, entries_[i].box.end - entries_[i].box.start);
    }
    longest_ *= 1.0f + 0x1p-20f;
    const auto is_before = [](const Entry& a, const Entry& b) {
        if (a.z != b.z) return a.z < b.z;
        if (a.y != b.y) return a.y < b.y;
        if (a.box.start != b.box.start) return a.box.start < b.box.start;
        return a.body < b.body;
    };
    rows_.clear();
    const std::size_t bucket_count = first_of_bucket_.size() - 1;
    first_row_of_bucket_.resize(bucket_count + 1);
    for (std::size_t bucket = 0; bucket < bucket_count; ++bucket) {
        first_row_of_bucket_[bucket] = static_cast<std::uint32_t>(rows_.size());
        const std::uint32_t first = first_of_bucket_[bucket];
        const std::uint32_t last = first_of_bucket_[bucket + 1];
        if (last - first > 1) {
            std::sort(entries_.begin() + first, entries_.begin() + last, is_before);
        }
        for (std::uint32_t i = first; i < last; ++i) {
            const Entry& entry = entries_[i];
            if (i == first || rows_.back().y != entry.y || rows_.back().z != entry.z) {
                rows_.push_back({entry.y, entry.z, i, i});
            }
            rows_.back().last = i + 1;
        }
    }
    first_row_of_bucket_[bucket_count] = static_cast<std::uint32_t>(rows_.size());
}

const RowGrid::Row* RowGrid::find_row(std::int32_t y, std::int32_t z) const {
    const std::uint32_t bucket = bucket_of(y, z);
    for (std::uint32_t i = first_row_of_bucket_[bucket]; i < first_row_of_bucket_[bucket + 1];
         ++i) {
        if (rows_[i].y == y && rows_[i].z == z) return &rows_[i];
    }
    return nullptr;
}

}  // namespace terrane::internal
