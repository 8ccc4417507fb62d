// SPDX-License-Identifier: MIT
#include "support/input.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace terrane::fuzz {
namespace {

constexpr std::uint8_t kAnyBits = 255;  // first byte of a number that is given by its bits

}  // namespace

std::uint8_t Input::byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
}

std::uint64_t Input::bits(int width) {
    std::uint64_t value = 0;
    for (int i = 0; i < width; ++i) value |= std::uint64_t{byte()} << (8 * i);
    return value;
}

double Input::between(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits(2)) / 65535.0);
}

double Input::number(double low, double high) {
    if (bytes_.empty() || bytes_.front() != kAnyBits) return between(low, high);
    byte();
    return std::bit_cast<double>(bits(8));
}

Eigen::Vector3d Input::vector(double low, double high) {
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = number(low, high);
    return v;
}

Eigen::Matrix3d Input::rotation() {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    const int kind = below(8);
    if (kind == 0) return matrix;
    if (kind == 7) {
        for (int column = 0; column < 3; ++column) matrix.col(column) = vector(-1.0, 1.0);
        return matrix;
    }
    double q[4];
    double square = 0.0;
    for (double& component : q) {
        component = static_cast<double>(static_cast<std::int8_t>(byte()));
        square += component * component;
    }
    if (square == 0.0) return matrix;
    const double s = 2.0 / square;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    matrix << 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
        s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x), s * (x * z - w * y),
        s * (y * z + w * x), 1.0 - s * (x * x + y * y);
    return matrix;
}

std::span<const std::uint8_t> Input::bytes(std::size_t most) {
    const std::size_t count = std::min(most, bytes_.size());
    const std::span<const std::uint8_t> taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
}

std::string_view Input::rest_as_text() {
    const std::span<const std::uint8_t> left = rest();
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    return {reinterpret_cast<const char*>(left.data()), left.size()};
}

}  // namespace terrane::fuzz
