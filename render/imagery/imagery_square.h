// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/imagery_source.h>
#include <terrane/terrain/lattice.h>

#include <array>
#include <compare>
#include <cstdint>
#include <vector>

namespace terrane::internal {

// Imagery is paged by squares of the quadtree whose roots are the world's root squares: down to the finest level of
// chunks their squares are those of chunks, and below as long as the imagery is finer.

/// Texels along the side of a square's texture. kImageryBorder of them at each edge show the neighbours, so that the
/// coarsest mipmap still has one border texel.
inline constexpr int kImageryTexels = 256;
inline constexpr int kImageryBorder = 4;
inline constexpr int kImageryContent = kImageryTexels - 2 * kImageryBorder;
inline constexpr int kImageryMipmaps = 3;
/// Finest level of the quadtree.
inline constexpr int kMostImageryLevel = 24;

/// A square of a level: x and y count squares of the level from the lattice's origin.
struct ImagerySquare {
    int level = 0;
    std::int64_t y = 0, x = 0;
    friend constexpr auto operator<=>(const ImagerySquare&, const ImagerySquare&) = default;
};

/// Side of the squares of a level, metres.
double imagery_side(const Lattice& lattice, int level);
/// Where a square is, without and with its border, world metres.
WorldRect imagery_rect(const Lattice& lattice, const ImagerySquare& square);
WorldRect imagery_rect_with_border(const Lattice& lattice, const ImagerySquare& square);

/// The mipmaps of a square, the finest first: colours times opacity.
struct ImageryTexture {
    std::array<std::vector<ImageryTexel>, kImageryMipmaps> mipmaps;
};

/// Multiplies colours by opacity, and averages 2 x 2 texels for each coarser mipmap.
///
/// @param texels [kImageryTexels * kImageryTexels] of a source
ImageryTexture make_imagery_texture(std::vector<ImageryTexel> texels);

}  // namespace terrane::internal
