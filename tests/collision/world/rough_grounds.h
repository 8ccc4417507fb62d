// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>

// Rough grounds that bodies are dropped on.
namespace terrane::test {

/// Heights by lattice point: grounds that are not smooth functions.
inline std::uint64_t scramble(double x, double y) {
    std::uint64_t z =
        static_cast<std::uint64_t>(static_cast<std::int64_t>(x)) * 0x9e3779b97f4a7c15u ^
        static_cast<std::uint64_t>(static_cast<std::int64_t>(y)) * 0xc2b2ae3d27d4eb4fu;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    return z ^ (z >> 27);
}

struct RoughGround {
    const char* name;
    double (*height)(double, double);
};

inline constexpr RoughGround kRoughGrounds[] = {
    {"hills",
     [](double x, double y) { return 6.0 * std::sin(0.21 * x) * std::sin(0.17 * y) + 0.3 * x; }},
    {"noise", [](double x, double y) { return static_cast<double>(scramble(x, y) % 256) / 64.0; }},
    {"spikes", [](double x, double y) { return scramble(x, y) % 7 == 0 ? 12.0 : 0.0; }},
    {"walls", [](double x, double) { return static_cast<std::int64_t>(x) % 6 == 0 ? 30.0 : 0.0; }},
    {"pits", [](double x, double y) { return scramble(x, y) % 5 == 0 ? -40.0 : 0.0; }},
    {"stairs", [](double x, double y) { return 2.0 * std::floor(x / 4.0) + std::floor(y / 3.0); }},
};

}  // namespace terrane::test
