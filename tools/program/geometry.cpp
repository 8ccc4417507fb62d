// SPDX-License-Identifier: MIT
//
// Sources:
//   S. Shepperd. Quaternion from Rotation Matrix. Journal of Guidance and Control 1, 1978
//   (divides by the largest component).
#include "program/geometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {

Eigen::Matrix3d matrix_from_quaternion(const Quaternion& q) {
    const auto [w, x, y, z] = q;
    const double s = 2.0 / (w * w + x * x + y * y + z * z);
    Eigen::Matrix3d rotation;
    rotation(0, 0) = 1.0 - s * (y * y + z * z);
    rotation(0, 1) = s * (x * y - w * z);
    rotation(0, 2) = s * (x * z + w * y);
    rotation(1, 0) = s * (x * y + w * z);
    rotation(1, 1) = 1.0 - s * (x * x + z * z);
    rotation(1, 2) = s * (y * z - w * x);
    rotation(2, 0) = s * (x * z - w * y);
    rotation(2, 1) = s * (y * z + w * x);
    rotation(2, 2) = 1.0 - s * (x * x + y * y);
    return rotation;
}

Quaternion quaternion_from_matrix(const Eigen::Matrix3d& rotation) {
    const auto r = [&](int row, int column) { return rotation(row, column); };
    // four times the square of each component
    const std::array<double, 4> squares{
        1.0 + r(0, 0) + r(1, 1) + r(2, 2), 1.0 + r(0, 0) - r(1, 1) - r(2, 2),
        1.0 - r(0, 0) + r(1, 1) - r(2, 2), 1.0 - r(0, 0) - r(1, 1) + r(2, 2)};
    const auto largest = std::max_element(squares.begin(), squares.end()) - squares.begin();
    const double wx = r(2, 1) - r(1, 2);
    const double wy = r(0, 2) - r(2, 0);
    const double wz = r(1, 0) - r(0, 1);
    const double xy = r(1, 0) + r(0, 1);
    const double xz = r(0, 2) + r(2, 0);
    const double yz = r(2, 1) + r(1, 2);
    Quaternion q{};
    if (largest == 0) {
        q = {squares[0], wx, wy, wz};
    } else if (largest == 1) {
        q = {wx, squares[1], xy, xz};
    } else if (largest == 2) {
        q = {wy, xy, squares[2], yz};
    } else {
        q = {wz, xz, yz, squares[3]};
    }
    double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (q[0] < 0.0) length = -length;
    for (double& component : q) component /= length;
    return q;
}

// Sources:
//   G. Steele, D. Lea, C. Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014 (mix).

namespace {

std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

}  // namespace

std::uint64_t hash_numbers(std::uint64_t seed, std::uint64_t index, std::uint64_t stream) {
    constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;
    return mix(mix(mix(seed + kGolden) ^ (index + kGolden)) + stream * kGolden);
}

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
