// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/lattice.h>

#include <array>
#include <cstdint>

/// The triangles of HeightSource's bounds, by lattice indices.
namespace terrane::internal {

using LatticeTriangle = std::array<LatticePoint, 3>;

/// The two triangles of a square of lattice points of side `side`, cut between its corners of even
/// index sum.
inline std::array<LatticeTriangle, 2> cut_square(const LatticePoint& sw, std::int64_t side) {
    const LatticePoint se{sw.x + side, sw.y}, nw{sw.x, sw.y + side}, ne{sw.x + side, sw.y + side};
    if (cut_to_north_east(sw.x / side, sw.y / side)) return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

inline bool is_odd(std::int64_t index) { return (index & 1) != 0; }

/// The diamond of a vertex of spacing s: the first two corners of both triangles are the vertex's ends.
inline std::array<LatticeTriangle, 2> diamond(const LatticePoint& vertex, std::int64_t s) {
    const auto at = [&](std::int64_t dx, std::int64_t dy) {
        return LatticePoint{vertex.x + dx * s, vertex.y + dy * s};
    };
    if (is_odd(vertex.x / s) && is_odd(vertex.y / s)) {
        const bool rises = cut_to_north_east((vertex.x - s) / (2 * s), (vertex.y - s) / (2 * s));
        const std::int64_t d = rises ? 1 : -1;  // the diagonal goes from (-1, -d) to (1, d)
        return {{{at(-1, -d), at(1, d), at(-1, d)}, {at(-1, -d), at(1, d), at(1, -d)}}};
    }
    if (is_odd(vertex.x / s)) {
        return {{{at(-1, 0), at(1, 0), at(0, 1)}, {at(-1, 0), at(1, 0), at(0, -1)}}};
    }
    return {{{at(0, -1), at(0, 1), at(1, 0)}, {at(0, -1), at(0, 1), at(-1, 0)}}};
}

}  // namespace terrane::internal
