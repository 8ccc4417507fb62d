// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <terrane/render/terrain_renderer.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// Fails with invalid_argument, naming the light, for too many of them and for numbers out of range.
Result<void> check_point_lights(std::span<const PointLight> lights);

/// The point lights of a renderer, on the device relative to the eye.
class PointLights {
public:
    /// Requires that check_point_lights() accepts the lights.
    void set(std::span<const PointLight> lights);
    bool is_empty() const { return lights_.empty(); }

    /// Uploads the lights of a frame, and binds them to uniform block 4 for point_light().
    void bind(const WorldPos& eye_world);

private:
    std::vector<PointLight> lights_;
    GlBuffer uniforms_;
};

}  // namespace terrane::internal
