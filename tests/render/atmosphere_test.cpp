// SPDX-License-Identifier: MIT
#include "light/atmosphere.h"

#include "light/sky_light.h"
#include "render/render_scene.h"

#include <terrane/render/sun_position.h>
#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace terrane::internal {
namespace atmosphere_test {

constexpr double kPi = std::numbers::pi;
constexpr double kHaze = 60'000.0;
constexpr double kDegree = kPi / 180.0;

const Atmosphere& air() {
    static const Atmosphere made(kHaze);
    return made;
}

// Height above the planet of a point along a ray.
double height_along(const AirRay& ray, double distance) {
    const double radius = kPlanetRadius + ray.altitude;
    return std::sqrt(radius * radius + distance * distance + 2.0 * distance * radius * ray.sine) -
           kPlanetRadius;
}

// Transmittance from a point to space, by even steps.
Rgb slow_transmittance(double altitude, double sine, int steps) {
    const AirRay ray{altitude, sine, 0.0};
    const double radius = kPlanetRadius + altitude, top = kPlanetRadius + kAirThickness;
    const double length =
        -radius * sine + std::sqrt(top * top - radius * radius * (1.0 - sine * sine));
    Rgb depth = Rgb::Zero();
    for (int i = 0; i < steps; ++i)
        depth +=
            length / steps * air().at(height_along(ray, length * (i + 0.5) / steps)).extinction;
    return (-depth).exp();
}

TEST(Atmosphere, TransmittanceIsThatOfASlowIntegral) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int i = 0; i < 40; ++i) {
        const double altitude = 60'000.0 * unit(random) * unit(random);
        const double horizon = horizon_sine(altitude);
        const double sine = horizon + (1.0 - horizon) * unit(random) * unit(random);
        const Rgb expected = slow_transmittance(altitude, sine, 4000);
        const Rgb found = air().transmittance(altitude, sine);
        for (int part = 0; part < 3; ++part)
            ASSERT_NEAR(found[part], expected[part], 0.006)
                << altitude << " " << sine << " " << part;
    }
    const Rgb vertical = air().transmittance(0.0, 1.0);
    const Atmosphere::SunDepth depth = air().sun_depth(1.0);
    for (int part = 0; part < 3; ++part)
        EXPECT_NEAR(vertical[part],
                    std::exp(-depth.rayleigh[part] - depth.aerosol - depth.ozone[part]), 0.002);
}

// Light scattered along a ray up to a distance, by even short steps and without tables for the first scattering.
Rgb slow_light(const AirRay& ray, double azimuth_cosine, double length) {
    constexpr int kSteps = 400;
    const double towards =
        ray.sine * ray.sun_sine +
        std::sqrt((1.0 - ray.sine * ray.sine) * (1.0 - ray.sun_sine * ray.sun_sine)) *
            azimuth_cosine;
    const double g = 0.8;
    const double molecules = 3.0 / (16.0 * kPi) * (1.0 + towards * towards);
    const double aerosols = 3.0 / (8.0 * kPi) * (1.0 - g * g) * (1.0 + towards * towards) /
                            ((2.0 + g * g) * std::pow(1.0 + g * g - 2.0 * g * towards, 1.5));
    Rgb light = Rgb::Zero(), depth = Rgb::Zero();
    for (int i = 0; i < kSteps; ++i) {
        const double distance = length * (i + 0.5) / kSteps, step = length / kSteps;
        const double altitude = std::max(height_along(ray, distance), 0.0);
        const AirPart part = air().at(altitude);
        const double sun = ((kPlanetRadius + ray.altitude) * ray.sun_sine + distance * towards) /
                           (kPlanetRadius + altitude);
        const Rgb direct =
            Atmosphere::sun_share(altitude, sun) *
            (sun > horizon_sine(altitude) - kSunRadius
                 ? slow_transmittance(altitude, std::max(sun, horizon_sine(altitude)), 300)
                 : Rgb::Zero());
        const Rgb later = air().multiple(altitude, sun);
        light += step * (-depth - 0.5 * step * part.extinction).exp() *
                 (part.rayleigh * (molecules * direct + later) +
                  part.aerosol * (aerosols * direct + later));
        depth += step * part.extinction;
    }
    return light;
}

