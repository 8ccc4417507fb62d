// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>

#include <array>
#include <span>
#include <vector>

namespace terrane::internal {

/// Red, green and blue: values at wavelengths near 680, 550 and 440 nm.
using Rgb = Eigen::Array3d;

/// Radius of the planet's sphere, and thickness of its air, metres.
inline constexpr double kPlanetRadius = 6'371'000.0;
inline constexpr double kAirThickness = 100'000.0;
/// Angular radius of the sun's disc seen from the Earth, radians: 16 arc minutes.
inline constexpr double kSunRadius = 0.00465;
/// Metres of altitude over which the densities of molecules and of aerosols fall to 1 / e.
inline constexpr double kRayleighHeight = 8000.0;
inline constexpr double kAerosolHeight = 1200.0;
/// Albedo of the planet's surface, which lights the air from below and closes the view below the horizon.
inline const Rgb kPlanetAlbedo{0.18, 0.16, 0.12};

/// What a part of the air does per metre at an altitude.
struct AirPart {
    Rgb rayleigh;        ///< scattering by molecules
    double aerosol = 0;  ///< scattering by aerosols
    Rgb extinction;      ///< scattering and absorption together
};

/// A ray through the air. Sines of elevations are those at the ray's start.
struct AirRay {
    double altitude = 0.0;  ///< of the start above the planet, metres, 0 or more
    double sine = 0.0;      ///< of the ray's elevation
    double sun_sine = 1.0;  ///< of the sun's elevation
};

/// Scattering of sunlight in the air of a planet: a smooth sphere under air whose density depends only on the altitude.
///
/// Radiances are per unit of the sun's irradiance above the air, 1/sr. They stay finite for every sun, altitude and
/// direction. Threads: any number at once. Cost: the constructor takes about 50 ms.
class Atmosphere {
public:
    /// @param haze_distance metres at sea level over which air and aerosols absorb two thirds of green light, > 0. Air
    ///                      alone has 81 km: there are no aerosols if the distance is larger.
    explicit Atmosphere(double haze_distance);

    AirPart at(double altitude) const;

    /// Transmittance of the air from an altitude to space along a ray; the planet does not block rays.
    ///
    /// @param sine of the ray's elevation
    Rgb transmittance(double altitude, double sine) const;
    /// Share of the sun's disc above the horizon, 0 to 1.
    static double sun_share(double altitude, double sun_sine);
    /// Irradiance of a surface that faces the sun: transmittance times the share of the disc above the horizon.
    Rgb sunlight(double altitude, double sun_sine) const;
    /// Radiance that is scattered to any direction by the second and all later scatterings, per unit of the scattering
    /// coefficient.
    Rgb multiple(double altitude, double sun_sine) const;

    /// Radiance scattered towards the start of rays of one elevation from the air up to several distances.
    ///
    /// @param bounds          ascending distances from the start, metres; one step of integration ends at each
    /// @param azimuth_cosines of the angle between the horizontal directions of each ray and the sun
    /// @param light_out       by bound, then by azimuth: bounds.size() * azimuth_cosines.size() values
    /// @return transmittance up to the last bound
    Rgb scatter(const AirRay& ray, std::span<const double> bounds,
                std::span<const double> azimuth_cosines, std::span<Rgb> light_out) const;

    /// Radiance of the sky without the sun's disc: of the air up to space, or up to the planet and of the planet.
    ///
    /// @param planet_light  radiance of the planet's surface where the ray meets it, without the direct sun
    void sky(const AirRay& ray, const Rgb& planet_light, std::span<const double> azimuth_cosines,
             std::span<Rgb> light_out) const;

    /// Irradiance by the sky and the planet at an altitude, of surfaces that face up, sideways (the mean over all
    /// azimuths) and down.
    struct Ambient {
        Rgb up, side, down;
    };
    Ambient ambient(double altitude, double sun_sine) const;

    /// Optical depth from sea level to the sun by molecules, aerosols and ozone; a sun below the horizon counts as if
    /// it were on it.
    struct SunDepth {
        Rgb rayleigh, ozone;
        double aerosol = 0.0;
    };
    SunDepth sun_depth(double sun_sine) const;

private:
    void fill_transmittance();
    void fill_multiple();

    double aerosol_extinction_ = 0.0;  // per metre at sea level
    std::vector<Rgb> transmittance_, multiple_;
};

/// Sine of the elevation of the planet's horizon at an altitude, 0 or less.
double horizon_sine(double altitude);

// Maps of the sky and of the air before the ground for one altitude of the eye, addressed as in atmosphere.glsl: by the
// azimuth from the sun, by the elevation from the horizon, whose row is the middle one, and `air` also by distance.
inline constexpr int kSkyAzimuths = 48, kSkyElevations = 97;
inline constexpr int kAirAzimuths = 24, kAirElevations = 33, kAirDistances = 16;

/// Metres at which the distance's place in the map is half its range.
inline constexpr double kAirReach = 20'000.0;
/// Altitude above which the map's distances begin at the lower air.
inline constexpr double kLowerAir = 60'000.0;

/// Radiances. The fourth float of a texel is 1.
struct SkyMaps {
    /// [kSkyElevations][kSkyAzimuths][4] of the air up to space or to the planet, and of the planet.
    std::vector<float> sky;
    /// [kAirDistances][kAirElevations][kAirAzimuths][4] of the air up to the distance.
    std::vector<float> air;
};

/// Fills the maps of an altitude.
///
/// Cost: about 10 ms
SkyMaps make_sky_maps(const Atmosphere& atmosphere, double altitude, double sun_sine,
                      const Rgb& planet_light);

}  // namespace terrane::internal
