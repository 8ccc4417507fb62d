// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <ostream>
#include <string>

namespace terrane {

/// Name of a parametrised test's fractal.
inline std::string name_of(FractalKind kind) {
    constexpr std::array<const char*, 4> kNames{"fbm", "ridged", "hybrid", "warped"};
    return kNames[static_cast<std::size_t>(kind)];
}

inline void PrintTo(FractalKind kind, std::ostream* out) { *out << name_of(kind); }

namespace test {

inline const auto kAllFractalKinds = testing::Values(FractalKind::fbm, FractalKind::ridged,
                                                     FractalKind::hybrid, FractalKind::warped);

}  // namespace test
}  // namespace terrane
