// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace terrane {

/// Identifies a vertex (i, i), an edge (i, j) with i < j, or a face (i, kFace) of a shape, stable between calls. Vertex
/// i of a box is at +x where bit 0 of i is set, else at -x; bit 1 is y, bit 2 is z; its faces are -x, +x, -y, +y, -z,
/// +z. Vertices of a hull are indices of vertices(). The ends of a capsule's core are vertices 0 (at -z) and 1, its
/// side is edge (0, 1); a sphere is vertex 0.
struct ShapeFeature {
    static constexpr std::uint32_t kFace = ~std::uint32_t{0};  ///< value of `second` for a face

    std::uint32_t first = 0;   ///< vertex, lower end of an edge, or face
    std::uint32_t second = 0;  ///< the same vertex, upper end of the edge, or kFace
    bool operator==(const ShapeFeature&) const = default;
};

}  // namespace terrane
