// SPDX-License-Identifier: MIT
// Sky, aerial perspective and daylight by scattering of sunlight in the air.
//
// Sources:    S. Hillaire. A Scalable and Production Ready Sky and Atmosphere Rendering Technique. Computer Graphics
//             Forum 39(4), 2020 (multiple scattering as a geometric series, maps of the sky around the eye).
//             E. Bruneton, F. Neyret. Precomputed Atmospheric Scattering. Computer Graphics Forum 27(4), 2008
//             (addresses of the transmittance). E. Bruneton. A Qualitative and Quantitative Evaluation of 8 Clear Sky
//             Models. IEEE TVCG 23(12), 2017 (coefficients of air, aerosols and ozone).
//             W. Cornette, J. Shanks. Physically reasonable analytic expression for the single-scattering phase
//             function. Applied Optics 31(16), 1992 (aerosols).
// Deviations: the amount of aerosols follows from the haze distance; elevations are stored by the square root of their
//             sine above or below the horizon, which needs no inverse trigonometric function; the map of the air before
//             the ground surrounds the eye, not the view, so that turning the eye does not change it; everything is
//             integrated by the CPU, and therefore equal on all devices. Three wavelengths stand for the spectrum;
//             polarisation, refraction, clouds and terrain's shadows in the air are left out.
#include "light/atmosphere.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace terrane::internal {
namespace {

constexpr double kPi = std::numbers::pi;

// Per metre at sea level.
const Rgb kRayleigh{5.802e-6, 13.558e-6, 33.1e-6};
// Share of the aerosols' extinction that is scattering, and asymmetry of their phase function.
constexpr double kAerosolAlbedo = 0.9;
constexpr double kAsymmetry = 0.8;
// Absorption by ozone per metre where it is densest; the density falls linearly to 0 within kOzoneWidth.
const Rgb kOzone{0.650e-6, 1.881e-6, 0.085e-6};
constexpr double kOzoneAltitude = 25'000.0, kOzoneWidth = 15'000.0;

constexpr double kTopRadius = kPlanetRadius + kAirThickness;
// The lowest ground, metres: rays to the ground end there at the latest.
constexpr double kLowestGround = -1000.0;

double rayleigh_phase(double cosine) { return 3.0 / (16.0 * kPi) * (1.0 + cosine * cosine); }

double aerosol_phase(double cosine) {
    constexpr double g = kAsymmetry;
    const double base = 1.0 + g * g - 2.0 * g * cosine;
    return 3.0 / (8.0 * kPi) * (1.0 - g * g) * (1.0 + cosine * cosine) /
           ((2.0 + g * g) * base * std::sqrt(base));
}

// Distances along a ray's line to its nearer and farther intersection with a sphere; none if it misses the sphere.
struct Crossing {
    double nearer = 0.0, farther = 0.0;
};
std::optional<Crossing> crossing(double start_radius, double sine, double radius) {
    const double squared =
        radius * radius - start_radius * start_radius * (1.0 - sine) * (1.0 + sine);
    if (squared < 0.0) return std::nullopt;
    const double middle = -start_radius * sine, half = std::sqrt(squared);
    return Crossing{middle - half, middle + half};
}

// The part of a ray that is in the air, up to a sphere below that does not enclose the start.
struct AirPath {
    double begin = 0.0, end = 0.0;  // metres from the start; equal: none
    bool meets_planet = false;
};
AirPath path_in_air(double altitude, double sine, double floor_altitude) {
    const double start = kPlanetRadius + altitude;
    const std::optional<Crossing> air = crossing(start, sine, kTopRadius);
    if (!air || air->farther <= 0.0) return {};
    AirPath path{std::max(air->nearer, 0.0), air->farther, false};
    const std::optional<Crossing> planet = crossing(start, sine, kPlanetRadius + floor_altitude);
    if (sine < 0.0 && planet) {
        path.end = std::max(planet->nearer, path.begin);
        path.meets_planet = true;
    }
    return path;
}

// Bounds of the steps of integration along a path: shorter towards the path's lowest point, where the air is densest.
void append_steps(double altitude, double sine, const AirPath& path, int count,
                  std::vector<double>& bounds) {
    if (!(path.end > path.begin)) return;
    const double lowest = std::clamp(-(kPlanetRadius + altitude) * sine, path.begin,
                                     path.end);  // metres from the start
    const double share = (lowest - path.begin) / (path.end - path.begin);
    const int down = lowest > path.begin
                         ? std::max(2, static_cast<int>(std::lround(count * std::sqrt(share))))
                         : 0;
    for (int i = 1; i <= down; ++i) {
        const double t = 1.0 - static_cast<double>(i) / down;
        bounds.push_back(lowest - (lowest - path.begin) * t * t);
    }
    if (!(path.end > lowest)) return;
    const int up = std::max(count - down, count / 2);
    for (int i = 1; i <= up; ++i) {
        const double t = static_cast<double>(i) / up;
        bounds.push_back(lowest + (path.end - lowest) * t * t);
    }
}

// A bilinear lookup in a table of columns x rows at u, v in 0 to 1; the first and last samples are at 0 and 1.
Rgb lookup(const std::vector<Rgb>& table, int columns, int rows, double u, double v) {
    const double x = std::clamp(u, 0.0, 1.0) * (columns - 1);
    const double y = std::clamp(v, 0.0, 1.0) * (rows - 1);
    const int column = std::min(static_cast<int>(x), columns - 2);
    const int row = std::min(static_cast<int>(y), rows - 2);
    const double right = x - column, upper = y - row;
    const Rgb* const at = &table[static_cast<std::size_t>(row * columns + column)];
    return (1.0 - upper) * ((1.0 - right) * at[0] + right * at[1]) +
           upper * ((1.0 - right) * at[columns] + right * at[columns + 1]);
}

// Table of transmittances: columns by the length of the path to space, rows by the distance to the horizon.
constexpr int kDepthColumns = 128, kDepthRows = 64;
// Table of multiple scattering: columns by the sine of the sun's elevation, rows by the altitude.
constexpr int kSunColumns = 33, kAltitudeRows = 24;

const double kFarthestHorizon = std::sqrt(kTopRadius * kTopRadius - kPlanetRadius * kPlanetRadius);

// Place of a sine in -1 to 1 in 0 to 1, with more samples near 0.
double place_of_sine(double sine) {
    const double root = std::sqrt(std::abs(sine));
    return 0.5 + 0.5 * (sine < 0.0 ? -root : root);
}
double sine_at(double place) {
    const double root = 2.0 * place - 1.0;
    return root * std::abs(root);
}

}  // namespace

