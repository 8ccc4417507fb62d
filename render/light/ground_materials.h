// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "light/frame_uniforms.h"

#include <terrane/render/terrain_renderer.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::internal {

/// Turf, shrub, soil, scree, rock and snow.
inline constexpr int kMaterials = static_cast<int>(kFlatMaterials.size());
/// Layers of the texture: the materials, and noise for variation over large distances.
inline constexpr int kMaterialLayers = kMaterials + 1;
inline constexpr int kMaterialTexels = 512;  ///< along the side of a layer
/// Scales at which a layer covers the ground, each eight times as large as the previous one.
inline constexpr int kMaterialScales = 5;

/// A layer of a palette's materials, periodic: [kMaterialTexels * kMaterialTexels * 4], row by row. Red and green are
/// slopes along x and y, blue is the tone, alpha the height, each with mean 1/2 and a standard deviation of 0.2 before
/// it is clamped. The last layer has noise in all channels.
std::vector<std::uint8_t> make_material_layer(GroundPalette palette, int layer);

/// The uniform block `Ground` of ground_material.glsl, in its std140 layout.
struct MaterialUniforms {
    using Vec4 = std::array<float, 4>;
    std::array<Vec4, kMaterials> dark{}, light{};
    Vec4 lines{}, cover{};
    std::array<Vec4, kMaterialScales> place{};
    std::array<std::array<std::int32_t, 4>, kMaterialScales> cell{};
};
static_assert(sizeof(MaterialUniforms) == 16 * (2 * kMaterials + 2 + 2 * kMaterialScales));

/// The uniforms of settings with a ground look, without positions.
///
/// @param is_flat whether materials have the colours of kFlatMaterials, without detail
MaterialUniforms make_material_uniforms(const RendererSettings& settings, bool is_flat = false);
/// Sets the positions. They are computed from the eye's integers: detail is as precise at any distance from the origin.
void set_material_places(const Lattice& lattice, const EyeFrame& eye, MaterialUniforms& uniforms);

/// The materials of the ground on the device, for ground_material.glsl.
class GroundMaterials {
public:
    /// Makes the texture.
    ///
    /// @param settings   valid, with a ground look
    /// @param anisotropy largest of the texture's filter, 1 to 16
    GroundMaterials(const RendererSettings& settings, int anisotropy);

    /// Shows materials in flat colours, or as their palette has them.
    ///
    /// @param settings of the constructor
    void set_flat(const RendererSettings& settings, bool is_flat) {
        uniforms_ = make_material_uniforms(settings, is_flat);
    }

    /// Writes the uniform block. Call once a frame, before bind().
    void prepare(const Lattice& lattice, const EyeFrame& eye);
    /// Binds the texture to unit 12, and the uniform block to binding 5.
    void bind() const;

    std::size_t bytes() const;

private:
    MaterialUniforms uniforms_;
    GlTexture layers_;
    GlBuffer buffer_;
};

}  // namespace terrane::internal
