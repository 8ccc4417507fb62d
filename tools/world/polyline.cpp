// SPDX-License-Identifier: MIT
#include "world/polyline.h"

#include <algorithm>
#include <utility>

namespace terrane::tools {

Polyline::Polyline(std::vector<Eigen::Vector2d> points_world) : points_(std::move(points_world)) {
    lengths_.push_back(0.0);
    for (std::size_t i = 1; i < points_.size(); ++i) {
        lengths_.push_back(lengths_.back() + (points_[i] - points_[i - 1]).norm());
    }
}

std::size_t Polyline::segment(double along) const {
    const auto end = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, along);
    return static_cast<std::size_t>(end - lengths_.begin());
}

Eigen::Vector2d Polyline::at(double along) const {
    const double s = std::clamp(along, 0.0, length());
    const std::size_t end = segment(s);
    return points_[end - 1] + (s - lengths_[end - 1]) * direction(s);
}

Eigen::Vector2d Polyline::direction(double along) const {
    const std::size_t end = segment(std::clamp(along, 0.0, length()));
    return (points_[end] - points_[end - 1]).normalized();
}

}  // namespace terrane::tools
