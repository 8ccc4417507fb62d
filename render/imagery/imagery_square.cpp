// SPDX-License-Identifier: MIT
#include "imagery/imagery_square.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace terrane::internal {

double imagery_side(const Lattice& lattice, int level) {
    return std::ldexp(lattice.root_size(), -level);
}

WorldRect imagery_rect(const Lattice& lattice, const ImagerySquare& square) {
    const double side = imagery_side(lattice, square.level);
    const double west = lattice.origin_x + side * static_cast<double>(square.x);
    const double south = lattice.origin_y + side * static_cast<double>(square.y);
    return {west, south, west + side, south + side};
}

WorldRect imagery_rect_with_border(const Lattice& lattice, const ImagerySquare& square) {
    const WorldRect rect = imagery_rect(lattice, square);
    const double border = (rect.east - rect.west) * kImageryBorder / kImageryContent;
    return {rect.west - border, rect.south - border, rect.east + border, rect.north + border};
}

ImageryTexture make_imagery_texture(std::vector<ImageryTexel> texels) {
    for (ImageryTexel& texel : texels) {
        for (std::size_t channel = 0; channel < 3; ++channel)
            texel[channel] = static_cast<std::uint8_t>((texel[channel] * texel[3] + 127) / 255);
    }
    ImageryTexture made;
    made.mipmaps[0] = std::move(texels);
    for (std::size_t mipmap = 1; mipmap < kImageryMipmaps; ++mipmap) {
        const std::vector<ImageryTexel>& finer = made.mipmaps[mipmap - 1];
        const std::size_t side = std::size_t{kImageryTexels} >> mipmap;
        std::vector<ImageryTexel>& coarser = made.mipmaps[mipmap];
        coarser.resize(side * side);
        for (std::size_t row = 0; row < side; ++row) {
            for (std::size_t column = 0; column < side; ++column) {
                const std::size_t first = 2 * row * 2 * side + 2 * column;
                for (std::size_t channel = 0; channel < 4; ++channel) {
                    const int sum = finer[first][channel] + finer[first + 1][channel] +
                                    finer[first + 2 * side][channel] +
                                    finer[first + 2 * side + 1][channel];
                    coarser[row * side + column][channel] =
                        static_cast<std::uint8_t>((sum + 2) / 4);
                }
            }
        }
    }
    return made;
}

}  // namespace terrane::internal
