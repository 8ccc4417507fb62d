// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstdint>

namespace terrane::internal {

/// An integer written as high * 2^bits + low, with low in [-2^(bits - 1), 2^(bits - 1)), because shaders have no 64-bit
/// integers. Near zero the high part is 0, and the conversion to float is exact.
struct SplitInteger {
    std::int32_t high = 0;
    std::int32_t low = 0;
};
SplitInteger split(std::int64_t value, int bits);

/// Bits of the low part of lattice indices and heights in quanta; the same constant as in the shaders.
inline constexpr int kIndexBits = 20;
inline constexpr int kHeightBits = 16;

/// The eye's position as integers, those of the nearest lattice point and height in quanta, and a remainder.
///
/// A sample is displayed at float(sample's integers - eye's integers) * step - remainder, relative to the eye,
/// whichever chunk it is drawn with; the step is the spacing or the quantum. Hence the shared edges of chunks of any
/// levels are bit-identical, and nothing jitters far from the origin.
struct EyeFrame {
    std::int64_t x = 0, y = 0;  ///< lattice index
    std::int64_t height = 0;    ///< quanta
    double remainder_x = 0.0, remainder_y = 0.0,
           remainder_z = 0.0;  ///< eye minus lattice point and quantum, metres
};

/// Fails with invalid_argument if the eye is so far from the origin that its integers do not fit.
Result<EyeFrame> make_eye_frame(const Lattice& lattice, const WorldPos& eye_world);

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
    Vec4 waves{};
};
static_assert(sizeof(FrameUniforms) == 64 + 13 * 16);

/// The uniforms of a view. Depth is reversed (1 near, 0 infinitely far), which keeps the relative precision of float
/// depth from centimetres to the horizon.
///
/// @param time of the waves, seconds
FrameUniforms make_frame_uniforms(const RendererSettings& settings, const Lattice& lattice,
                                  const View& view, const EyeFrame& eye, double time = 0.0);

}  // namespace terrane::internal
