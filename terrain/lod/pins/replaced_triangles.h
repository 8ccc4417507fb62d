// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/open_chunk.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// The two halves of each side of a square of 2 x 2 cells, counter-clockwise from the south-western corner: each is the
/// triangle of a corner, a midpoint and the centre, where the square's centre and that midpoint are active. Index:
/// 2 * side + half.
inline constexpr std::size_t kSquareTriangles = 8;

/// The triangles of a chunk's heightfield that its solid surface replaces, by areas and squares.
struct ReplacedTriangles {
    struct OfArea {
        int area = 0;
        /// Bit i: the triangle of square i is replaced.
        std::array<std::uint64_t, kSquareTriangles> squares{};
        std::uint64_t any() const {
            std::uint64_t bits = 0;
            for (const std::uint64_t of_triangle : squares) bits |= of_triangle;
            return bits;
        }
    };
    std::vector<OfArea> areas;  ///< ascending, those with replaced triangles only
    std::size_t count = 0;

    explicit ReplacedTriangles(const SolidSurface& solid);

    /// Null if nothing of the area is replaced.
    const OfArea* find(int area) const;
};

}  // namespace terrane::internal
