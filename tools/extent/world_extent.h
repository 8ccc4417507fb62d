// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/math.h>

#include <optional>

namespace terrane::tools {

/// Log2 of the largest side of a fractal's world, metres: from -2^31 to 2^31 m.
inline constexpr int kMostWorldLog2 = 32;

/// Sets the root squares of a fractal's world, four around its middle: the largest that its spacing allows, up to
/// kMostWorldLog2 for all of them. A world of spacings of 1 m or more lies around (0, 0). A finer one is narrower, by
/// the powers of two that it is finer, and lies around the start: its middle is the multiple of a root square's side
/// nearest to it. Heights are functions of place and seed alone: no world changes them.
///
/// @param side_m  of --world-m, metres: then the side is the next power of two and the world lies around (0, 0)
/// @param start   of --start-m
/// @param settings_out  whose spacing is read
///
/// Fails: exit_usage where the side or the start is out of range
CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start,
                                  FractalSettings& settings_out);

/// Side of the part of a world that a command works in around its start, metres.
inline constexpr double kWorkSide = 131072.0;

/// A square around a place, clipped to an extent that contains the place. Metres.
WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent);

/// The middle of a rectangle.
WorldVec2 middle_of(const WorldRect& rect);

}  // namespace terrane::tools
