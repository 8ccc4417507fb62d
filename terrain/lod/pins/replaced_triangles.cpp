// SPDX-License-Identifier: MIT
#include "lod/pins/replaced_triangles.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// Where a triangle of a square is: the cell in the square, and which half of that.
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

}  // namespace terrane::internal
