// SPDX-License-Identifier: MIT
#include "box_columns.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// More than half a step of a float, relative and at the least one.
constexpr float kStep = 0x1p-23f;
constexpr float kLeast = 0x1p-126f;
constexpr double kFarthest = 0x1p126;

float round_down(double value) {
    const auto nearest = static_cast<float>(std::clamp(value, -kFarthest, kFarthest));
    return nearest - (kStep * std::abs(nearest) + kLeast);
}

float round_up(double value) { return -round_down(-value); }

}  // namespace

void BoxColumns::reset(std::size_t count, int axis, double margin, const Eigen::Vector3d& origin) {
    axes_ = {axis, (axis + 1) % 3, (axis + 2) % 3};
    margin_ = margin;
    origin_ = origin;
    bodies_.resize(count);
    for (std::vector<float>* column : {&start_, &end_, &low_u_, &high_u_, &low_v_, &high_v_}) {
        column->resize(count);
    }
}

void BoxColumns::set(std::size_t place, std::uint32_t body, const Bounds& box) {
    bodies_[place] = body;
    // A hair wider, for what rounding did before.
    constexpr double kHair = 0x1p-48;
    const auto low = [&](int axis) {
        const double d = box.low[axis] - origin_[axis];
        return round_down(d - margin_ - kHair * (std::abs(d) + margin_));
    };
    const auto high = [&](int axis) {
        const double d = box.high[axis] - origin_[axis];
        return round_up(d + margin_ + kHair * (std::abs(d) + margin_));
    };
    start_[place] = low(axes_[0]);
    end_[place] = high(axes_[0]);
    low_u_[place] = low(axes_[1]);
    high_u_[place] = high(axes_[1]);
    low_v_[place] = low(axes_[2]);
    high_v_[place] = high(axes_[2]);
}

}  // namespace terrane::internal
