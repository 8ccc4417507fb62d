// SPDX-License-Identifier: MIT
#pragma once

#include "base/boxes.h"

#include <terrane/collision/broadphase.h>

#include <algorithm>
#include <span>
#include <vector>

namespace terrane::internal {

/// Largest coordinate of a box, metres: squares of differences are finite.
inline constexpr double kLargestCoordinate = 1e150;

/// Whether a box is not empty: see Broadphase::update().
inline bool is_box(const Aabb& box) {
    int is = 1;
    for (int i = 0; i < 3; ++i) {
        is &= static_cast<int>(box.low[i] >= -kLargestCoordinate) &
              static_cast<int>(box.low[i] <= box.high[i]) &
              static_cast<int>(box.high[i] <= kLargestCoordinate);
    }
    return is != 0;
}

/// Collects pairs in any order and sorts them.
class PairList {
public:
    void clear() { found_.clear(); }
    void add(std::uint32_t i, std::uint32_t j) {
        found_.push_back(i < j ? BodyPair{i, j} : BodyPair{j, i});
    }
    /// Collects from the sorted pairs on, less those for which is_old(pair).
    template <class IsOld>
    void restart_without(IsOld&& is_old) {
        found_.clear();
        for (const BodyPair& pair : sorted_) {
            if (!is_old(pair)) found_.push_back(pair);
        }
    }
    /// Cost: O(bodies + pairs log(pairs of a body))
    void sort(std::size_t body_count);
    std::span<const BodyPair> sorted() const { return sorted_; }

private:
    std::vector<BodyPair> found_;
    std::vector<BodyPair> sorted_;
    std::vector<std::uint32_t> first_;  ///< of each body's pairs
};

}  // namespace terrane::internal
