// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"

#include <terrane/collision/broadphase.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Largest coordinate of a box, metres, so that squares of differences are finite.
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
    /// Begins a new collection with the sorted pairs for which is_old(pair) is false.
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
    std::vector<std::uint32_t> first_;  ///< index of each body's first pair
};

/// A widened box for a sweep along one axis, in floats rounded outwards. If two SweepBoxes do not overlap, neither do
/// the boxes.
struct SweepBox {
    float start, end;  ///< along the axis
    float low_u, high_u, low_v, high_v;

    bool overlaps_across(const SweepBox& other) const {
        return low_u <= other.high_u && other.low_u <= high_u && low_v <= other.high_v &&
               other.low_v <= high_v;
    }
};

/// @param margin added to each side, metres
/// @param origin of the float coordinates, near the boxes
inline SweepBox make_sweep_box(const Aabb& box, int axis, double margin,
                               const Eigen::Vector3d& origin) {
    // Relative margin: exceeds the rounding of the differences and of the conversion to float.
    constexpr double kOut = 0x1p-23;
    constexpr double kLeast = 0x1p-126;
    constexpr double kFarthest = 0x1p126;
    const auto low = [&](int i) {
        const double d = box.low[i] - origin[i];
        const double out = kOut * (std::abs(d) + margin) + kLeast;
        return static_cast<float>(std::clamp(d - margin - out, -kFarthest, kFarthest));
    };
    const auto high = [&](int i) {
        const double d = box.high[i] - origin[i];
        const double out = kOut * (std::abs(d) + margin) + kLeast;
        return static_cast<float>(std::clamp(d + margin + out, -kFarthest, kFarthest));
    };
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    return {low(axis), high(axis), low(u), high(u), low(v), high(v)};
}

/// Boxes in sweep order, as a structure of arrays.
class BoxColumns {
public:
    void resize(std::size_t count) {
        bodies_.resize(count);
        for (std::vector<float>* column : {&start_, &end_, &low_u_, &high_u_, &low_v_, &high_v_}) {
            column->resize(count);
        }
    }
    void set(std::size_t place, std::uint32_t body, const SweepBox& box) {
        bodies_[place] = body;
        start_[place] = box.start;
        end_[place] = box.end;
        low_u_[place] = box.low_u;
        high_u_[place] = box.high_u;
        low_v_[place] = box.low_v;
        high_v_[place] = box.high_v;
    }

    std::uint32_t body(std::size_t place) const { return bodies_[place]; }
    float start(std::size_t place) const { return start_[place]; }
    float end(std::size_t place) const { return end_[place]; }

    /// Calls visitor(i) for the boxes i in [first, last) that overlap box `place` along the other two axes.
    template <class Visitor>
    void visit_across(std::size_t place, std::size_t first, std::size_t last,
                      Visitor&& visitor) const {
        const float low_u = low_u_[place], high_u = high_u_[place];
        const float low_v = low_v_[place], high_v = high_v_[place];
        const auto meets = [&](std::size_t i) {
            // Branch-free, so that compilers vectorize it.
            return static_cast<unsigned>(low_u_[i] <= high_u) &
                   static_cast<unsigned>(low_u <= high_u_[i]) &
                   static_cast<unsigned>(low_v_[i] <= high_v) &
                   static_cast<unsigned>(low_v <= high_v_[i]);
        };
        constexpr std::size_t kBlock = 16;
        std::array<unsigned, kBlock> are_met;
        for (; first + kBlock <= last; first += kBlock) {
            unsigned any = 0;
            for (std::size_t k = 0; k < kBlock; ++k) {
                are_met[k] = meets(first + k);
                any |= are_met[k];
            }
            if (any == 0) continue;
            for (std::size_t k = 0; k < kBlock; ++k) {
                if (are_met[k] != 0) visitor(first + k);
            }
        }
        for (; first < last; ++first) {
            if (meets(first) != 0) visitor(first);
        }
    }

private:
    std::vector<std::uint32_t> bodies_;
    std::vector<float> start_, end_, low_u_, high_u_, low_v_, high_v_;
};

}  // namespace terrane::internal
