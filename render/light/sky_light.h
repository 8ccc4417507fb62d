// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "light/atmosphere.h"

#include <terrane/render/terrain_renderer.h>

#include <array>
#include <cstddef>

namespace terrane::internal {

/// Exposed daylight at sea level, for a sun and an amount of aerosols.
struct Daylight {
    /// Factor of radiances per unit of the sun's irradiance: the exposure.
    double exposure = 1.0;
    /// Exposed light of a white diffuse surface by the sky, facing up, sideways and down.
    Rgb up = Rgb::Zero(), side = Rgb::Zero(), down = Rgb::Zero();
    /// Exposed light of a white diffuse surface that faces the sun above the air; 0 when the sun is below the horizon.
    Rgb sun = Rgb::Zero();
    /// Optical depth from sea level to the sun of molecules, of aerosols and of ozone.
    Rgb rayleigh_depth = Rgb::Zero(), ozone_depth = Rgb::Zero();
    double aerosol_depth = 0.0;
};

/// @param stops added to the exposure, powers of two
Daylight make_daylight(const Atmosphere& atmosphere, double sun_sine, double stops);

/// The sky on the device: maps around the eye for atmosphere.glsl, and the light of sun and sky.
///
/// Maps are computed for fixed altitudes, the nearest below and above the eye's, and interpolated: the picture depends
/// only on the eye's place.
class SkyLight {
public:
    /// @param settings with an atmosphere
    explicit SkyLight(const RendererSettings& settings);

    /// Uploads what depends on the eye's altitude, metres. Cost: 0.1 ms where it has changed, 20 ms once for each step
    /// of the fixed altitudes.
    void prepare(double eye_altitude);
    /// Binds the uniform block 6 and texture units 10 and 11.
    void bind() const;

    /// Device memory.
    std::size_t bytes() const;

private:
    const SkyMaps& maps_at(int step);

    Atmosphere atmosphere_;
    Eigen::Vector3d sun_;  // unit
    Daylight daylight_;
    struct Slot {
        int step = -1;
        SkyMaps maps;
    };
    std::array<Slot, 2> slots_;  // by step modulo 2
    double altitude_ = -1.0;     // of the maps on the device
    std::vector<float> mixed_;
    GlTexture sky_map_, air_map_;
    GlBuffer block_;
};

}  // namespace terrane::internal
