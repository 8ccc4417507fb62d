// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// Whether a box is not empty: see Broadphase::update().
inline bool is_box(const Aabb& box) {
    constexpr double kLargest = 1e150;  // squares of differences are finite
    int is = 1;
    for (int i = 0; i < 3; ++i) {
        is &= static_cast<int>(box.low[i] >= -kLargest) &
              static_cast<int>(box.low[i] <= box.high[i]) &
              static_cast<int>(box.high[i] <= kLargest);
    }
    return is != 0;
}

/// Whether two boxes, each widened by a margin, overlap or touch: the exact test of all methods.
inline bool overlap(const Aabb& a, const Aabb& b, double margin) {
    const double both = 2.0 * margin;
    for (int i = 0; i < 3; ++i) {
        if (a.low[i] - b.high[i] > both || b.low[i] - a.high[i] > both) return false;
    }
    return true;
}

/// Collects pairs in any order and sorts them.
class PairList {
public:
    void clear() { found_.clear(); }
    void add(std::uint32_t i, std::uint32_t j) {
        found_.push_back(i < j ? BodyPair{i, j} : BodyPair{j, i});
    }
    /// Cost: O(bodies + pairs log(pairs of a body))
    std::span<const BodyPair> sort(std::size_t body_count);

private:
    std::vector<BodyPair> found_;
    std::vector<BodyPair> sorted_;
    std::vector<std::uint32_t> first_;  ///< of each body's pairs
};

}  // namespace terrane::internal
