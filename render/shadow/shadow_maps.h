// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "shadow/sun_cascades.h"

#include <array>
#include <cstddef>
#include <span>

namespace terrane::internal {

/// Least and most texels along the side of a shadow map.
inline constexpr int kLeastShadowTexels = 256;
inline constexpr int kMostShadowTexels = 8192;

/// Depths of a scene as the sun sees it, one layer of a texture array for each cascade.
class ShadowMaps {
public:
    /// Requires texels in kLeastShadowTexels to kMostShadowTexels.
    explicit ShadowMaps(int texels);

    int texels() const { return texels_; }

    /// Binds the map of a cascade as the target, sets viewport and state for casters, and clears it. The uniforms of
    /// the frame must have the cascade's clip_from_eye.
    void begin_cascade(int cascade) const;
    /// Resets the state that begin_cascade() has set.
    void end_cascades() const;

    /// Uploads the place of each cascade, and binds maps (texture unit 6) and places (uniform block 2) for lit_at().
    void bind(std::span<const SunCascade, kCascades> cascades, const WorldPos& eye_world) const;

    /// On the device.
    std::size_t bytes() const;

private:
    int texels_;
    GlTexture depths_;
    GlBuffer places_;
    std::array<GlFramebuffer, kCascades> targets_;
};

}  // namespace terrane::internal
