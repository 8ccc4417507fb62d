// SPDX-License-Identifier: MIT
// Source: G. Krawczyk, K. Myszkowski, H.-P. Seidel. Perceptual Effects in Real-time Tone Mapping. SCCG 2005 (key
//         value).
#include "light/sky_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kPi = std::numbers::pi;

// Illuminance by the sun above the air, lx, and the least of the scene, of a night without a moon.
constexpr double kSunIlluminance = 128'000.0;
constexpr double kNightIlluminance = 1e-3;
// Reflectance that the exposure is set for, and exposed light of a white surface per key value: level ground at noon
// has about 1.3.
constexpr double kMiddleGrey = 0.2;
constexpr double kLightPerKey = 2.1;
// Sine of the elevation at which the sky over the horizon is measured for the exposure, and weight of its light.
constexpr double kHorizonSine = 0.09, kHorizonShare = 1.0;
// Largest part of the sun's disc in a picture: brighter, it would lose its colour.
constexpr double kMostDisc = 8.0;

// Altitudes of the maps: 0, 50, 125 m and so on, up to 2500 km.
constexpr double kFirstAltitude = 100.0, kAltitudeRatio = 1.5;
constexpr int kAltitudes = 26;
double altitude_of(int step) { return kFirstAltitude * (std::pow(kAltitudeRatio, step) - 1.0); }

double luminance(const Rgb& light) {
    return 0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2];
}

// The uniform block `Air` of atmosphere.glsl, in its std140 layout.
struct AirBlock {
    using Vec4 = std::array<float, 4>;
    Vec4 rayleigh{}, aerosol{};
    Vec4 rayleigh_depth{}, aerosol_depth{};
    Vec4 sun{}, disc{};
    Vec4 ambient_side{}, ambient_rise{}, ambient_bend{};
    Vec4 place{}, horizon{};
};
static_assert(sizeof(AirBlock) == 11 * 16);

AirBlock::Vec4 packed(const Rgb& rgb, double w) {
    return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2]),
            static_cast<float>(w)};
}

