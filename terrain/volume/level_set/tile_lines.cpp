// SPDX-License-Identifier: MIT
#include "level_set/tile_lines.h"

#include <terrane/terrain/number_text.h>

namespace terrane::internal {

Result<TileLines> TileLines::create(const Lattice& lattice, int level, const VolumeTileKey& key,
                                    std::span<const std::int32_t> heights) {
    const std::int64_t step = lattice.step(level);
    TileLines lines;
    lines.spacing = lattice.level_spacing(level);
    lines.west = key.column * kVolumeTileCells;
    lines.south = key.row * kVolumeTileCells;
    const auto name = [&] {
        return "tile (" + number_text(key.column) + ", " + number_text(key.row) + ")";
    };
    if (lines.west * step < lattice.west() ||
        (lines.west + kVolumeTileCells) * step > lattice.east() ||
        lines.south * step < lattice.south() ||
        (lines.south + kVolumeTileCells) * step > lattice.north()) {
        return fail(ErrorCode::invalid_argument, name() + " is not of the world");
    }
    if (heights.size() != kTileLines) {
        return fail(ErrorCode::invalid_argument,
                    name() + " has 33 * 33 heights, got " + number_text(heights.size()));
    }
    for (std::size_t i = 0; i < kVolumeTileSamples; ++i) {
        lines.x[i] = lattice.x((lines.west + static_cast<std::int64_t>(i)) * step);
        lines.y[i] = lattice.y((lines.south + static_cast<std::int64_t>(i)) * step);
    }
    for (std::size_t line = 0; line < kTileLines; ++line) {
        const double height = static_cast<double>(heights[line]) * lattice.quantum;
        const double k = std::floor(height / lines.spacing + 0.5);
        if (!(std::abs(k) < kMostNode)) {
            return fail(
                ErrorCode::invalid_argument,
                name() + " has a height of " + number_text(height) + " m, beyond 2^28 spacings");
        }
        lines.height[line] = height;
        lines.surface[line] = static_cast<std::int32_t>(k);
        lines.offset[line] = height - k * lines.spacing;
    }
    return lines;
}

}  // namespace terrane::internal