TEST(Atmosphere, ScatteredLightIsThatOfASlowIntegral) {
    const std::vector<double> bounds = [] {
        std::vector<double> made;
        for (int i = 1; i <= 60; ++i) made.push_back(60'000.0 * i * i / 3600.0);
        return made;
    }();
    int compared = 0;
    for (const double altitude : {0.0, 1500.0, 9000.0}) {
        for (const double sine : {-0.02, 0.0, 0.3}) {
            for (const double sun : {0.03, 0.5}) {
                if (altitude == 0.0 && sine < 0.0) continue;
                const AirRay ray{altitude, sine, sun};
                const std::array<double, 2> cosines{0.9, -0.6};
                std::vector<Rgb> light(bounds.size() * cosines.size());
                air().scatter(ray, bounds, cosines, light);
                for (std::size_t i = 0; i < cosines.size(); ++i) {
                    const Rgb expected = slow_light(ray, cosines[i], bounds.back());
                    const Rgb found = light[light.size() - cosines.size() + i];
                    for (int part = 0; part < 3; ++part) {
                        ASSERT_NEAR(found[part], expected[part], 0.02 * expected.maxCoeff())
                            << altitude << " " << sine << " " << sun << " " << cosines[i];
                        ++compared;
                    }
                }
            }
        }
    }
    EXPECT_EQ(compared, 96);
}

// The second scattering and the share of light that returns, over many directions and short steps.
TEST(Atmosphere, LaterScatteringsAreASeriesOfTheSecond) {
    constexpr int kElevations = 60, kTurns = 16, kSteps = 120;
    for (const double altitude : {0.0, 8000.0}) {
        for (const double sun_sine : {0.1, 0.8}) {
            Rgb second = Rgb::Zero(), returned = Rgb::Zero();
            for (int i = 0; i < kElevations * kTurns; ++i) {
                const int elevation = i / kTurns;
                const double sine = (2.0 * elevation + 1.0) / kElevations - 1.0;
                const AirRay ray{altitude, sine, sun_sine};
                const double towards =
                    sine * sun_sine + std::sqrt((1.0 - sine * sine) * (1.0 - sun_sine * sun_sine)) *
                                          std::cos(2.0 * kPi * (i % kTurns + 0.5) / kTurns);
                const double radius = kPlanetRadius + altitude;
                const double inside =
                    kPlanetRadius * kPlanetRadius - radius * radius * (1.0 - sine * sine);
                const bool meets = sine < 0.0 && inside >= 0.0;
                const double top = kPlanetRadius + kAirThickness;
                const double end =
                    meets ? -radius * sine - std::sqrt(inside)
                          : -radius * sine +
                                std::sqrt(top * top - radius * radius * (1.0 - sine * sine));
                Rgb depth = Rgb::Zero();
                const auto sun_at = [&](double distance) {
                    const double height = height_along(ray, distance);
                    const double local =
                        (radius * sun_sine + distance * towards) / (kPlanetRadius + height);
                    return std::pair(air().sunlight(height, local), local);
                };
                for (int step = 0; step < kSteps; ++step) {
                    const double begin = end * step * step / (1.0 * kSteps * kSteps);
                    const double stop = end * (step + 1.0) * (step + 1.0) / (1.0 * kSteps * kSteps);
                    const double middle = 0.5 * (begin + stop);
                    const AirPart part = air().at(height_along(ray, middle));
                    const Rgb weight = (stop - begin) * (part.rayleigh + part.aerosol) *
                                       (-depth - 0.5 * (stop - begin) * part.extinction).exp() /
                                       (kElevations * kTurns);
                    second += weight * sun_at(middle).first / (4.0 * kPi);
                    returned += weight;
                    depth += (stop - begin) * part.extinction;
                }
                if (!meets) continue;
                const auto [sun, local] = sun_at(end);
                second += (-depth).exp() * kPlanetAlbedo / kPi * sun * std::max(local, 0.0) /
                          (kElevations * kTurns);
            }
            const Rgb expected = second / (1.0 - returned);
            const Rgb found = air().multiple(altitude, sun_sine);
            for (int part = 0; part < 3; ++part) {
                EXPECT_NEAR(found[part], expected[part], 0.06 * expected[part])
                    << altitude << " " << sun_sine << " " << part;
            }
        }
    }
}

Rgb sky_at(double altitude, double elevation_deg, double azimuth_deg, double sun_deg) {
    const std::array<double, 1> cosine{std::cos(azimuth_deg * kDegree)};
    std::array<Rgb, 1> light;
    air().sky({altitude, std::sin(elevation_deg * kDegree), std::sin(sun_deg * kDegree)},
              Rgb::Zero(), cosine, light);
    return light[0];
}

TEST(Atmosphere, TheSkyIsBlueBrightAtTheHorizonAndAroundTheSunAndRedBesideALowSun) {
    const Rgb zenith = sky_at(0.0, 90.0, 0.0, 50.0), horizon = sky_at(0.0, 2.0, 120.0, 50.0);
    EXPECT_GT(zenith[2], 1.5 * zenith[1]);
    EXPECT_GT(zenith[1], 1.5 * zenith[0]);
    EXPECT_GT(horizon[1], 2.0 * zenith[1]);
    // the horizon is whiter than the zenith
    EXPECT_LT(horizon[2] / horizon[0], 0.5 * zenith[2] / zenith[0]);
    double last = std::numeric_limits<double>::infinity();
    for (const double apart : {1.0, 3.0, 10.0, 25.0, 40.0}) {
        const Rgb light = sky_at(0.0, 50.0, apart, 50.0);
        EXPECT_LT(light[0], last) << apart;
        last = light[0];
    }
    const Rgb sunset = sky_at(0.0, 1.0, 0.0, 1.0),
              sun = air().sunlight(0.0, std::sin(1.0 * kDegree));
    EXPECT_GT(sunset[0], 1.5 * sunset[1]);
    EXPECT_GT(sunset[1], 1.5 * sunset[2]);
    EXPECT_GT(sun[0], 3.0 * sun[1]);
    EXPECT_GT(sun[1], 3.0 * sun[2]);
    // the sky of high mountains is darker, and night is dark
    EXPECT_LT(sky_at(9000.0, 90.0, 0.0, 50.0)[1], 0.6 * zenith[1]);
    EXPECT_LT(sky_at(0.0, 90.0, 0.0, -10.0)[1], 1e-3 * zenith[1]);
}

TEST(Atmosphere, SunAndSkyTogetherGiveNoMoreLightThanTheSunAboveTheAir) {
    for (const double elevation : {20.0, 45.0, 90.0}) {
        const double sine = std::sin(elevation * kDegree);
        const Atmosphere::Ambient sky = air().ambient(0.0, sine);
        const Rgb total = sky.up + sine * air().sunlight(0.0, sine);
        EXPECT_LT(total.maxCoeff(), 1.02 * sine) << elevation;
        EXPECT_GT(total.minCoeff(), 0.6 * sine) << elevation;
        EXPECT_GT(sky.up.minCoeff(), 0.0);
        EXPECT_GT(sky.up[2], sky.down[2]);
    }
}

TEST(Atmosphere, MapsAreFiniteForEverySunAndAltitude) {
    const Atmosphere thick(500.0), clear(std::numeric_limits<double>::infinity());
    for (const Atmosphere* atmosphere : {&air(), &thick, &clear}) {
        for (const double sun : {-1.0, -0.1, -1e-3, 0.0, 1.0}) {
            const Daylight light = make_daylight(*atmosphere, sun, 0.0);
            ASSERT_TRUE(std::isfinite(light.exposure) && light.exposure > 0.0) << sun;
            ASSERT_TRUE(light.up.allFinite() && light.side.allFinite() && light.down.allFinite());
            for (const double altitude : {0.0, 400'000.0}) {
                const SkyMaps maps = make_sky_maps(*atmosphere, altitude, sun, light.up);
                for (const std::vector<float>* map : {&maps.sky, &maps.air}) {
                    ASSERT_TRUE(std::all_of(
                        map->begin(), map->end(),
                        [](float value) { return std::isfinite(value) && value >= 0.0f; }))
                        << sun << " " << altitude;
                }
            }
        }
    }
}

}  // namespace atmosphere_test
}  // namespace terrane::internal