double horizon_sine(double altitude) {
    const double ratio = kPlanetRadius / (kPlanetRadius + std::max(altitude, 0.0));
    return -std::sqrt((1.0 - ratio) * (1.0 + ratio));
}

Atmosphere::Atmosphere(double haze_distance)
    : aerosol_extinction_(std::max(std::log(3.0) / haze_distance - kRayleigh[1], 0.0)) {
    fill_transmittance();
    fill_multiple();
}

AirPart Atmosphere::at(double altitude) const {
    const double height = std::max(altitude, 0.0);
    const double aerosols = aerosol_extinction_ * std::exp(-height / kAerosolHeight);
    const double ozone = std::max(1.0 - std::abs(height - kOzoneAltitude) / kOzoneWidth, 0.0);
    AirPart part;
    part.rayleigh = kRayleigh * std::exp(-height / kRayleighHeight);
    part.aerosol = kAerosolAlbedo * aerosols;
    part.extinction = part.rayleigh + aerosols + kOzone * ozone;
    return part;
}

void Atmosphere::fill_transmittance() {
    constexpr int kSteps = 40;
    transmittance_.resize(std::size_t{kDepthColumns} * kDepthRows);
    std::vector<double> bounds;
    for (int row = 0; row < kDepthRows; ++row) {
        const double rho = kFarthestHorizon * row / (kDepthRows - 1);
        const double radius = std::sqrt(rho * rho + kPlanetRadius * kPlanetRadius);
        const double least = kTopRadius - radius, most = rho + kFarthestHorizon;
        for (int column = 0; column < kDepthColumns; ++column) {
            const double length = least + (most - least) * column / (kDepthColumns - 1);
            const double sine =
                length > 0.0
                    ? std::clamp((kTopRadius * kTopRadius - radius * radius - length * length) /
                                     (2.0 * radius * length),
                                 -1.0, 1.0)
                    : 1.0;
            bounds.clear();
            append_steps(radius - kPlanetRadius, sine, {0.0, length, false}, kSteps, bounds);
            Rgb depth = Rgb::Zero();
            double begin = 0.0;
            for (const double end : bounds) {
                const double middle = 0.5 * (begin + end);
                const double altitude =
                    std::sqrt(radius * radius + middle * (middle + 2.0 * radius * sine)) -
                    kPlanetRadius;
                depth += (end - begin) * at(altitude).extinction;
                begin = end;
            }
            transmittance_[static_cast<std::size_t>(row * kDepthColumns + column)] = (-depth).exp();
        }
    }
}

