// SPDX-License-Identifier: MIT
#pragma once

#include "draw/eye_frame.h"

#include <terrane/render/terrain_renderer.h>

#include <array>
#include <cstdint>

namespace terrane::internal {

/// The uniform block `Frame` of light.glsl, in its std140 layout.
struct FrameUniforms {
    using Vec4 = std::array<float, 4>;
    std::array<float, 16> clip_from_eye{};  ///< column-major
    Vec4 right{}, up{}, forward{};
    Vec4 sun{}, horizon{}, zenith{};
    Vec4 remainder{};
    std::array<std::int32_t, 4> eye_height{};
    Vec4 grid{};
    Vec4 tint{};
    Vec4 noise_phase{};
    Vec4 near{};
};
static_assert(sizeof(FrameUniforms) == 64 + 12 * 16);

/// The uniforms of a view. Depth is reversed (1 near, 0 infinitely far), which keeps the relative precision of float
/// depth from centimetres to the horizon.
FrameUniforms make_frame_uniforms(const RendererSettings& settings, const Lattice& lattice,
                                  const View& view, const EyeFrame& eye);

}  // namespace terrane::internal
