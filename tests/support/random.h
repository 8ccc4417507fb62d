// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <type_traits>

namespace terrane::test {

/// A generator with the same sequence on every machine, unlike std::*_distribution. SplitMix64 (G. Steele, D. Lea, C.
/// Flood, 2014).
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    /// Uniform in [low, high).
    double between(double low, double high) {
        return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53);
    }
    /// Uniform in [0, count).
    int below(int count) { return static_cast<int>(bits() % static_cast<std::uint64_t>(count)); }
    /// A unit vector, uniform over the sphere.
    Eigen::Vector3d direction() {
        for (;;) {
            // Named variables fix the order of the draws on every compiler.
            const double x = between(-1.0, 1.0), y = between(-1.0, 1.0), z = between(-1.0, 1.0);
            const double square = x * x + y * y + z * z;
            if (square < 0.01 || square > 1.0) continue;
            return Eigen::Vector3d(x, y, z) / std::sqrt(square);
        }
    }
    /// A rotation matrix, uniform over all rotations.
    Eigen::Matrix3d rotation() {
        for (;;) {
            const double a = between(-1.0, 1.0), b = between(-1.0, 1.0);
            const double c = between(-1.0, 1.0), d = between(-1.0, 1.0);
            const double square = a * a + b * b + c * c + d * d;
            if (square < 0.01 || square > 1.0) continue;
            const double s = 2.0 / square;
            Eigen::Matrix3d rotation;
            rotation << 1.0 - s * (c * c + d * d), s * (b * c - a * d), s * (b * d + a * c),
                s * (b * c + a * d), 1.0 - s * (b * b + d * d), s * (c * d - a * b),
                s * (b * d - a * c), s * (c * d + a * b), 1.0 - s * (b * b + c * c);
            return rotation;
        }
    }

private:
    std::uint64_t state_;
};

/// A generator whose seed is in the message of every failure in its scope.
class SeededRandom : public Random {
public:
    explicit SeededRandom(std::uint64_t seed, const char* file = __builtin_FILE(),
                          int line = __builtin_LINE())
        : Random(seed), trace_(file, line, "seed " + std::to_string(seed)) {}

private:
    testing::ScopedTrace trace_;
};

/// FNV-1a hash (G. Fowler, L. C. Noll, K.-P. Vo) of numbers, from their least significant byte on every machine.
class Hash {
public:
    template <class T>
    void add(T value) {
        static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
        auto bytes = std::bit_cast<std::array<unsigned char, sizeof(T)>>(value);
        if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
        for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * 0x100000001b3u;
    }
    template <class T, std::size_t kCount>
    void add(const std::array<T, kCount>& values) {
        add_all(std::span<const T>(values));
    }
    template <class T>
    void add_all(std::span<const T> values) {
        for (const T& value : values) add(value);
    }
    std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// A number from an environment variable, such as the number of cases of a long run; `otherwise` if it is not set.
template <class Number>
Number number_from(const char* variable, Number otherwise) {
    const char* const text = std::getenv(variable);
    return text == nullptr ? otherwise : static_cast<Number>(std::strtod(text, nullptr));
}

/// Number of cases of a test: `few`, or `many` in runs under the label `long`, which set TERRANE_LONG.
inline int few_or_many(int few, int many) {
    return number_from("TERRANE_LONG", 0) != 0 ? many : few;
}

}  // namespace terrane::test
