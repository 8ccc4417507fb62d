// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "light/frame_uniforms.h"

#include <terrane/base/math.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>

namespace terrane::internal {

/// Number of shadow cascades. Each reaches kCascadeRatio times as far as the previous one, the last to the shadow
/// distance.
inline constexpr int kCascades = 3;
inline constexpr double kCascadeRatio = 4.0;

/// A square shadow map along the sun's direction that covers the visible ground within a distance of the eye.
///
/// Side and orientation do not depend on the view direction, and the map moves by whole texels: its texels stay fixed
/// to the ground, so that shadow edges do not shimmer.
struct SunCascade {
    Eigen::Matrix3d axes;    ///< rows: right, up and towards the sun, world axes
    Eigen::Vector3d centre;  ///< along these axes, metres
    double half_side = 0.0;  ///< half the side, and half the range of depths, metres
    double reach = 0.0;      ///< largest distance of its receivers from the eye, metres

    /// Whether a caster with this bounding volume can cast a shadow into the map. Conservative: the map's volume is
    /// extended to the sun.
    bool meets(const Aabb& box_world) const;
    bool meets(const BoundingSphere& sphere_world) const;

    /// Vector from the eye to the centre, along `axes`, metres.
    Eigen::Vector3d centre_from(const WorldPos& eye_world) const;
    /// Maps positions relative to the eye into the map, column-major. Depth is 1 nearest to the sun and 0 farthest.
    std::array<float, 16> clip_from_eye(const WorldPos& eye_world) const;
};

/// The cascades of a view, nearest first.
///
/// @param sun_direction towards the sun, finite and not zero
/// @param distance      largest distance of shadows from the eye, metres, > 0
/// @param texels        along the side of each map
std::array<SunCascade, kCascades> make_sun_cascades(const View& view,
                                                    const Eigen::Vector3d& sun_direction,
                                                    double distance, int texels);

/// Least and most texels along the side of a shadow map.
inline constexpr int kLeastShadowTexels = 256;
inline constexpr int kMostShadowTexels = 8192;

/// Depths of a scene seen from the sun, one layer of a texture array per cascade.
class ShadowMaps {
public:
    /// Requires texels in kLeastShadowTexels to kMostShadowTexels.
    ///
    /// @param sun_radius angular, of penumbrae, radians; 0: edges as sharp as the texels
    ShadowMaps(int texels, double sun_radius);

    int texels() const { return texels_; }

    /// Binds the map of a cascade as the target, sets viewport and state for casters, and clears it. The frame's
    /// uniforms must contain the cascade's clip_from_eye.
    void begin_cascade(int cascade) const;
    /// State for the ground as a caster: only faces that point away from the sun are drawn.
    static void begin_ground();
    /// Returns to the state of begin_cascade().
    static void end_ground();
    /// Resets the state set by begin_cascade().
    void end_cascades() const;

    /// Uploads the position of each cascade, and binds maps (texture unit 6; without comparison, unit 14) and positions
    /// (uniform block 2) for lit_at().
    void bind(std::span<const SunCascade, kCascades> cascades, const WorldPos& eye_world) const;

    /// Device memory.
    std::size_t bytes() const;

private:
    int texels_;
    double sun_radius_;
    GlTexture depths_;
    GlSampler plain_;  // of penumbrae: reads depths without comparison
    GlBuffer places_;
    std::array<GlFramebuffer, kCascades> targets_;
};

/// The shadow maps of a renderer, with frame uniforms for each: positions remain relative to the view's eye, the
/// projection is the sun's.
class ShadowPass {
public:
    /// @param settings with shadow_distance above 0
    explicit ShadowPass(const RendererSettings& settings);

    /// Fits the maps to the receivers in a view.
    void prepare(const View& view);
    /// The cascades of the last prepare(), nearest first.
    std::span<const SunCascade, kCascades> cascades() const { return cascades_; }

    /// Calls draw_casters(cascade number) for each cascade, with its map as the target and its uniforms bound. Then
    /// binds the maps for lit_at(); the uniforms of the last cascade stay bound.
    template <class Draw>
    void draw(const FrameUniforms& of_view, const View& view, const Draw& draw_casters) const {
        for (std::size_t cascade = 0; cascade < kCascades; ++cascade) {
            bind_uniforms(cascade, of_view, view);
            maps_.begin_cascade(static_cast<int>(cascade));
            draw_casters(cascade);
        }
        maps_.end_cascades();
        maps_.bind(cascades_, view.eye_world);
    }

    std::size_t bytes() const { return maps_.bytes(); }

private:
    void bind_uniforms(std::size_t cascade, const FrameUniforms& of_view, const View& view) const;

    Eigen::Vector3d sun_direction_;
    double distance_;
    ShadowMaps maps_;
    std::array<GlBuffer, kCascades> uniforms_;
    std::array<SunCascade, kCascades> cascades_;
};

}  // namespace terrane::internal
