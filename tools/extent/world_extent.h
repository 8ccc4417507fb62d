// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/math.h>

#include <optional>

namespace terrane::tools {

/// Log2 of the largest side of a fractal's world, metres: from -2^31 to 2^31 m.
inline constexpr int kMostWorldLog2 = 32;

/// Side of a world that is drawn, and of the part of a whole one that a command works in, metres.
inline constexpr double kWorkSide = 131072.0;

/// Sets the root squares of a fractal's world, four around its middle, which is the multiple of a root square's side
/// nearest to the start. The world is kWorkSide wide; a whole one, for questions that draw nothing, is as wide as its
/// spacing allows, up to kMostWorldLog2: around (0, 0) for spacings of 1 m or more. Heights are functions of place and
/// seed alone: no world changes them.
///
/// Worlds that are drawn are not wider, because the errors of vertices more than a wavelength of the first octave apart
/// all have one bound: those far from the eye seem small on the screen, and those near it depend on them.
///
/// @param side_m  of --world-m, metres: then the side is the next power of two and the world lies around (0, 0)
/// @param start   of --start-m
/// @param is_whole whether the world is as wide as its spacing allows
/// @param settings_out  whose spacing is read
///
/// Fails: exit_usage where the side or the start is out of range
CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, bool is_whole,
                                  FractalSettings& settings_out);

/// A square around a place, clipped to an extent that contains the place. Metres.
WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent);

/// The middle of a rectangle.
WorldVec2 middle_of(const WorldRect& rect);

}  // namespace terrane::tools
