// SPDX-License-Identifier: MIT
#include "extent/world_extent.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

constexpr int kChunkLog2 = 7;    // of the cells along a chunk
constexpr int kMostLevels = 24;  // below the root squares, as Lattice allows

// Log2 of the next power of two.
int log2_above(double value) {
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return mantissa == 0.5 ? exponent - 1 : exponent;
}

// How far from 0 a world may reach, metres: lattices lie within 2^40 spacings.
double reach_of(int spacing_log2) {
    return std::ldexp(1.0, std::min(kMostWorldLog2 - 1, spacing_log2 + 40));
}

// The multiple of `side` nearest to a place that keeps two squares of that side within a reach.
double middle_near(double place, double side, double reach) {
    const double farthest = reach - side;
    return std::clamp(std::floor(place / side + 0.5) * side, -farthest, farthest);
}

}  // namespace

CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, bool is_whole,
                                  FractalSettings& settings_out) {
    const int spacing_log2 = settings_out.finest_spacing_log2;
    const int least_log2 = spacing_log2 + kChunkLog2 + 1;
    const int whole_log2 = std::min(spacing_log2 + kChunkLog2 + kMostLevels + 1, kMostWorldLog2);
    const int most_log2 =
        is_whole ? whole_log2 : std::max(least_log2, std::min(whole_log2, log2_above(kWorkSide)));
    const double least = std::ldexp(1.0, least_log2), most = std::ldexp(1.0, most_log2);
    if (side_m && !(*side_m >= least && *side_m <= most)) {
        return usage_error(fmt::format(
            "--world-m must be {:.10g} to {:.10g} over a spacing of {:.6g} m, got {:.10g}", least,
            most, std::ldexp(1.0, spacing_log2), *side_m));
    }
    settings_out.root_size_log2 = (side_m ? log2_above(*side_m) : most_log2) - 1;
    settings_out.first_root_x = settings_out.first_root_y = -1;
    settings_out.root_count_x = settings_out.root_count_y = 2;
    const double root_side = std::ldexp(1.0, settings_out.root_size_log2);
    if (!side_m && start) {
        settings_out.origin_x = middle_near(start->x(), root_side, reach_of(spacing_log2));
        settings_out.origin_y = middle_near(start->y(), root_side, reach_of(spacing_log2));
    }
    const auto is_within = [root_side](double place, double middle) {
        return std::abs(place - middle) <= root_side;
    };
    if (start && !(is_within(start->x(), settings_out.origin_x) &&
                   is_within(start->y(), settings_out.origin_y))) {
        return usage_error(fmt::format(
            "--start-m must be within {:.10g} m of 0,0 along each axis, got {:.10g},{:.10g}",
            side_m ? root_side : reach_of(spacing_log2), start->x(), start->y()));
    }
    return {};
}

WorldRect square_around(const WorldVec2& place, double side, const WorldRect& extent) {
    const double half = 0.5 * side;
    return {std::max(extent.west, place.x() - half), std::max(extent.south, place.y() - half),
            std::min(extent.east, place.x() + half), std::min(extent.north, place.y() + half)};
}

WorldVec2 middle_of(const WorldRect& rect) {
    return {0.5 * (rect.west + rect.east), 0.5 * (rect.south + rect.north)};
}

}  // namespace terrane::tools
