// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace terrane::tools {

/// Hash of three numbers, uniform over 64 bits: stateless random numbers, the same on every machine.
std::uint64_t hash_numbers(std::uint64_t seed, std::uint64_t index, std::uint64_t stream);

/// The sequence of uniform random numbers of one body.
class BodyRandom {
public:
    BodyRandom(std::uint64_t seed, std::uint64_t body) : seed_(seed), body_(body) {}
    /// In [0, 1).
    double unit() {
        return static_cast<double>(hash_numbers(seed_, body_, next_++) >> 11) * 0x1p-53;
    }
    double within(double low, double high) { return low + (high - low) * unit(); }

    /// Uniform unit vector, by rejection sampling of the unit ball from the cube.
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
