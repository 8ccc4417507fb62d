// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace terrane {

/// Pixels of a texture.
struct TextureImage {
    int width = 0, height = 0;  ///< pixels, 1 to kLargestTextureSide
    std::vector<std::uint8_t>
        rgba;  ///< red, green, blue, opacity of each pixel, row by row from the top
};

/// Largest width and height of a TextureImage, pixels.
inline constexpr int kLargestTextureSide = 16384;

/// What a texture shows at coordinates outside 0 to 1.
enum class TextureWrap : std::uint8_t {
    repeat,  ///< copies of the image
    mirror,  ///< copies, every second one mirrored
    clamp,   ///< the image's border
};

/// A texture of a material. Materials that share an image share its memory on the device.
struct MaterialTexture {
    std::shared_ptr<const TextureImage> image = {};  ///< null: no texture
    TextureWrap wrap_right = TextureWrap::repeat;    ///< along the first texture coordinate
    TextureWrap wrap_up = TextureWrap::repeat;       ///< along the second
};

/// Material of an object's triangles.
///
/// A material without textures, cut and emission is drawn by diffuse light of the vertices' colours. The others are
/// drawn by programs of their own, so that plain materials pay nothing for them.
///
/// Source: glTF 2.0, ISO/IEC 12113:2022, sections 3.9 and B.3 (roughness, metal, alpha cut). Deviation: the sky is
///         reflected as one colour for each height of the direction, without an environment map.
struct MeshMaterial {
    /// Whether back faces are drawn too, as needed for leaves. Normals of back faces are flipped towards the eye.
    bool is_two_sided = false;
    /// Red, green and blue with display gamma, 0 to 255; used if the mesh has no colours.
    std::array<std::uint8_t, 3> colour{160, 160, 160};
    /// Factor of the vertices' colours, with display gamma (sRGB), and opacity.
    MaterialTexture colour_texture = {};
    /// Normals in the frame of the texture coordinates: red right, green up, blue out of the surface, -1 to 1 as 0 to
    /// 255.
    MaterialTexture normal_texture = {};
    float normal_scale = 1.0f;  ///< factor of red and green of normal_texture
    /// Factors of the two numbers below: green of roughness, blue of metal.
    MaterialTexture roughness_metal_texture = {};
    float roughness = 1.0f;  ///< 0: a mirror, 1: matt
    float metal = 0.0f;      ///< 1: a metal, whose colour is that of its reflections; 0: no metal
    /// Emitted radiance, linear, 0 to 1e6; white paper in the sun reflects about 2.
    std::array<float, 3> emission{0.0f, 0.0f, 0.0f};
    /// Pixels with less opacity than this are not drawn, and cast no shadows; absent: opacity is ignored.
    std::optional<float> alpha_cutoff = {};
};

}  // namespace terrane
