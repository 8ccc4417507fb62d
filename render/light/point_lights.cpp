// SPDX-License-Identifier: MIT
#include "light/point_lights.h"

#include <terrane/base/text.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kFarthestLight = 1e12;  // metres from the origin along an axis
constexpr double kMostIntensity = 1e9;
constexpr double kMostLightRange = 1e6;  // metres

/// The uniform block `PointLights` of point_light.glsl, in its std140 layout; zeros for lights that are absent.
struct PointLightUniforms {
    std::array<std::array<float, 4>, kMostPointLights> places{}, intensities{};
};

}  // namespace

Result<void> check_point_lights(std::span<const PointLight> lights) {
    const auto refuse = [](const std::string& message) -> Result<void> {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (lights.size() > kMostPointLights) {
        return refuse("there can be " + std::to_string(kMostPointLights) + " point lights, got " +
                      std::to_string(lights.size()));
    }
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const PointLight& light = lights[i];
        const std::string name = "point light " + std::to_string(i);
        for (const double part : light.position_world) {
            if (!(std::abs(part) <= kFarthestLight))
                return refuse(name + " must be within 1e12 m of the origin, got " +
                              number_text(part));
        }
        for (const double part : light.intensity) {
            if (!(part >= 0.0 && part <= kMostIntensity))
                return refuse(name + " must have an intensity of 0 to 1e9, got " +
                              number_text(part));
        }
        if (!(light.range > 0.0 && light.range <= kMostLightRange))
            return refuse(name + " must have a range above 0 to 1e6 m, got " +
                          number_text(light.range));
    }
    return {};
}

void PointLights::set(std::span<const PointLight> lights) {
    lights_.assign(lights.begin(), lights.end());
    if (lights.empty() || uniforms_.name() != 0) return;
    uniforms_ = make_buffer();
    glNamedBufferStorage(uniforms_.name(), sizeof(PointLightUniforms), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
}

void PointLights::bind(const WorldPos& eye_world) {
    PointLightUniforms uniforms;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        const PointLight& light = lights_[i];
        const Eigen::Vector3f place = to_local(light.position_world, eye_world);
        const Eigen::Vector3f intensity = light.intensity.cast<float>();
        uniforms.places[i] = {place.x(), place.y(), place.z(),
                              static_cast<float>(1.0 / (light.range * light.range))};
        uniforms.intensities[i] = {intensity.x(), intensity.y(), intensity.z(), 0.0f};
    }
    glNamedBufferSubData(uniforms_.name(), 0, sizeof(uniforms), &uniforms);
    constexpr GLuint kBlock = 4;
    glBindBufferBase(GL_UNIFORM_BUFFER, kBlock, uniforms_.name());
}

}  // namespace terrane::internal
