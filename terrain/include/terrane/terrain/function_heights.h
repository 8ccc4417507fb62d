// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <functional>
#include <memory>
#include <optional>

namespace terrane {

/// World z in metres at world x and y, metres: a pure function, which any number of threads may call at once. It is
/// asked over the extent, and around it by up to a root square.
using HeightFunction = std::function<double(double x, double y)>;

/// Settings of heights_from_function(): where the ground is, and what is known of the function.
///
/// Bounds of the function make everything certified. At least one of `slope` and `curvature` is needed for that. Over a
/// triangle with the longest edge l the smallest of
///
///     slope * l / 2,    curvature * l^2 / 8,    range.high - range.low
///
/// is the bound of the deviation: without a curvature it shrinks only as fast as the spacing, which costs triangles;
/// without a slope, intervals are wide, which costs chunks. Without both, both are estimated from samples, and the
/// source is not certified: HeightSource::is_certified().
struct FunctionHeightsSettings {
    WorldRect extent = {};        ///< of the ground, metres; finite and not empty
    double finest_spacing = 1.0;  ///< metres between samples of the finest level: Lattice::spacing
    double quantum = 0x1p-12;     ///< Lattice::quantum
    /// The lattice of another source, to compose with it; then finest_spacing and quantum are not used. Absent: one of
    /// its own, with lattice point (0, 0) at the extent's south-western corner.
    std::optional<Lattice> lattice = std::nullopt;
    /// Lipschitz bound: |h(p) - h(q)| <= slope * |p - q|, everywhere. 0 to 1e6.
    std::optional<double> slope = std::nullopt;
    /// Bound of the second derivative in every direction, 1/m: |grad h(p) - grad h(q)| <= curvature * |p - q|,
    /// everywhere. 0 to 1e9. A function with a crease has none.
    std::optional<double> curvature = std::nullopt;
    /// Contains all heights, metres. A height outside is an error.
    std::optional<HeightInterval> range = std::nullopt;
};

/// A source from a function and what is known of it. A root square of its own lattice has at least a quarter of the
/// extent's longer side. Bounds of vertices are exactly nested.
///
/// Where the function throws or gives NaN or infinity, sample() fails with one line that names the place and the
/// value; height() is NaN there.
///
/// Fails:   invalid_argument for settings out of range; io where the function throws or gives NaN while its bounds are
///          estimated
/// Threads: those of HeightSource
/// Cost:    of a sample one call; of bounds nothing where they are certified, about 17 calls a sample where they are
///          estimated; of interval() one call, five where only a curvature is known
Result<std::shared_ptr<const HeightSource>> heights_from_function(
    HeightFunction function, const FunctionHeightsSettings& settings);

}  // namespace terrane
