// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/placed_shape.h"

#include <terrane/volume/volume_tile.h>
#include <terrane/volume/volumes.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

inline constexpr int kTileLines = kVolumeTileSamples * kVolumeTileSamples;
/// Largest distance of a node from height 0, spacings.
inline constexpr double kMostNode = 0x1p28;
/// Half width of the band of a tile's level sets, spacings. Two nodes of one prism are less than 2.45 spacings apart.
/// So if they have different signs, at least one is within the band, even where interpolated distances have slope
/// sqrt(3).
inline constexpr double kBandSpacings = 3.0;

/// Index of a vertical line in a tile: row by row from the south-west.
constexpr int line_index(int column, int row) { return row * kVolumeTileSamples + column; }

/// The lines through the samples of a tile and the nodes on them, as defined at VolumeNode.
struct TileLines {
    double spacing = 1.0;              // metres, of samples and of nodes
    std::int64_t west = 0, south = 0;  // of the first sample, spacings from lattice point (0, 0)
    std::array<double, kVolumeTileSamples> x{}, y{};  // world, metres
    std::array<double, kTileLines> height{};          // world, metres
    std::array<std::int32_t, kTileLines> surface{};   // m: the node at the sample
    std::array<double, kTileLines> offset{};          // z of node k minus k spacing, metres

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
    /// Whether node k of line a is lower than node k of line b: a total order, the same in all tiles.
    bool is_lower(int a, int b) const {
        const double of_a = offset[static_cast<std::size_t>(a)],
                     of_b = offset[static_cast<std::size_t>(b)];
        return of_a < of_b || (of_a == of_b && a < b);
    }
};

/// One of a node's two signed distances.
enum class Field : std::uint8_t {
    to_void,   ///< negative where the node is void; used below the heightfield
    to_solid,  ///< negative where the node is solid; used above it
};

/// The stored values of one field along all lines of a tile, as runs of consecutive nodes. Nodes between two runs of a
/// line are beyond the band and have the sign of the runs' ends.
struct FieldRuns {
    struct Run {
        std::int32_t first = 0, last = 0;  // nodes
        std::uint32_t begin = 0;           // index of its first value
    };
    std::vector<std::uint32_t> line_begin;  // [kTileLines + 1] into runs
    std::vector<Run> runs;                  // of each line, ascending
    std::vector<std::int16_t> values;       // steps
    std::vector<float> far_value;  // [kTileLines] of lines without runs, in steps: +-kBandSteps

    std::span<const Run> of_line(int line) const {
        const auto l = static_cast<std::size_t>(line);
        return {runs.data() + line_begin[l], line_begin[l + 1] - line_begin[l]};
    }
};

/// Two sparse grids over the nodes of a tile: OpenVDB trees with leaves of 4 x 4 x 4 nodes at coordinates (column, row,
/// k). Values are clamped to three spacings; where all are at the limit there is no leaf. Values have 16 bits: a step
/// is about 1e-4 spacing. A node within half a step of a surface is on it, whatever the rounding of its distance.
///
/// Operations are composed here instead of by openvdb::tools::csgUnion. This updates both fields at once, without a
/// grid for the operation and without OpenVDB's threads, and gives the same values
/// (`TileLevelSet.HasTheValuesOfOpenVdbsOwnComposition`).
class TileLevelSet {
public:
    explicit TileLevelSet(double spacing);
    TileLevelSet(const TileLevelSet& other);
    TileLevelSet& operator=(const TileLevelSet&) = delete;
    ~TileLevelSet();

    /// Both trees in OpenVDB's format, uncompressed; the same bytes for the same level set.
    std::vector<std::uint8_t> encoded() const;
    /// Replaces the level set by the result of encoded(). The bytes must be known to be intact: OpenVDB's reader is not
    /// hardened.
    ///
    /// Fails: bad_data if there are too few or too many bytes
    Result<void> decode(std::span<const std::uint8_t> bytes);

    /// remove: to_void = min(to_void, d), to_solid = max(to_solid, -d). add: with the fields exchanged.
    void apply(VolumeOp op, const PlacedShape& shape, const TileLines& lines);

    /// Value of a field at node k of a line, in steps.
    std::int16_t value(Field field, int line, std::int32_t k) const;
    /// @param lines as given to apply()
    FieldRuns runs(Field field, const TileLines& lines) const;
    std::size_t bytes() const;
    std::uint64_t band_node_count() const;
    /// Size of a step, metres.
    double step() const { return band_ / kBandSteps; }

private:
    struct Trees;
    class Application;
    std::unique_ptr<Trees> trees_;
    double band_;  // metres
};

}  // namespace terrane::internal
