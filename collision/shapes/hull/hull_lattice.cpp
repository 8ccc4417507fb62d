// SPDX-License-Identifier: MIT
#include "shapes/hull/hull_lattice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace terrane::internal {
namespace {

__extension__ using Int128 = __int128;

constexpr int kBits = 60;  // differences fit 61 bits with sign, products 121, minors 122

Int128 minor(const LatticePoint& u, const LatticePoint& v, std::size_t i, std::size_t j) {
    return static_cast<Int128>(u[i]) * v[j] - static_cast<Int128>(u[j]) * v[i];
}

LatticePoint exact_difference(const LatticePoint& a, const LatticePoint& b) {
    return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

}  // namespace

LatticePoints make_lattice_points(std::span<const Eigen::Vector3d> points) {
    LatticePoints result;
    Eigen::Vector3d low = points[0];
    Eigen::Vector3d high = points[0];
    for (const Eigen::Vector3d& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
            result.largest = std::max(result.largest, std::abs(p[axis]));
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        result.extent = std::max(result.extent, high[axis] - low[axis]);
    }
    int exponent = 0;
    std::frexp(result.extent, &exponent);  // extent < 2^exponent
    const int shift = kBits - exponent;
    result.spacing = std::ldexp(1.0, -shift);
    result.tolerance =
        std::min(std::ldexp(result.largest, shift - 48), std::ldexp(result.extent, shift - 35));

    std::vector<LatticePoint> lattice(points.size());
    std::vector<Eigen::Vector3d> positions(points.begin(), points.end());
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            positions[i][axis] += 0.0;
            const double along = std::ldexp(points[i][axis] - low[axis], shift);
            lattice[i][static_cast<std::size_t>(axis)] =
                static_cast<std::int64_t>(std::floor(along + 0.5));
        }
    }
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        if (lattice[a] != lattice[b]) return lattice[a] < lattice[b];
        const Eigen::Vector3d& p = positions[a];
        const Eigen::Vector3d& q = positions[b];
        if (p[0] != q[0]) return p[0] < q[0];
        if (p[1] != q[1]) return p[1] < q[1];
        return p[2] < q[2];
    });
    for (const std::size_t i : order) {
        if (!result.lattice.empty() && result.lattice.back() == lattice[i]) continue;
        result.lattice.push_back(lattice[i]);
        result.positions.push_back(positions[i]);
    }
    return result;
}

Eigen::Vector3d difference(const LatticePoint& a, const LatticePoint& b) {
    const LatticePoint d = exact_difference(a, b);
    return {static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2])};
}

Eigen::Vector3d triangle_normal(const LatticePoint& a, const LatticePoint& b,
                                const LatticePoint& c) {
    const LatticePoint u = exact_difference(a, b);
    const LatticePoint v = exact_difference(a, c);
    return {static_cast<double>(minor(u, v, 1, 2)), static_cast<double>(minor(u, v, 2, 0)),
            static_cast<double>(minor(u, v, 0, 1))};
}

int side_of_plane(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c,
                  const LatticePoint& d) {
    const LatticePoint u = exact_difference(a, b);
    const LatticePoint v = exact_difference(a, c);
    const LatticePoint w = exact_difference(a, d);
    // The sum is high 2^64 + low, each minor split into its upper and its lower 64 bits.
    Int128 high = 0;
    Int128 low = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Int128 m = minor(u, v, (i + 1) % 3, (i + 2) % 3);
        high += (m >> 64) * w[i];
        low += static_cast<Int128>(static_cast<std::uint64_t>(m)) * w[i];
    }
    high += low >> 64;
    if (high != 0) return high > 0 ? 1 : -1;
    return static_cast<std::uint64_t>(low) != 0 ? 1 : 0;
}

int turn(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, int axis) {
    const auto i = static_cast<std::size_t>((axis + 1) % 3);
    const auto j = static_cast<std::size_t>((axis + 2) % 3);
    const Int128 m = minor(exact_difference(a, b), exact_difference(a, c), i, j);
    return m > 0 ? 1 : m < 0 ? -1 : 0;
}

}  // namespace terrane::internal