GlTexture make_map(GlTexture texture) {
    glTextureParameteri(texture.name(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(texture.name(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(texture.name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTextureParameteri(texture.name(), GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    return texture;
}

double sine_of(const RendererSettings& settings) {
    return std::clamp(settings.sun_direction.z() / settings.sun_direction.norm(), -1.0, 1.0);
}

}  // namespace

Daylight make_daylight(const Atmosphere& atmosphere, double sun_sine, double stops) {
    const Atmosphere::Ambient ambient = atmosphere.ambient(0.0, sun_sine);
    const Rgb sun = atmosphere.sunlight(0.0, sun_sine);
    // the sky over the horizon, 45 degrees beside the sun: the brightest part of a view at dusk
    const std::array<double, 1> beside{std::sqrt(0.5)};
    std::array<Rgb, 1> horizon;
    atmosphere.sky({0.0, kHorizonSine, sun_sine}, Rgb::Zero(), beside, horizon);
    // mean irradiance of surfaces that face different ways, a share of the horizon's light, and starlight
    const double irradiance =
        luminance(ambient.up) + luminance(sun) * (0.25 + 0.5 * std::max(sun_sine, 0.0)) +
        kHorizonShare * kPi * luminance(horizon[0]) + kNightIlluminance / kSunIlluminance;
    const double seen = kMiddleGrey / kPi * kSunIlluminance * irradiance;  // cd/m^2
    const double key = 1.03 - 2.0 / (2.0 + std::log10(seen + 1.0));
    Daylight light;
    light.exposure = std::exp2(stops) * kLightPerKey * key * kPi / irradiance;
    const double of_white = light.exposure / kPi;
    light.up = of_white * ambient.up;
    light.side = of_white * ambient.side;
    light.down = of_white * ambient.down;
    const Atmosphere::SunDepth depth = atmosphere.sun_depth(sun_sine);
    light.rayleigh_depth = depth.rayleigh;
    light.aerosol_depth = depth.aerosol;
    light.ozone_depth = depth.ozone;
    light.sun = Rgb::Constant(of_white * Atmosphere::sun_share(0.0, sun_sine));
    return light;
}

SkyLight::SkyLight(const RendererSettings& settings)
    : atmosphere_(settings.haze_distance),
      sun_(settings.sun_direction / settings.sun_direction.norm()),
      daylight_(make_daylight(atmosphere_, sine_of(settings), settings.exposure_stops)),
      sky_map_(make_map(make_texture_2d())),
      air_map_(make_map(make_texture_3d())),
      block_(make_buffer()) {
    glTextureStorage2D(sky_map_.name(), 1, GL_RGBA32F, kSkyAzimuths, kSkyElevations);
    glTextureStorage3D(air_map_.name(), 1, GL_RGBA32F, kAirAzimuths, kAirElevations, kAirDistances);
    glNamedBufferStorage(block_.name(), sizeof(AirBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
}

const SkyMaps& SkyLight::maps_at(int step) {
    Slot& slot = slots_[static_cast<std::size_t>(step % 2)];
    if (slot.step != step) {
        const Rgb planet_light = kPlanetAlbedo * daylight_.up / daylight_.exposure;
        slot = {step, make_sky_maps(atmosphere_, altitude_of(step), sun_.z(), planet_light)};
    }
    return slot.maps;
}

void SkyLight::prepare(double eye_altitude) {
    const double altitude =
        std::clamp(eye_altitude, 1.0, altitude_of(kAltitudes - 1) * (1.0 - 1e-9));
    if (altitude == altitude_) return;
    altitude_ = altitude;
    const double place = std::log(altitude / kFirstAltitude + 1.0) / std::log(kAltitudeRatio);
    const int step = std::clamp(static_cast<int>(place), 0, kAltitudes - 2);
    const auto upper = static_cast<float>(std::clamp(
        (altitude - altitude_of(step)) / (altitude_of(step + 1) - altitude_of(step)), 0.0, 1.0));
    const SkyMaps& below = maps_at(step);
    const SkyMaps& above = maps_at(step + 1);
    const auto exposure = static_cast<float>(daylight_.exposure);
    const auto mix = [&](const std::vector<float>& a, const std::vector<float>& b) {
        mixed_.resize(a.size());
        for (std::size_t i = 0; i < a.size(); ++i)
            mixed_[i] = exposure * (a[i] + upper * (b[i] - a[i]));
        return mixed_.data();
    };
    glTextureSubImage2D(sky_map_.name(), 0, 0, 0, kSkyAzimuths, kSkyElevations, GL_RGBA, GL_FLOAT,
                        mix(below.sky, above.sky));
    glTextureSubImage3D(air_map_.name(), 0, 0, 0, 0, kAirAzimuths, kAirElevations, kAirDistances,
                        GL_RGBA, GL_FLOAT, mix(below.air, above.air));

    // the shader uses exp2
    const double log2e = std::numbers::log2e;
    const AirPart air = atmosphere_.at(0.0);
    const double aerosol = air.extinction[1] - air.rayleigh[1];
    AirBlock block;
    block.rayleigh = packed(log2e * air.rayleigh, log2e / kRayleighHeight);
    block.aerosol = packed(Rgb::Constant(log2e * aerosol), log2e / kAerosolHeight);
    block.rayleigh_depth =
        packed(log2e * daylight_.rayleigh_depth, std::exp(-altitude / kRayleighHeight));
    block.aerosol_depth = packed(Rgb::Constant(log2e * daylight_.aerosol_depth),
                                 std::exp(-altitude / kAerosolHeight));
    block.sun = packed(daylight_.sun * (-daylight_.ozone_depth).exp(), altitude);
    // the radiance of a disc, whose irradiance is spread over its solid angle
    const Rgb disc = daylight_.exposure / (kPi * kSunRadius * kSunRadius) *
                     atmosphere_.transmittance(altitude, sun_.z());
    block.disc = packed(disc * std::min(1.0, kMostDisc / std::max(disc.maxCoeff(), 1e-30)),
                        std::cos(kSunRadius));
    block.ambient_side = packed(daylight_.side, 0.0);
    block.ambient_rise = packed(0.5 * (daylight_.up - daylight_.down), 0.0);
    block.ambient_bend = packed(0.5 * (daylight_.up + daylight_.down) - daylight_.side, 0.0);
    const double level = std::hypot(sun_.x(), sun_.y());
    const double horizon = horizon_sine(altitude);
    block.place = {level > 1e-6 ? static_cast<float>(sun_.x() / level) : 1.0f,
                   level > 1e-6 ? static_cast<float>(sun_.y() / level) : 0.0f,
                   static_cast<float>(std::max(altitude - kLowerAir, 0.0)),
                   static_cast<float>(kAirReach)};
    block.horizon = {static_cast<float>(horizon), static_cast<float>(1.0 / (1.0 - horizon)),
                     static_cast<float>(1.0 / (1.0 + horizon)), 0.0f};
    glNamedBufferSubData(block_.name(), 0, sizeof(block), &block);
}

void SkyLight::bind() const {
    glBindBufferBase(GL_UNIFORM_BUFFER, 6, block_.name());
    glBindTextureUnit(10, sky_map_.name());
    glBindTextureUnit(11, air_map_.name());
}

std::size_t SkyLight::bytes() const {
    return 4 * sizeof(float) *
           (std::size_t{kSkyAzimuths} * kSkyElevations +
            std::size_t{kAirAzimuths} * kAirElevations * kAirDistances);
}

}  // namespace terrane::internal