namespace terrane {
namespace atmosphere_picture_test {

using internal::Atmosphere;
using internal::Rgb;
using test::draw;
using test::pixel;

constexpr int kWidth = 96, kHeight = 64;

class AtmosphereTest : public test::PictureTest<kWidth, kHeight> {};

// The colour, 0 to 255, in which exposed light is displayed: see atmosphere.glsl.
double shown(double light) {
    const double x =
        std::min(light * (2.51 * light + 0.10) / (light * (2.43 * light + 0.59) + 0.14), 1.0);
    return 255.0 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055);
}

Eigen::Vector3d sun_at(double elevation_deg) {
    return direction_to_sun({1.0, elevation_deg * std::numbers::pi / 180.0});
}

// Unit direction of a pixel's centre.
Eigen::Vector3d direction_of(const View& view, int x, int y) {
    const double half = std::tan(0.5 * view.vertical_fov);
    return (view.forward +
            view.right() * (half * kWidth / kHeight * (2.0 * (x + 0.5) / kWidth - 1.0)) +
            view.up * (half * (1.0 - 2.0 * (y + 0.5) / kHeight)))
        .normalized();
}

// Azimuth's cosine between a direction and the sun.
double azimuth_cosine(const Eigen::Vector3d& direction, const Eigen::Vector3d& sun) {
    return direction.head<2>().normalized().dot(sun.head<2>().normalized());
}

TEST_F(AtmosphereTest, TheSkyIsTheExposedLightOfTheModel) {
    int compared = 0;
    for (const double elevation : {3.0, 45.0}) {
        const Eigen::Vector3d sun = sun_at(elevation);
        const RendererSettings settings{
            .sun_direction = sun, .sample_count = 1, .atmosphere = true};
        TerrainRenderer renderer = make(settings);
        const Atmosphere atmosphere(settings.haze_distance);
        const double exposure = internal::make_daylight(atmosphere, sun.z(), 0.0).exposure;
        for (const double altitude : {2.0, 3000.0, 30'000.0}) {
            const View view = view_from({0.0, 0.0, altitude}, {900.0, -300.0, altitude + 420.0});
            const Image image = draw(renderer, TerrainMesh{}, view);
            for (int y = 4; y < kHeight; y += 11) {
                for (int x = 4; x < kWidth; x += 17) {
                    const Eigen::Vector3d direction = direction_of(view, x, y);
                    if (direction.z() < internal::horizon_sine(altitude) + 0.01) continue;
                    const std::array<double, 1> cosine{azimuth_cosine(direction, sun)};
                    std::array<Rgb, 1> light;
                    atmosphere.sky({altitude, direction.z(), sun.z()}, Rgb::Zero(), cosine, light);
                    for (int part = 0; part < 3; ++part) {
                        ASSERT_NEAR(pixel(image, x, y)[part], shown(exposure * light[0][part]), 5.0)
                            << elevation << " " << altitude << " " << x << " " << y;
                        ++compared;
                    }
                }
            }
        }
    }
    EXPECT_GT(compared, 400);
}

// A black box shows only the light of the air before it.
TEST_F(AtmosphereTest,
       TheAirBeforeASurfaceIsTheExposedLightOfTheModelAndFarAwayTheSkyAtTheHorizon) {
    int compared = 0;
    for (const double elevation : {3.0, 45.0}) {
        const Eigen::Vector3d sun = sun_at(elevation);
        const RendererSettings settings{
            .sun_direction = sun, .sample_count = 1, .atmosphere = true};
        TerrainRenderer renderer = make(settings);
        const Atmosphere atmosphere(settings.haze_distance);
        const double exposure = internal::make_daylight(atmosphere, sun.z(), 0.0).exposure;
        for (const double altitude : {100.0, 2500.0}) {
            for (const double distance : {500.0, 8000.0, 50'000.0}) {
                const View view = view_from({0.0, 0.0, altitude},
                                            {distance, 0.0, altitude - 0.02 * distance}, 0.2);
                test::Solid box;
                box.colour = {0.0f, 0.0f, 0.0f};
                box.extents = {1.0, 0.2 * distance, 0.2 * distance};
                box.world_from_solid.translation = {distance + 1.0, 0.0, altitude};
                const Image image = draw(renderer, TerrainMesh{}, view, {&box, 1});
                const int x = kWidth / 2, y = kHeight / 2;
                const Eigen::Vector3d direction = direction_of(view, x, y);
                std::vector<double> bounds;
                for (int i = 1; i <= 40; ++i) bounds.push_back(distance / direction.x() * i / 40.0);
                const std::array<double, 1> cosine{azimuth_cosine(direction, sun)};
                std::vector<Rgb> light(bounds.size());
                atmosphere.scatter({altitude, direction.z(), sun.z()}, bounds, cosine, light);
                for (int part = 0; part < 3; ++part) {
                    ASSERT_NEAR(pixel(image, x, y)[part], shown(exposure * light.back()[part]), 6.0)
                        << elevation << " " << altitude << " " << distance << " " << part;
                    ++compared;
                }
            }
        }
        // a wall at the horizon, 400 km away, beside the sky
        const View level = view_from({0.0, 0.0, 100.0}, {1000.0, 0.0, 100.0}, 0.02);
        test::Solid wall;
        wall.colour = {0.0f, 0.0f, 0.0f};
        wall.extents = {1.0, 9e4, 1200.0};
        wall.world_from_solid.translation = {400'000.0, -9e4, 0.0};
        const Image image = draw(renderer, TerrainMesh{}, level, {&wall, 1});
        const int middle = kHeight / 2;
        for (int part = 0; part < 3; ++part) {
            EXPECT_NEAR(pixel(image, 10, middle)[part], pixel(image, kWidth - 10, middle)[part],
                        6.0)
                << elevation << " " << part;
        }
    }
    EXPECT_EQ(compared, 36);
}

TEST_F(AtmosphereTest, DrawsFromBelowTheGroundUpToOrbitByDayAndNight) {
    const test::Scene scene = test::make_scene();
    for (const double elevation : {-30.0, -2.0, 60.0}) {
        TerrainRenderer renderer =
            make({.sun_direction = sun_at(elevation), .sample_count = 1, .atmosphere = true});
        for (const double altitude : {-3000.0, 0.0, 400'000.0}) {
            const View view = view_from({128.0, -500.0, altitude}, {128.0, 5e5, altitude - 1.6e5});
            const Image image = draw(renderer, scene.mesh(), view);
            int brightest = 0;
            for (const std::uint8_t value : image.rgb) brightest = std::max<int>(brightest, value);
            if (elevation > 0.0) {
                EXPECT_GT(brightest, 60) << altitude;
            }
            // from orbit the day is in view
            if (elevation < -20.0 && altitude < 1e5) {
                EXPECT_LT(brightest, 20) << altitude;
            }
        }
    }
}

TEST_F(AtmosphereTest, StopsOfExposureAreFactorsOfTwo) {
    const View view = view_from({0.0, 0.0, 10.0}, {1000.0, 0.0, 500.0});
    RendererSettings settings{.sun_direction = sun_at(40.0), .sample_count = 1, .atmosphere = true};
    const Atmosphere atmosphere(settings.haze_distance);
    const double usual = internal::make_daylight(atmosphere, 0.5, 0.0).exposure;
    EXPECT_NEAR(internal::make_daylight(atmosphere, 0.5, 1.0).exposure, 2.0 * usual, 1e-9 * usual);
    TerrainRenderer first = make(settings);
    settings.exposure_stops = -1.0;
    TerrainRenderer second = make(settings);
    const Image bright = draw(first, TerrainMesh{}, view), dark = draw(second, TerrainMesh{}, view);
    EXPECT_GT(test::brightness(bright, 40, 30), 1.2 * test::brightness(dark, 40, 30));
}

// A dark box before the sky, turned so that its edges are neither level nor upright.
TEST_F(AtmosphereTest, SmoothedEdgesAreNearerToThoseOfSixteenSamples) {
    const View view = view_from({0.0, 0.0, 100.0}, {100.0, 0.0, 100.0}, 0.3);
    test::Solid box;
    box.extents = {1.0, 9.0, 4.0};
    box.colour = {0.05f, 0.05f, 0.05f};
    box.world_from_solid.translation = {100.0, 0.0, 100.0};
    box.world_from_solid.rotation =
        Eigen::AngleAxisd(0.13, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const auto picture = [&](int samples, bool is_smooth) {
        TerrainRenderer renderer = make({.sample_count = samples, .smooth_edges = is_smooth});
        if (samples > 1 && renderer.sample_count() == 1) return Image{};
        return draw(renderer, TerrainMesh{}, view, {&box, 1});
    };
    const Image exact = picture(16, false);
    if (exact.rgb.empty()) GTEST_SKIP() << "the device has one sample per pixel";
    const auto error = [&](const Image& image) {
        double sum = 0.0;
        for (std::size_t i = 0; i < image.rgb.size(); ++i)
            sum += std::abs(int{image.rgb[i]} - int{exact.rgb[i]});
        return sum;
    };
    const double rough = error(picture(1, false)), smooth = error(picture(1, true));
    EXPECT_GT(rough, 1000.0);
    EXPECT_LT(smooth, 0.6 * rough);
    // with several samples there is nothing to smooth
    EXPECT_EQ(test::count_different(exact, picture(16, true)), 0);
}

}  // namespace atmosphere_picture_test

namespace sun_position_test {

constexpr double kDegree = std::numbers::pi / 180.0;

// Seconds since 1970 of a day, counted from 1970-01-01, and a time of day.
double at(int days, int hour, int minute, double second = 0.0) {
    return 86400.0 * days + 3600.0 * hour + 60.0 * minute + second;
}
constexpr int kOctober1992 = 8321;    // 1992-10-13
constexpr int kOctober2003 = 12342;   // 2003-10-17
constexpr int kJune2026 = 20625;      // 2026-06-21
constexpr int kDecember2026 = 20808;  // 2026-12-21

TEST(SunPosition, AgreesWithPublishedExamples) {
    // Meeus, example 25.a: declination -7.78507 degrees; at the pole it is the elevation
    EXPECT_NEAR(sun_position(at(kOctober1992, 0, 0, -59.0), 0.0, 90.0).elevation / kDegree, -7.785,
                0.01);
    // I. Reda, A. Andreas, Solar Position Algorithm, NREL/TP-560-34302, 2008, table A5.1
    const SunPosition sun = sun_position(at(kOctober2003, 19, 30, 30.0), -105.1786, 39.742476);
    EXPECT_NEAR(sun.elevation / kDegree, 39.872, 0.02);
    EXPECT_NEAR(sun.azimuth / kDegree, 194.340, 0.02);
}

TEST(SunPosition, StandsAtTheSolsticesAsHighAsTheTropicsSay) {
    double summer = -90.0, winter = -90.0;
    for (int minute = 600; minute < 840; ++minute) {
        summer = std::max(summer,
                          sun_position(at(kJune2026, 0, minute), 0.0, 51.4779).elevation / kDegree);
        winter = std::max(
            winter, sun_position(at(kDecember2026, 0, minute), 0.0, 51.4779).elevation / kDegree);
    }
    EXPECT_NEAR(summer, 90.0 - 51.4779 + 23.436, 0.02);
    EXPECT_NEAR(winter, 90.0 - 51.4779 - 23.436, 0.02);
    EXPECT_NEAR(sun_position(at(kJune2026, 12, 2), 0.0, 51.4779).azimuth / kDegree, 180.0, 0.5);
}

// Sunrise and sunset of almanacs are to the minute, for the upper edge of the disc with refraction: -0.833 degrees.
TEST(SunPosition, RisesAndSetsAtTheTimesOfAlmanacs) {
    const auto elevation = [](double time, double longitude, double latitude) {
        return sun_position(time, longitude, latitude).elevation / kDegree;
    };
    EXPECT_NEAR(elevation(at(kJune2026, 3, 43), -0.1278, 51.5074), -0.833, 0.2);
    EXPECT_NEAR(elevation(at(kJune2026, 20, 21), -0.1278, 51.5074), -0.833, 0.2);
    EXPECT_NEAR(elevation(at(kDecember2026, 12, 17), -74.006, 40.7128), -0.833, 0.2);
    EXPECT_NEAR(elevation(at(kDecember2026, 21, 32), -74.006, 40.7128), -0.833, 0.2);
    EXPECT_NEAR(elevation(at(kDecember2026 - 1, 18, 41), 151.2093, -33.8688), -0.833, 0.3);
    EXPECT_NEAR(elevation(at(kDecember2026, 9, 5), 151.2093, -33.8688), -0.833, 0.3);
}

TEST(SunPosition, IsTurnedIntoTheWorldByTheConvergence) {
    const Eigen::Vector3d east = direction_to_sun({90.0 * kDegree, 0.0});
    EXPECT_NEAR((east - Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-12);
    // true north is where world x is negative
    const Eigen::Vector3d north = direction_to_sun({0.0, 0.0}, 90.0 * kDegree);
    EXPECT_NEAR((north + Eigen::Vector3d::UnitX()).norm(), 0.0, 1e-12);
    EXPECT_NEAR(direction_to_sun({2.0, 0.6}, 0.1).z(), std::sin(0.6), 1e-12);
}

}  // namespace sun_position_test
}  // namespace terrane
