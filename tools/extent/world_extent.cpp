// SPDX-License-Identifier: MIT
#include "extent/world_extent.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terrane::tools {
namespace {

constexpr int kChunkLog2 = 7;     // of the cells along a chunk
constexpr int kMostLevels = 24;   // below the root squares, as Lattice allows
constexpr int kBoundedLog2 = 17;  // of a world that is read whole, and the most of --world-m
// Root squares of a windowed world, and how many are resident along a side: from a camera in the middle two the edge is
// at least one of them away.
constexpr int kWindowRootLog2 = 16;
constexpr int kWindow = 4;

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

struct RootRange {
    std::int32_t first = 0, count = 0;
};

// Root squares within a reach of 0 whose chunks have keys.
RootRange roots_within(double origin, double side, double reach, int finest_level) {
    const double most = std::ldexp(1.0, 31 - finest_level) - 1.0;
    const double first = std::max(std::ceil((-reach - origin) / side), -most);
    const double end = std::min(std::floor((reach - origin) / side), most);
    return {static_cast<std::int32_t>(first), static_cast<std::int32_t>(end - first)};
}

CommandResult<void> check_start(const std::optional<WorldVec2>& start, double most) {
    if (!start || (std::abs(start->x()) <= most && std::abs(start->y()) <= most)) return {};
    return usage_error(fmt::format(
        "--start-m must be within {:.10g} m of 0,0 along each axis, got {:.10g},{:.10g}", most,
        start->x(), start->y()));
}

// Four root squares around a middle.
void set_four_roots(double middle_x, double middle_y, int root_log2,
                    FractalSettings& settings_out) {
    settings_out.origin_x = middle_x;
    settings_out.origin_y = middle_y;
    settings_out.root_size_log2 = root_log2;
    settings_out.first_root_x = settings_out.first_root_y = -1;
    settings_out.root_count_x = settings_out.root_count_y = 2;
}

}  // namespace

CommandResult<void> lay_out_world(std::optional<double> side_m,
                                  const std::optional<WorldVec2>& start, WorldKind kind,
                                  FractalSettings& settings_out) {
    const int spacing_log2 = settings_out.finest_spacing_log2;
    const int least_log2 = spacing_log2 + kChunkLog2 + 1;
    const int whole_log2 = std::min(spacing_log2 + kChunkLog2 + kMostLevels + 1, kMostWorldLog2);
    const int most_log2 = kind == WorldKind::whole
                              ? whole_log2
                              : std::max(least_log2, std::min(whole_log2, kBoundedLog2));
    const double least = std::ldexp(1.0, least_log2), most = std::ldexp(1.0, most_log2);
    if (side_m) {
        if (!(*side_m >= least && *side_m <= most)) {
            return usage_error(fmt::format(
                "--world-m must be {:.10g} to {:.10g} over a spacing of {:.6g} m, got {:.10g}",
                least, most, std::ldexp(1.0, spacing_log2), *side_m));
        }
        set_four_roots(0.0, 0.0, log2_above(*side_m) - 1, settings_out);
        return check_start(start, std::ldexp(1.0, settings_out.root_size_log2));
    }
    const double reach = reach_of(spacing_log2);
    if (auto ok = check_start(start, reach); !ok) return ok;
    const WorldVec2 middle = start.value_or(WorldVec2(0.0, 0.0));
    const auto middle_of_world = [&](double place, int root_log2) {
        return middle_near(place, std::ldexp(1.0, root_log2), reach);
    };
    if (kind != WorldKind::windowed) {
        const int root_log2 = most_log2 - 1;
        set_four_roots(middle_of_world(middle.x(), root_log2),
                       middle_of_world(middle.y(), root_log2), root_log2, settings_out);
        return {};
    }
    const int root_log2 = std::clamp(kWindowRootLog2, spacing_log2 + kChunkLog2,
                                     spacing_log2 + kChunkLog2 + kMostLevels);
    const double side = std::ldexp(1.0, root_log2);
    settings_out.root_size_log2 = root_log2;
    settings_out.origin_x = middle_of_world(middle.x(), root_log2);
    settings_out.origin_y = middle_of_world(middle.y(), root_log2);
    const int finest_level = root_log2 - spacing_log2 - kChunkLog2;
    const RootRange x = roots_within(settings_out.origin_x, side, reach, finest_level);
    const RootRange y = roots_within(settings_out.origin_y, side, reach, finest_level);
    settings_out.first_root_x = x.first;
    settings_out.root_count_x = x.count;
    settings_out.first_root_y = y.first;
    settings_out.root_count_y = y.count;
    settings_out.root_window = kWindow;
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
