// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/material.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// What the numbers of a texture mean.
enum class TextureUse : std::uint8_t {
    colour,   ///< display colours (sRGB) and opacity
    blended,  ///< the same, where colours count as much as they are opaque
    data,     ///< normals, roughness
};

/// The number of mipmaps of an image, down to one pixel.
int mipmap_count(int width, int height);
/// Bytes on the device of the mipmaps from `first` on; 0 is the image itself.
std::size_t mipmap_bytes(int width, int height, int first);

/// The mipmaps of an image, each a mean of the one before over the area of its pixels, from `first` on.
///
/// Colours are averaged as linear light, weighted by opacity if they are blended or have a cutoff. With a cutoff
/// opacity is scaled so that each mipmap has the same share of pixels with at least the cutoff as the image: otherwise
/// leaves become thin, and vanish, with the distance.
///
/// Source: I. Castano. Computing Alpha Mipmaps. The Witness blog, 2010 (the share of pixels kept). Deviation: the scale
///         is computed from the order of the opacities, not by bisection
std::vector<TextureImage> make_mipmaps(const TextureImage& image, TextureUse use,
                                       std::optional<float> cutoff, int first);

/// A texture that wants memory.
struct TextureDemand {
    int width = 0, height = 0;     ///< of the image
    int least_first = 0;           ///< the first mipmap that the device can hold
    std::uint64_t last_drawn = 0;  ///< number of the last frame that showed it
};

/// [textures] the first mipmap of each to keep, so that all fit into `limit` bytes: see
/// RendererSettings::texture_bytes. Depends on the arguments only.
std::vector<int> choose_first_mipmaps(std::span<const TextureDemand> textures, std::size_t limit);

}  // namespace terrane::internal
