// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/tile_level_set.h"

#include <terrane/volume/volume_tile.h>

#include <array>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// State of a sample of the heightfield, set by the last operation that covers it.
enum class SampleState : std::uint8_t { natural, in_void, in_solid };

/// One node: a line of the tile, and k.
struct LineNode {
    int line = 0;
    std::int32_t k = 0;
    friend constexpr auto operator<=>(const LineNode&, const LineNode&) = default;
};

/// Both fields of a tile, and the states of its samples.
struct TileFields {
    FieldRuns to_void, to_solid;
    std::array<SampleState, kTileLines> states{};

    TileFields(const TileLevelSet& level_set, const TileLines& lines);

    const FieldRuns& of(Field field) const { return field == Field::to_void ? to_void : to_solid; }
    /// The field's value at a node, in steps, -kBandSteps to kBandSteps.
    double value(Field field, const LineNode& node) const;
    /// Classifies `count` nodes of a line, from `first` on, by the sign of a field: 1 in the solid, 0 outside. By
    /// `to_void`, nodes that are not void are in the solid; by `to_solid`, only nodes that are solid.
    void copy_inside(Field field, int line, std::int32_t first, std::size_t count,
                     std::vector<std::uint8_t>& inside_out) const;
};

/// Makes the vertices of a contour, one for each edge that the surface crosses.
///
/// The vertex is at the field's zero along the edge. If the ends are at most one spacing apart in k, the field is
/// interpolated linearly between them, else between its values on the two lines. The vertex keeps a distance of 2^-8 of
/// the edge from both ends. On an edge of the heightfield from void to solid, the vertex is halfway between the zeros
/// of both fields, so that cavity and overhang share it.
class EdgeVertices {
public:
    EdgeVertices(const TileLines& lines, const TileFields& fields, VolumeContour& contour_out);

    /// Index of the vertex between two nodes of different sign of a field.
    std::uint32_t crossing(const LineNode& a, const LineNode& b, Field field);
    /// Index of the vertex at a sample of the heightfield.
    std::uint32_t sample(int line) {
        return node({line, lines_.surface[static_cast<std::size_t>(line)]});
    }
    std::uint32_t node(const LineNode& node);

private:
    struct Slot {
        LineNode first, second;
        std::uint32_t vertex = 0;  // index + 1; 0: free
    };
    Slot& find_slot(const LineNode& first, const LineNode& second);
    void grow();
    double fraction(const LineNode& first, const LineNode& second, Field field) const;
    double fraction_of_zero(const LineNode& first, const LineNode& second, Field field) const;
    double value_at(Field field, int line, double z) const;

    const TileLines& lines_;
    const TileFields& fields_;
    VolumeContour& contour_;
    std::vector<Slot> slots_;  // open addressing, a power of two
};

}  // namespace terrane::internal
