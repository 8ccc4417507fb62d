// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/placed_shape.h"
#include "level_set/tile_lines.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Which of the two signed distances of a node.
enum class Field : std::uint8_t {
    to_void,   ///< negative where the node is void: matters below the heightfield
    to_solid,  ///< negative where it is solid: matters above
};

/// The values of one field along all lines of a tile, without those in regions of one sign. Between two runs of a line
/// the sign does not change.
struct FieldRuns {
    struct Run {
        std::int32_t first = 0, last = 0;  // nodes
        std::uint32_t begin = 0;           // of its values
    };
    std::vector<std::uint32_t> line_begin;  // [kTileLines + 1] into runs
    std::vector<Run> runs;                  // of each line, ascending
    std::vector<std::int16_t> values;       // steps
    std::vector<float> far_value;  // [kTileLines] of lines without runs: plus or minus the band
    float band = 0.0f;             // limit of values, metres

    std::span<const Run> of_line(int line) const {
        const auto l = static_cast<std::size_t>(line);
        return {runs.data() + line_begin[l], line_begin[l + 1] - line_begin[l]};
    }
};

/// Two sparse grids over the nodes of a tile: trees of OpenVDB with leaves of 4 x 4 x 4 nodes, at coordinates
/// (column, row, k). Values are limited to three spacings; where all are at that limit there is no leaf. They are held
/// in 16 bits: a step is 1e-4 spacing, and nodes within half a step of a surface are on it, whatever the rounding of
/// its distances.
///
/// Composition is ours and not openvdb::tools::csgUnion: an operation updates both fields at once, without a grid of
/// its own, and without OpenVDB's threads. Values are the same, `TileLevelSet.HasTheValuesOfOpenVdbsOwnComposition`.
class TileLevelSet {
public:
    explicit TileLevelSet(double spacing);
    TileLevelSet(const TileLevelSet& other);
    TileLevelSet& operator=(const TileLevelSet&) = delete;
    ~TileLevelSet();

    /// Both trees in OpenVDB's format, uncompressed; the same bytes for the same level set.
    std::vector<std::uint8_t> encoded() const;
    /// Replaces the level set by what encoded() gave. OpenVDB's reader is not hardened: only for bytes that are known
    /// to be whole.
    ///
    /// Fails: bad_data if there are too few or too many bytes
    Result<void> decode(std::span<const std::uint8_t> bytes);

    /// remove: to_void = min(to_void, d), to_solid = max(to_solid, -d). add: the other way round.
    void apply(VolumeOp op, const PlacedShape& shape, const TileLines& lines);

    /// In steps.
    std::int16_t value(Field field, int line, std::int32_t k) const;
    /// @param lines those of apply()
    FieldRuns runs(Field field, const TileLines& lines) const;
    std::size_t bytes() const;
    std::uint64_t band_node_count() const;
    /// Metres of a step.
    double step() const { return band_ / kBandSteps; }

private:
    struct Trees;
    class Application;
    std::unique_ptr<Trees> trees_;
    double band_;  // metres
};

}  // namespace terrane::internal
