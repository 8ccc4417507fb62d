// SPDX-License-Identifier: MIT
#include "lod/solid_pins.h"

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

/// Location of a triangle in a square: the cell, and the half of the cell.
struct PlaceInSquare {
    int column, row;
    bool is_north;
};
constexpr std::array<PlaceInSquare, kSquareTriangles> kPlaces{{{0, 0, false},
                                                               {1, 0, false},
                                                               {1, 0, true},
                                                               {1, 1, false},
                                                               {1, 1, true},
                                                               {0, 1, true},
                                                               {0, 1, false},
                                                               {0, 0, true}}};

}  // namespace

ReplacedTriangles::ReplacedTriangles(const SolidSurface& solid)
    : count(solid.triangles().replaced.size()) {
    if (count == 0) return;
    for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
        const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
        OfArea made{.area = area};
        for (int square = 0; square < kAreaSquares * kAreaSquares; ++square) {
            const int column = west + 2 * (square % kAreaSquares);
            const int row = south + 2 * (square / kAreaSquares);
            for (std::size_t i = 0; i < kSquareTriangles; ++i) {
                const PlaceInSquare& place = kPlaces[i];
                if (solid.is_replaced(cell_index(column + place.column, row + place.row),
                                      place.is_north)) {
                    made.squares[i] |= std::uint64_t{1} << square;
                }
            }
        }
        if (made.any() != 0) areas.push_back(made);
    }
}

const ReplacedTriangles::OfArea* ReplacedTriangles::find(int area) const {
    const auto found = std::ranges::lower_bound(areas, area, {}, &OfArea::area);
    return found != areas.end() && found->area == area ? &*found : nullptr;
}

namespace {

// Half sides of the squares around vertices, in spacings.
constexpr std::int64_t kCentreReach = 3, kMidpointReach = 2;

}  // namespace

SolidPins::Rect SolidPins::around(LatticePoint point, std::int64_t half) {
    return {point.x - half, point.y - half, point.x + half, point.y + half};
}

SolidPins::Rect SolidPins::reach_of(const Chunk& chunk) {
    // a root has vertices of coarser spacings, up to half of its side
    const std::int64_t spacing = chunk.key.level == 0 ? kChunkSquares * chunk.step : chunk.step;
    const std::int64_t reach = kCentreReach * spacing;
    const std::int64_t side = kChunkCells * chunk.step;
    return {chunk.corner.x - reach, chunk.corner.y - reach, chunk.corner.x + side + reach,
            chunk.corner.y + side + reach};
}

SolidPins::Rect SolidPins::reach_of(const Chunk& chunk, int area) {
    const std::int64_t reach = kCentreReach * chunk.step;
    const std::int64_t side = kAreaCells * chunk.step;
    const std::int64_t west = chunk.corner.x + area % kChunkAreas * side;
    const std::int64_t south = chunk.corner.y + area / kChunkAreas * side;
    return {west - reach, south - reach, west + side + reach, south + side + reach};
}

void SolidPins::add(const Chunk& chunk, const ReplacedTriangles& replaced, float key) {
    if (replaced.areas.empty()) return;
    Group group;
    group.first = pins_.size();
    group.key = key;
    for (const ReplacedTriangles::OfArea& of_area : replaced.areas) {
        // rows and columns of the squares with replaced triangles
        const std::uint64_t squares = of_area.any();
        std::uint64_t columns = 0;
        for (int row = 0; row < kAreaSquares; ++row) {
            columns |= squares >> (row * kAreaSquares) & 0xffu;
        }
        const int south = std::countr_zero(squares) / kAreaSquares;
        const int north = (63 - std::countl_zero(squares)) / kAreaSquares + 1;
        const int west = std::countr_zero(columns);
        const int east = 64 - std::countl_zero(columns);
        const std::int64_t corner_x =
            chunk.corner.x + of_area.area % kChunkAreas * kAreaCells * chunk.step;
        const std::int64_t corner_y =
            chunk.corner.y + of_area.area / kChunkAreas * kAreaCells * chunk.step;
        const std::int64_t side = 2 * chunk.step;
        pins_.push_back({corner_x + west * side, corner_y + south * side, corner_x + east * side,
                         corner_y + north * side});
    }
    group.end = pins_.size();
    group.all = pins_[group.first];
    for (std::size_t i = group.first; i < group.end; ++i) {
        group.all = {
            std::min(group.all.west, pins_[i].west), std::min(group.all.south, pins_[i].south),
            std::max(group.all.east, pins_[i].east), std::max(group.all.north, pins_[i].north)};
    }
    groups_.push_back(group);
}

// Calls use(pin, key) for the pins that overlap a rectangle.
template <typename Use>
void SolidPins::visit(const Rect& rect, const Use& use) const {
    for (const Group& group : groups_) {
        if (!group.all.overlaps(rect)) continue;
        for (std::size_t i = group.first; i < group.end; ++i) {
            if (pins_[i].overlaps(rect)) use(pins_[i], group.key);
        }
    }
}

bool SolidPins::opens(const Chunk& chunk, float floor) const {
    bool is_open = false;
    visit(reach_of(chunk), [&](const Rect&, float key) { is_open = is_open || key < floor; });
    return is_open;
}

bool SolidPins::opens(const Chunk& chunk, int area, float floor) const {
    bool is_open = false;
    visit(reach_of(chunk, area), [&](const Rect&, float key) { is_open = is_open || key < floor; });
    return is_open;
}

void SolidPins::lower(const Chunk& chunk, int area, AreaVertices::Kind kind, float* keys) const {
    visit(reach_of(chunk, area), [&](const Rect& pin, float key) {
        const int west = area % kChunkAreas * kAreaCells + (kind == AreaVertices::along_y ? 0 : 1);
        const int south = area / kChunkAreas * kAreaCells + (kind == AreaVertices::along_x ? 0 : 1);
        const std::int64_t reach =
            (kind == AreaVertices::centre ? kCentreReach : kMidpointReach) * chunk.step;
        std::array<bool, kAreaSquares> is_column_near{};
        for (int i = 0; i < kAreaSquares; ++i) {
            const std::int64_t x = chunk.corner.x + (west + 2 * i) * chunk.step;
            is_column_near[static_cast<std::size_t>(i)] =
                x + reach >= pin.west && x - reach <= pin.east;
        }
        for (int row = 0; row < kAreaSquares; ++row) {
            const std::int64_t y = chunk.corner.y + (south + 2 * row) * chunk.step;
            if (y + reach < pin.south || y - reach > pin.north) continue;
            for (int i = 0; i < kAreaSquares; ++i) {
                if (!is_column_near[static_cast<std::size_t>(i)]) continue;
                float& of_vertex = keys[row * kAreaSquares + i];
                of_vertex = std::min(of_vertex, key);
            }
        }
    });
}

float SolidPins::lowered(const Chunk& chunk, int column, int row, int stride, bool is_centre,
                         float key) const {
    const LatticePoint point{chunk.corner.x + column * chunk.step,
                             chunk.corner.y + row * chunk.step};
    const std::int64_t reach = (is_centre ? kCentreReach : kMidpointReach) * stride * chunk.step;
    visit(around(point, reach), [&](const Rect&, float of_pin) { key = std::min(key, of_pin); });
    return key;
}

}  // namespace terrane::internal
