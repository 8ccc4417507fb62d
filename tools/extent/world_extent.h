// SPDX-License-Identifier: MIT
#pragma once

#include "options/command.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/math.h>

#include <optional>

namespace terrane::tools {

/// Log2 of the largest side of a fractal's world, metres: from -2^31 to 2^31 m.
inline constexpr int kMostWorldLog2 = 32;

/// Side of the part of an endless world that a command works in, metres.
inline constexpr double kWorkSide = 131072.0;

/// How large the world of a fractal is where no side is asked for.
enum class WorldKind {
    /// As wide as its spacing allows, up to kMostWorldLog2, with a root window of twice kWorkSide that moves
    /// with the camera: for commands that draw or play.
    windowed,
    /// The same width in four root squares: for questions, which load little.
    whole,
    /// kWorkSide wide around the start, in four root squares: for commands that read all of it.
    bounded,
};

/// Sets the root squares of a fractal's world. With a side it lies around (0, 0). Without one its middle, or the origin
/// of its keys, is the multiple of a root square's side nearest to the start, so that fine spacings, whose keys do not
/// reach far, have a world there too. Heights are functions of place and seed alone: no world changes them.
///
/// @param side_m  of --world-m, metres: then the side is the next power of two, in four root squares
/// @param start   of --start-m
/// @param settings_out  whose spacing is read
///
/// Fails: exit_usage where the side or the start is out of range
CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, WorldKind kind,
                                  FractalSettings& settings_out);

/// A square around a place, clipped to an extent that contains the place. Metres.
WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent);

/// The middle of a rectangle.
WorldVec2 middle_of(const WorldRect& rect);

}  // namespace terrane::tools
