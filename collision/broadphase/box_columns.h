// SPDX-License-Identifier: MIT
#pragma once

#include "pair_list.h"

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Boxes in the order of a sweep, a column for each end: floats, rounded outwards, so that what they part is
/// apart.
class BoxColumns {
public:
    /// @param axis   along which they are swept
    /// @param margin that each box is widened by
    void reset(std::size_t count, int axis, double margin, const Eigen::Vector3d& origin);
    /// Sets the box at a place of the order.
    void set(std::size_t place, std::uint32_t body, const Bounds& box);

    std::uint32_t body(std::size_t place) const { return bodies_[place]; }
    /// Where it starts and ends along the axis of the sweep.
    float start(std::size_t place) const { return start_[place]; }
    float end(std::size_t place) const { return end_[place]; }

    /// Calls take(place) for the boxes at places [first, last) that overlap that at `place` along the two other
    /// axes.
    template <class Take>
    void visit_across(std::size_t place, std::size_t first, std::size_t last, Take&& take) const {
        const float low_u = low_u_[place], high_u = high_u_[place];
        const float low_v = low_v_[place], high_v = high_v_[place];
        constexpr std::size_t kBlock = 16;
        std::array<std::uint8_t, kBlock> meets;
        for (; first + kBlock <= last; first += kBlock) {
            // No branch: compilers make vectors of it.
            std::uint8_t any = 0;
            for (std::size_t k = 0; k < kBlock; ++k) {
                const std::size_t i = first + k;
                const int is_met =
                    static_cast<int>(low_u_[i] <= high_u) & static_cast<int>(low_u <= high_u_[i]) &
                    static_cast<int>(low_v_[i] <= high_v) & static_cast<int>(low_v <= high_v_[i]);
                meets[k] = static_cast<std::uint8_t>(is_met);
                any = static_cast<std::uint8_t>(any | meets[k]);
            }
            if (any == 0) continue;
            for (std::size_t k = 0; k < kBlock; ++k) {
                if (meets[k] != 0) take(first + k);
            }
        }
        for (; first < last; ++first) {
            if (low_u_[first] <= high_u && low_u <= high_u_[first] && low_v_[first] <= high_v &&
                low_v <= high_v_[first]) {
                take(first);
            }
        }
    }

private:
    std::array<int, 3> axes_{0, 1, 2};  ///< of the sweep, and the two others
    double margin_ = 0.0;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    std::vector<std::uint32_t> bodies_;
    std::vector<float> start_, end_, low_u_, high_u_, low_v_, high_v_;
};

}  // namespace terrane::internal
