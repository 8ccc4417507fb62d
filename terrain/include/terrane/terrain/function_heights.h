// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <functional>
#include <memory>
#include <optional>

namespace terrane {

/// World z in metres at world x and y in metres: a pure function, called from any number of threads at once. It is
/// evaluated over the extent and up to the side of a root square beyond it.
using HeightFunction = std::function<double(double x, double y)>;

/// Settings of heights_from_function(): lattice, extent, and known bounds of the function.
///
/// With `slope`, `curvature` or both, all results are certified. The surface then deviates from a triangle with longest
/// edge l by at most the smallest of these terms for which you state the bound:
///
///     slope * l / 2,    curvature * l^2 / 8,    range.high - range.low.
///
/// Without a curvature, this bound decreases only in proportion to the spacing, so that more triangles are drawn.
/// Without a slope, intervals are wide, so that more chunks are loaded. With neither, both are estimated from samples,
/// and the source is not certified: see HeightSource::is_certified().
struct FunctionHeightsSettings {
    WorldRect extent = {};        ///< of the ground, metres; finite and not empty
    double finest_spacing = 1.0;  ///< metres between samples of the finest level: Lattice::spacing
    double quantum = 0x1p-12;     ///< Lattice::quantum
    /// The lattice of another source, to compose the two; finest_spacing and quantum are then ignored. Absent: a
    /// lattice of its own, whose point (0, 0) is the south-western corner of the extent.
    std::optional<Lattice> lattice = std::nullopt;
    /// Lipschitz bound: |h(p) - h(q)| <= slope * |p - q|, everywhere. 0 to 1e6.
    std::optional<double> slope = std::nullopt;
    /// Bound of the second derivative in every direction, 1/m: |grad h(p) - grad h(q)| <= curvature * |p - q|,
    /// everywhere. 0 to 1e9. A function with a crease has none.
    std::optional<double> curvature = std::nullopt;
    /// Interval of all heights, metres. A height outside it is an error.
    std::optional<HeightInterval> range = std::nullopt;
};

/// A source from a function and its known bounds. If the source has a lattice of its own, the side of a root square is
/// at least a quarter of the extent's longer side. Bounds of vertices are exactly nested.
///
/// If the function throws or returns NaN or infinity, sample() fails with a message of one line that names the position
/// and the value, and height() returns NaN.
///
/// Fails:   invalid_argument for settings out of range; io if the function throws or returns NaN while its bounds are
///          estimated
/// Threads: as HeightSource
/// Cost:    calls of the function: one per sample; none for certified bounds, about 17 per sample for estimated ones;
///          one for interval(), or five if only a curvature is known
Result<std::shared_ptr<const HeightSource>> heights_from_function(
    HeightFunction function, const FunctionHeightsSettings& settings);

}  // namespace terrane
