// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::tools {

/// A quaternion as w, x, y, z: the format of rotations in input and output.
using Quaternion = std::array<double, 4>;

/// The rotation matrix of a quaternion, which need not have unit length but must not be 0.
Eigen::Matrix3d matrix_from_quaternion(const Quaternion& q);

/// The unit quaternion with w >= 0 of a rotation matrix.
Quaternion quaternion_from_matrix(const Eigen::Matrix3d& rotation);

/// A hash of three numbers, uniform over 64 bits: a random number without state, the same on every machine.
std::uint64_t hash_numbers(std::uint64_t seed, std::uint64_t index, std::uint64_t stream);

/// The sequence of uniform random numbers of one body.
class BodyRandom {
public:
    BodyRandom(std::uint64_t seed, std::uint64_t body) : seed_(seed), body_(body) {}
    /// The next number, in [0, 1).
    double unit() {
        return static_cast<double>(hash_numbers(seed_, body_, next_++) >> 11) * 0x1p-53;
    }
    double within(double low, double high) { return low + (high - low) * unit(); }

    /// A unit vector, uniform over all directions.
    Eigen::Vector3d direction() { return Eigen::Vector3d::Map(unit_vector<3>().data()); }
    /// A rotation matrix, uniform over all rotations.
    Eigen::Matrix3d rotation() { return matrix_from_quaternion(unit_vector<4>()); }

private:
    // Draws points from the cube [-1, 1]^dimensions until one is inside the unit ball, and normalises it.
    template <std::size_t dimensions>
    std::array<double, dimensions> unit_vector() {
        for (;;) {
            std::array<double, dimensions> v{};
            double square = 0.0;
            for (double& component : v) {
                component = within(-1.0, 1.0);
                square += component * component;
            }
            if (square > 1.0 || square < 0x1p-20) continue;
            const double length = std::sqrt(square);
            for (double& component : v) component /= length;
            return v;
        }
    }

    std::uint64_t seed_, body_, next_ = 0;
};

/// A polyline in the plane, parametrised by arc length, metres.
class Polyline {
public:
    /// Requires at least two points. Successive points must differ.
    explicit Polyline(std::vector<Eigen::Vector2d> points_world);

    double length() const { return lengths_.back(); }
    /// The point at the arc length `along`, clamped to [0, length()], from the first point.
    Eigen::Vector2d at(double along) const;
    /// The unit direction of the polyline at that point.
    Eigen::Vector2d direction(double along) const;
    const std::vector<Eigen::Vector2d>& points() const { return points_; }

private:
    std::size_t segment(double along) const;  // index of the point at the segment's end

    std::vector<Eigen::Vector2d> points_;
    std::vector<double> lengths_;  // arc length up to each point
};

}  // namespace terrane::tools
