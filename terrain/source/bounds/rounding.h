// SPDX-License-Identifier: MIT
#pragma once

// How bounds of heights are rounded outward.
namespace terrane {

/// A bound >= 0 times this is above the exact one: a few hundred operations on numbers >= 0 lose less than
/// 2^-44 of it.
inline constexpr double kOutward = 1.0 + 0x1p-40;

/// The square root of 2, rounded up.
inline constexpr double kSqrt2 = 1.4142135623730952;

/// Of HeightSource::height(), metres, beside the rounding of its sums.
inline constexpr double kHeightAccuracy = 1e-9;

}  // namespace terrane
