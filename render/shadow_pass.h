// SPDX-License-Identifier: MIT
#pragma once

#include "draw/frame_uniforms.h"
#include "shadow/shadow_maps.h"

#include <array>
#include <memory>

namespace terrane::internal {

/// The shadow maps of a renderer, and the uniforms of the frame for each: positions are those of the view, seen from
/// the sun.
class ShadowPass {
public:
    /// @param settings with shadow_distance above 0
    explicit ShadowPass(const RendererSettings& settings);

    /// Places the maps around the receivers in a view.
    void prepare(const View& view);
    /// Of the last prepare(), the nearest first.
    std::span<const SunCascade, kCascades> cascades() const { return cascades_; }

    /// Draws the casters of each cascade with draw(cascade number), then binds the maps for lit_at(). Changes the bound
    /// uniforms of the frame.
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
