// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/volume/volume_contour.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

inline constexpr int kTileLines = kVolumeTileSamples * kVolumeTileSamples;
/// Most spacings between a node and height 0.
inline constexpr double kMostNode = 0x1p28;
/// Half width of a tile's level sets, spacings. Nodes of one prism are less than 2.45 apart, so that at least one of
/// two nodes of different sign is within the band even where interpolated distances rise by sqrt(3).
inline constexpr double kBandSpacings = 3.0;

/// Index of a vertical line of a tile: row by row from the south-west.
constexpr int line_index(int column, int row) { return row * kVolumeTileSamples + column; }

/// The lines through the samples of a tile, and the nodes on them: VolumeNode has the definition.
struct TileLines {
    double spacing = 1.0;              // metres, of samples and of nodes
    std::int64_t west = 0, south = 0;  // of the first sample, spacings from lattice point (0, 0)
    std::array<double, kVolumeTileSamples> x{}, y{};  // world, metres
    std::array<double, kTileLines> height{};          // world, metres
    std::array<std::int32_t, kTileLines> surface{};   // m: the node that is the sample
    std::array<double, kTileLines> offset{};          // of nodes from z = k spacing, metres

    /// Fails: as VolumeTile::create()
    static Result<TileLines> create(const Lattice& lattice, int level, const VolumeTileKey& key,
                                    std::span<const std::int32_t> heights);

    double z(int line, std::int32_t k) const {
        const auto l = static_cast<std::size_t>(line);
        return height[l] + static_cast<double>(k - surface[l]) * spacing;
    }
    WorldPos position(int line, std::int32_t k) const {
        return {x[static_cast<std::size_t>(line % kVolumeTileSamples)],
                y[static_cast<std::size_t>(line / kVolumeTileSamples)], z(line, k)};
    }
    VolumeNode node(int line, std::int32_t k) const {
        return {west + line % kVolumeTileSamples, south + line / kVolumeTileSamples, k};
    }
    /// Whether node k of line a is below node k of line b: a total order, the same in all tiles.
    bool is_lower(int a, int b) const {
        const double of_a = offset[static_cast<std::size_t>(a)],
                     of_b = offset[static_cast<std::size_t>(b)];
        return of_a < of_b || (of_a == of_b && a < b);
    }
};

}  // namespace terrane::internal