Rgb Atmosphere::transmittance(double altitude, double sine) const {
    const double height = std::max(altitude, 0.0);
    if (height >= kAirThickness) return Rgb::Ones();
    const double radius = kPlanetRadius + height;
    const double rho = std::sqrt(height * (height + 2.0 * kPlanetRadius));
    const double clear = std::max(sine, -rho / radius);
    const double squared =
        std::max(radius * radius * (clear * clear - 1.0) + kTopRadius * kTopRadius, 0.0);
    const double length = std::max(-radius * clear + std::sqrt(squared), 0.0);
    const double least = kTopRadius - radius, most = rho + kFarthestHorizon;
    return lookup(transmittance_, kDepthColumns, kDepthRows, (length - least) / (most - least),
                  rho / kFarthestHorizon);
}

double Atmosphere::sun_share(double altitude, double sun_sine) {
    const double above = (sun_sine - horizon_sine(altitude)) / kSunRadius;
    const double t = std::clamp(0.5 + 0.5 * above, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

Rgb Atmosphere::sunlight(double altitude, double sun_sine) const {
    const double share = sun_share(altitude, sun_sine);
    if (share == 0.0) return Rgb::Zero();
    return share * transmittance(altitude, sun_sine);
}

Atmosphere::SunDepth Atmosphere::sun_depth(double sun_sine) const {
    constexpr int kSteps = 400;
    const double sine = std::max(sun_sine, 0.0);
    const double length = crossing(kPlanetRadius, sine, kTopRadius)->farther;
    std::vector<double> bounds;
    append_steps(0.0, sine, {0.0, length, false}, kSteps, bounds);
    SunDepth depth{Rgb::Zero(), Rgb::Zero(), 0.0};
    double begin = 0.0;
    for (const double end : bounds) {
        const double middle = 0.5 * (begin + end);
        const double altitude = std::sqrt(kPlanetRadius * kPlanetRadius +
                                          middle * (middle + 2.0 * kPlanetRadius * sine)) -
                                kPlanetRadius;
        const AirPart part = at(altitude);
        const double aerosols = part.aerosol / kAerosolAlbedo;
        depth.rayleigh += (end - begin) * part.rayleigh;
        depth.aerosol += (end - begin) * aerosols;
        depth.ozone += (end - begin) * (part.extinction - part.rayleigh - aerosols);
        begin = end;
    }
    return depth;
}

// For every altitude and sun: the radiance L2 of the second scattering, if each scatters evenly in all directions, and
// the share f of evenly distributed light that one more scattering returns. All orders together are L2 / (1 - f).
void Atmosphere::fill_multiple() {
    constexpr int kTurns = 4, kElevations = 12, kSteps = 16;
    constexpr double kEven = 1.0 / (4.0 * kPi);
    multiple_.assign(std::size_t{kSunColumns} * kAltitudeRows, Rgb::Zero());
    std::vector<double> bounds;
    for (int row = 0; row < kAltitudeRows; ++row) {
        const double t = static_cast<double>(row) / (kAltitudeRows - 1);
        const double altitude = kAirThickness * t * t;
        const double radius = kPlanetRadius + altitude;
        Rgb returned = Rgb::Zero();
        for (int elevation = 0; elevation < kElevations; ++elevation) {
            // denser towards the horizon, where the light changes most
            const double root = (2.0 * elevation + 1.0) / kElevations - 1.0;
            const double sine = root * std::abs(root);
            const double cosine = std::sqrt(1.0 - sine * sine);
            const double share = 2.0 * std::abs(root) / kElevations;  // of all directions
            const AirPath path = path_in_air(altitude, sine, 0.0);
            bounds.clear();
            append_steps(altitude, sine, path, kSteps, bounds);
            Rgb passed = Rgb::Ones();
            double begin = path.begin;
            const auto add = [&](double distance, const Rgb& weight, bool is_planet) {
                const double there =
                    std::sqrt(radius * radius + distance * (distance + 2.0 * radius * sine));
                for (int column = 0; column < kSunColumns; ++column) {
                    const double sun_sine =
                        sine_at(static_cast<double>(column) / (kSunColumns - 1));
                    const double sun_cosine = std::sqrt(1.0 - sun_sine * sun_sine);
                    Rgb& sum = multiple_[static_cast<std::size_t>(row * kSunColumns + column)];
                    for (int turn = 0; turn < kTurns; ++turn) {
                        // azimuths of half a circle: the other half is its mirror image
                        const double towards =
                            sine * sun_sine +
                            cosine * sun_cosine * std::cos(kPi * (turn + 0.5) / kTurns);
                        const double local =
                            std::clamp((radius * sun_sine + distance * towards) / there, -1.0, 1.0);
                        const Rgb sun = sunlight(there - kPlanetRadius, local);
                        sum += weight * sun *
                               ((is_planet ? std::max(local, 0.0) / kPi : kEven) * share / kTurns);
                    }
                }
            };
            for (const double end : bounds) {
                const double middle = 0.5 * (begin + end);
                const AirPart part =
                    at(std::sqrt(radius * radius + middle * (middle + 2.0 * radius * sine)) -
                       kPlanetRadius);
                const Rgb step = (-(end - begin) * part.extinction).exp();
                const Rgb scattering = part.rayleigh + part.aerosol;
                const Rgb weight = passed * scattering * (1.0 - step) / part.extinction;
                returned += share * weight;
                add(middle, weight, false);
                passed *= step;
                begin = end;
            }
            if (path.meets_planet) add(path.end, passed * kPlanetAlbedo, true);
        }
        for (int column = 0; column < kSunColumns; ++column) {
            multiple_[static_cast<std::size_t>(row * kSunColumns + column)] /= 1.0 - returned;
        }
    }
}

Rgb Atmosphere::multiple(double altitude, double sun_sine) const {
    return lookup(multiple_, kSunColumns, kAltitudeRows, place_of_sine(sun_sine),
                  std::sqrt(std::clamp(altitude / kAirThickness, 0.0, 1.0)));
}

namespace {

// Cosine of the angle between a ray and the sun.
double towards_sun(const AirRay& ray, double azimuth_cosine) {
    const double level = (1.0 - ray.sine * ray.sine) * (1.0 - ray.sun_sine * ray.sun_sine);
    return std::clamp(ray.sine * ray.sun_sine + std::sqrt(std::max(level, 0.0)) * azimuth_cosine,
                      -1.0, 1.0);
}

}  // namespace

Rgb Atmosphere::scatter(const AirRay& ray, std::span<const double> bounds,
                        std::span<const double> azimuth_cosines, std::span<Rgb> light_out) const {
    struct Azimuth {
        double towards = 0.0, rayleigh = 0.0, aerosol = 0.0;
        Rgb sum = Rgb::Zero();
    };
    std::vector<Azimuth> azimuths(azimuth_cosines.size());
    for (std::size_t i = 0; i < azimuths.size(); ++i) {
        const double towards = towards_sun(ray, azimuth_cosines[i]);
        azimuths[i] = {towards, rayleigh_phase(towards), aerosol_phase(towards), Rgb::Zero()};
    }
    const double radius = kPlanetRadius + ray.altitude;
    const AirPath path = path_in_air(ray.altitude, ray.sine, kLowestGround);
    Rgb passed = Rgb::Ones();
    double begin = path.begin;
    for (std::size_t step = 0; step < bounds.size(); ++step) {
        const double end = std::clamp(bounds[step], begin, path.end);
        if (end > begin) {
            const double middle = 0.5 * (begin + end);
            const double there =
                std::sqrt(radius * radius + middle * (middle + 2.0 * radius * ray.sine));
            const double altitude = std::max(there - kPlanetRadius, 0.0);
            const AirPart part = at(altitude);
            const Rgb share = (-(end - begin) * part.extinction).exp();
            const Rgb weight = passed * (1.0 - share) / part.extinction;
            for (Azimuth& azimuth : azimuths) {
                const double local = std::clamp(
                    (radius * ray.sun_sine + middle * azimuth.towards) / there, -1.0, 1.0);
                const Rgb sun = sunlight(altitude, local), later = multiple(altitude, local);
                azimuth.sum += weight * (part.rayleigh * (azimuth.rayleigh * sun + later) +
                                         part.aerosol * (azimuth.aerosol * sun + later));
            }
            passed *= share;
            begin = end;
        }
        for (std::size_t i = 0; i < azimuths.size(); ++i) {
            light_out[step * azimuths.size() + i] = azimuths[i].sum;
        }
    }
    return passed;
}

void Atmosphere::sky(const AirRay& ray, const Rgb& planet_light,
                     std::span<const double> azimuth_cosines, std::span<Rgb> light_out) const {
    constexpr int kSteps = 40;
    const AirPath path = path_in_air(ray.altitude, ray.sine, 0.0);
    std::vector<double> bounds;
    append_steps(ray.altitude, ray.sine, path, kSteps, bounds);
    const std::size_t count = azimuth_cosines.size();
    std::vector<Rgb> light(bounds.size() * count);
    const Rgb passed = scatter(ray, bounds, azimuth_cosines, light);
    const double radius = kPlanetRadius + ray.altitude;
    for (std::size_t i = 0; i < count; ++i) {
        light_out[i] = bounds.empty() ? Rgb::Zero() : light[light.size() - count + i];
        if (!path.meets_planet) continue;
        const double local =
            (radius * ray.sun_sine + path.end * towards_sun(ray, azimuth_cosines[i])) /
            kPlanetRadius;
        const Rgb direct = kPlanetAlbedo / kPi * sunlight(0.0, std::clamp(local, -1.0, 1.0)) *
                           std::max(local, 0.0);
        light_out[i] += passed * (direct + planet_light);
    }
}

namespace {

// Cosines of azimuths whose places sin(azimuth / 2) in a map are evenly spaced.
template <std::size_t kCount>
std::array<double, kCount> azimuth_cosines() {
    std::array<double, kCount> cosines{};
    for (std::size_t i = 0; i < kCount; ++i) {
        const double u = static_cast<double>(i) / (kCount - 1);
        cosines[i] = 1.0 - 2.0 * u * u;
    }
    return cosines;
}

// Sine of the elevation of a map's row. Rows go from straight down through the horizon, in the middle row, to straight
// up. The difference to the horizon's sine grows with the square of the number of rows, so that rows are densest there.
//
// @param horizon sine of the horizon's elevation
double sine_of_row(int row, int rows, double horizon) {
    const double place = 2.0 * row / (rows - 1) - 1.0;
    const double reach = place < 0.0 ? 1.0 + horizon : 1.0 - horizon;
    return std::clamp(horizon + reach * place * std::abs(place), -1.0, 1.0);
}

void append(std::span<const Rgb> light, std::vector<float>& texels) {
    for (const Rgb& each : light) {
        for (const double part : each) texels.push_back(static_cast<float>(part));
        texels.push_back(1.0f);
    }
}

}  // namespace

Atmosphere::Ambient Atmosphere::ambient(double altitude, double sun_sine) const {
    constexpr int kElevations = 24, kTurns = 12;
    std::array<double, kTurns> cosines{};
    for (int turn = 0; turn < kTurns; ++turn)
        cosines[static_cast<std::size_t>(turn)] = std::cos(kPi * (turn + 0.5) / kTurns);
    std::array<Rgb, kTurns> light;
    Ambient sum{Rgb::Zero(), Rgb::Zero(), Rgb::Zero()};
    const double solid_angle = 4.0 * kPi / kElevations;
    for (int elevation = kElevations; elevation-- > 0;) {
        const double sine = (2.0 * elevation + 1.0) / kElevations - 1.0;
        // the upper half comes first, so that it lights the planet
        sky({altitude, sine, sun_sine}, kPlanetAlbedo / kPi * sum.up, cosines, light);
        Rgb mean = Rgb::Zero();
        for (const Rgb& each : light) mean += each / kTurns;
        (sine > 0.0 ? sum.up : sum.down) += solid_angle * std::abs(sine) * mean;
        sum.side += solid_angle * std::sqrt(1.0 - sine * sine) / kPi * mean;
    }
    return sum;
}

SkyMaps make_sky_maps(const Atmosphere& atmosphere, double altitude, double sun_sine,
                      const Rgb& planet_light) {
    const double horizon = horizon_sine(altitude);
    SkyMaps maps;
    maps.sky.reserve(std::size_t{4} * kSkyAzimuths * kSkyElevations);
    const auto sky_azimuths = azimuth_cosines<kSkyAzimuths>();
    std::array<Rgb, kSkyAzimuths> sky;
    for (int row = 0; row < kSkyElevations; ++row) {
        const double sine = sine_of_row(row, kSkyElevations, horizon);
        atmosphere.sky({altitude, sine, sun_sine}, planet_light, sky_azimuths, sky);
        append(sky, maps.sky);
    }

    constexpr int kStepsBetween = 3;  // between the map's distances
    constexpr int kLast = kAirDistances - 1;
    const auto air_azimuths = azimuth_cosines<kAirAzimuths>();
    maps.air.resize(std::size_t{4} * kAirAzimuths * kAirElevations * kAirDistances);
    std::vector<double> bounds;
    std::vector<Rgb> light;
    std::vector<float> texels;
    for (int row = 0; row < kAirElevations; ++row) {
        const double sine = sine_of_row(row, kAirElevations, horizon);
        const double first =
            std::max(altitude - kLowerAir, 0.0) / std::max({-sine, -horizon, 1e-9});
        bounds.clear();
        for (int i = 0; i < kLast * kStepsBetween; ++i) {
            const double t = (i + 1.0) / (kLast * kStepsBetween);
            // the last distance stands for all of the air
            bounds.push_back(first +
                             (i + 1 < kLast * kStepsBetween ? kAirReach * t / (1.0 - t) : 1e8));
        }
        light.resize(bounds.size() * kAirAzimuths);
        atmosphere.scatter({altitude, sine, sun_sine}, bounds, air_azimuths, light);
        for (int distance = 0; distance < kAirDistances; ++distance) {
            texels.clear();
            if (distance == 0) {
                texels.assign(std::size_t{4} * kAirAzimuths, 0.0f);
            } else {
                const std::size_t from =
                    (static_cast<std::size_t>(distance) * kStepsBetween - 1) * kAirAzimuths;
                append(std::span(light).subspan(from, kAirAzimuths), texels);
            }
            std::copy(texels.begin(), texels.end(),
                      maps.air.begin() + 4 * kAirAzimuths * (distance * kAirElevations + row));
        }
    }
    return maps;
}

}  // namespace terrane::internal
