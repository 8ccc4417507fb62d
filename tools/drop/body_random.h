// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace terrane::tools {

/// Hash of three numbers, uniform over 64 bits: random numbers without a state, the same everywhere.
std::uint64_t hash_numbers(std::uint64_t seed, std::uint64_t index, std::uint64_t stream);

/// Uniform numbers of one body, in their order.
class BodyRandom {
public:
    BodyRandom(std::uint64_t seed, std::uint64_t body) : seed_(seed), body_(body) {}
    /// 0 to 1, 1 left out.
    double unit() {
        return static_cast<double>(hash_numbers(seed_, body_, next_++) >> 11) * 0x1p-53;
    }
    double within(double low, double high) { return low + (high - low) * unit(); }

    /// Uniform over the directions of a space, by taking points of the cube until one is in the ball.
    template <std::size_t dimensions>
    std::array<double, dimensions> direction() {
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

private:
    std::uint64_t seed_, body_, next_ = 0;
};

}  // namespace terrane::tools
