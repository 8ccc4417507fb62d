// SPDX-License-Identifier: MIT
#pragma once

#include "lod/screen_error.h"

#include <terrane/terrain/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// The eight triangles of a square of 2 x 2 cells, two per side, counter-clockwise from the south-western corner. The
/// vertices of each are the square's centre, a midpoint of a side and a corner; it exists if centre and midpoint are
/// active. Index: 2 * side + half.
inline constexpr std::size_t kSquareTriangles = 8;

/// The triangles of a chunk's heightfield that its solid surface replaces, by areas and squares.
struct ReplacedTriangles {
    struct OfArea {
        int area = 0;
        /// [triangle of a square] bit i: this triangle of square i is replaced.
        std::array<std::uint64_t, kSquareTriangles> squares{};
        std::uint64_t any() const {
            std::uint64_t bits = 0;
            for (const std::uint64_t of_triangle : squares) bits |= of_triangle;
            return bits;
        }
    };
    std::vector<OfArea> areas;  ///< only areas with replaced triangles, ascending
    std::size_t count = 0;

    explicit ReplacedTriangles(const SolidSurface& solid);

    /// Null if no triangle of the area is replaced.
    const OfArea* find(int area) const;
};

/// Regions where volumes require the heightfield at its finest level. A *pin* is a rectangle of lattice points around
/// replaced triangles, with a key that follows from the screen error of omitting the volumes.
///
/// The key of a vertex is lowered to the key of every pin that touches the square around the vertex. The square extends
/// three spacings to each side of a centre, and two of a midpoint. Squares are nested from parent to child (see
/// terrain/source/fractal/detail_heights.cpp), so keys stay monotone, and all ancestors of a pinned vertex are pinned.
class SolidPins {
public:
    void clear() {
        pins_.clear();
        groups_.clear();
    }
    /// Pins the replaced triangles of a chunk: a group with a pin for each of its areas.
    void add(const Chunk& chunk, const ReplacedTriangles& replaced, float key);
    bool is_empty() const { return groups_.empty(); }

    /// A rectangle of lattice points, edges included.
    struct Rect {
        std::int64_t west = 0, south = 0, east = 0, north = 0;
        bool overlaps(const Rect& other) const {
            return west <= other.east && east >= other.west && south <= other.north &&
                   north >= other.south;
        }
    };
    /// The pins of a chunk, which have one key.
    struct Group {
        Rect all;
        std::size_t first = 0, end = 0;  ///< in pins()
        float key = 0.0f;
    };
    std::span<const Group> groups() const { return groups_; }
    std::span<const Rect> pins() const { return pins_; }

    /// Whether a chunk (or one of its areas) must be opened for a pin: whether any pin whose key is below `floor` is
    /// within reach of its vertices. Conservative.
    bool opens(const Chunk& chunk, float floor) const;
    bool opens(const Chunk& chunk, int area, float floor) const;
    /// Lowers the keys of an area.
    /// @param keys [AreaVertices::kSquares]
    void lower(const Chunk& chunk, int area, AreaVertices::Kind kind, float* keys) const;
    /// The lowered key of one vertex.
    /// @param column, row its sample
    /// @param stride      its spacing in samples
    float lowered(const Chunk& chunk, int column, int row, int stride, bool is_centre,
                  float key) const;

private:
    static Rect around(LatticePoint point, std::int64_t half);
    static Rect reach_of(const Chunk& chunk);
    static Rect reach_of(const Chunk& chunk, int area);
    template <typename Use>
    void visit(const Rect& rect, const Use& use) const;

    std::vector<Rect> pins_;
    std::vector<Group> groups_;
};

}  // namespace terrane::internal
