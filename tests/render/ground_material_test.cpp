// SPDX-License-Identifier: MIT
#include "light/ground_materials.h"
#include "render/render_scene.h"

#include <terrane/render/terrain_renderer.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace terrane {
void PrintTo(GroundPalette palette, std::ostream* out) { *out << static_cast<int>(palette); }
}  // namespace terrane

namespace terrane::internal {
namespace ground_material_test {

using test::count_different;
using test::make_plane_scene;
using test::pixel;
using test::Scene;

constexpr std::array kPalettes{GroundPalette::alpine, GroundPalette::temperate,
                               GroundPalette::desert, GroundPalette::moon, GroundPalette::imagery};

TEST(MaterialLayers, HaveMeanOneHalfAndContrastInEveryChannel) {
    for (int layer = 0; layer < kMaterialLayers; ++layer) {
        const auto texels = make_material_layer(GroundPalette::alpine, layer);
        for (std::size_t channel = 0; channel < 4; ++channel) {
            double sum = 0.0, squares = 0.0;
            for (std::size_t i = channel; i < texels.size(); i += 4) {
                sum += texels[i];
                squares += 1.0 * texels[i] * texels[i];
            }
            const double count = 0.25 * static_cast<double>(texels.size());
            EXPECT_NEAR(sum / count / 255.0, 0.5, 0.02) << layer << ", " << channel;
            EXPECT_NEAR(std::sqrt(squares / count - sum / count * (sum / count)) / 255.0, 0.2, 0.03)
                << layer << ", " << channel;
        }
    }
}

TEST(MaterialPlaces, AreThoseOfTheEyeAtAnyDistanceFromTheOrigin) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    Lattice lattice{.spacing = 0x1p-5, .finest_level = 3};
    for (int i = 0; i < 1000; ++i) {
        // exact: the period is a whole number of spacings
        const std::int64_t most = std::int64_t{1} << (20 + i % 17);
        std::uniform_int_distribution<std::int64_t> any(-most, most);
        EyeFrame eye{.x = any(random), .y = any(random)};
        eye.remainder_x = 0x1p-8;
        MaterialUniforms made;
        set_material_places(lattice, eye, made);
        std::int64_t period = 32;
        for (std::size_t scale = 0; scale < kMaterialScales; ++scale, period *= 8) {
            const std::int64_t inside = ((eye.x % period) + period) % period;
            ASSERT_EQ(made.cell[scale][0], static_cast<std::int32_t>((eye.x - inside) / period));
            const double wanted = (static_cast<double>(inside) + 0x1p-8 / lattice.spacing) /
                                  static_cast<double>(period);
            ASSERT_NEAR(made.place[scale][0], wanted, 1e-7);
        }
    }
}

constexpr int kWidth = 320, kHeight = 256;

// The picture's brightness, 0 to 1, of a square of 128 pixels.
constexpr int kSquare = 128;
std::vector<double> square_of(const Image& image, int left, int top) {
    std::vector<double> values;
    for (int y = top; y < top + kSquare; ++y) {
        for (int x = left; x < left + kSquare; ++x)
            values.push_back(test::brightness(image, x, y) / 765.0);
    }
    return values;
}

// Discrete Fourier transform of a square along both axes, by the definition; inverse, without the factor, if `sign` is
// 1.
using Spectrum = std::vector<std::complex<double>>;
Spectrum transform(const Spectrum& values, int sign) {
    std::vector<std::complex<double>> turns;
    for (int i = 0; i < kSquare; ++i)
        turns.push_back(std::polar(1.0, sign * 2.0 * std::numbers::pi * i / kSquare));
    const auto along = [&](const Spectrum& in, int step, int stride) {
        Spectrum out(in.size());
        for (int line = 0; line < kSquare; ++line) {
            for (int k = 0; k < kSquare; ++k) {
                std::complex<double> sum = 0.0;
                for (int i = 0; i < kSquare; ++i)
                    sum += in[static_cast<std::size_t>(line * stride + i * step)] *
                           turns[static_cast<std::size_t>(i * k % kSquare)];
                out[static_cast<std::size_t>(line * stride + k * step)] = sum;
            }
        }
        return out;
    };
    return along(along(values, 1, kSquare), kSquare, 1);
}

// Power of the waves of 2 to 8 pixels in a square, relative to its squared mean.
double fine_energy(const std::vector<double>& values) {
    double mean = 0.0;
    for (const double value : values) mean += value / static_cast<double>(values.size());
    Spectrum windowed;
    for (int y = 0; y < kSquare; ++y) {
        for (int x = 0; x < kSquare; ++x) {
            // Hann's window
            const double u = std::sin(std::numbers::pi * (x + 0.5) / kSquare);
            const double v = std::sin(std::numbers::pi * (y + 0.5) / kSquare);
            windowed.emplace_back(u * u * v * v * (values[windowed.size()] / mean - 1.0));
        }
    }
    const Spectrum spectrum = transform(windowed, -1);
    double energy = 0.0;
    for (int y = 0; y < kSquare; ++y) {
        for (int x = 0; x < kSquare; ++x) {
            const double waves = std::hypot(std::min(x, kSquare - x), std::min(y, kSquare - y));
            if (waves >= kSquare / 8.0)
                energy += std::norm(spectrum[static_cast<std::size_t>(y * kSquare + x)]);
        }
    }
    return energy / std::pow(kSquare, 4.0);
}

// Largest autocorrelation of a square at lags of at least `least` pixels along an axis, relative to that at 0.
double largest_repeat(const std::vector<double>& values, int least) {
    double mean = 0.0;
    for (const double value : values) mean += value / static_cast<double>(values.size());
    Spectrum centred;
    for (const double value : values) centred.emplace_back(value - mean);
    Spectrum power = transform(centred, -1);
    for (std::complex<double>& value : power) value = std::norm(value);
    const Spectrum correlation = transform(power, 1);
    double largest = 0.0;
    for (int y = 0; y < kSquare; ++y) {
        for (int x = 0; x < kSquare; ++x) {
            if (std::max(std::min(x, kSquare - x), std::min(y, kSquare - y)) < least) continue;
            largest =
                std::max(largest, correlation[static_cast<std::size_t>(y * kSquare + x)].real());
        }
    }
    return largest / correlation[0].real();
}

class GroundMaterialTest : public test::PictureTest<kWidth, kHeight> {
protected:
    TerrainRenderer make(const GroundLookSettings& look, RendererSettings settings = {}) {
        settings.sample_count = 1;
        settings.ground_look = look;
        return PictureTest::make(settings);
    }
    // The middle of a plane from above; a pixel has the given size on the ground.
    static View view_down(const Scene& scene, double pixel_m) {
        const Lattice& lattice = scene.resident->lattice();
        const double x = 0.5 * (lattice.x(lattice.west()) + lattice.x(lattice.east()));
        const double y = 0.5 * (lattice.y(lattice.south()) + lattice.y(lattice.north()));
        const double height = pixel_m * kHeight / (2.0 * std::tan(0.05));
        return view_from({x, y, height}, {x, y, 0.0}, 0.1);
    }
};

TEST_F(GroundMaterialTest, EachPaletteGivesTheSameBitsAgainAndAnotherPictureThanTheOthers) {
    const Scene scene = test::make_scene();
    const View view = view_from({60.0, 60.0, 25.0}, {200.0, 150.0, 0.0});
    std::vector<Image> pictures;
    TerrainRenderer tints = PictureTest::make({.sample_count = 1});
    pictures.push_back(test::draw(tints, scene.mesh(), view));
    for (const GroundPalette palette : kPalettes) {
        SCOPED_TRACE(static_cast<int>(palette));
        TerrainRenderer renderer = make({.palette = palette});
        EXPECT_GT(renderer.buffer_bytes(), 9'000'000u);
        pictures.push_back(test::draw(renderer, scene.mesh(), view));
        EXPECT_EQ(count_different(test::draw(renderer, scene.mesh(), view), pictures.back()), 0);
        for (std::size_t i = 0; i + 1 < pictures.size(); ++i)
            EXPECT_GT(count_different(pictures[i], pictures.back(), 4), kWidth * kHeight / 10);
    }
}

TEST_F(GroundMaterialTest, SnowLiesAboveItsLineAndRockOnSteepSlopes) {
    TerrainRenderer renderer = make({.snow_line = 100.0, .rock_slope = 1.0});
    const auto mean_of = [&](double height, double slope) {
        const Scene scene = make_plane_scene(height, slope);
        const Image image =
            test::draw(renderer, scene.mesh(),
                       view_from({256.0, 128.0, height + 60.0}, {256.0, 128.0, height}, 0.3));
        std::array<double, 3> mean{};
        for (std::size_t i = 0; i < image.rgb.size(); ++i)
            mean[i % 3] += 3.0 * image.rgb[i] / static_cast<double>(image.rgb.size());
        return mean;
    };
    const auto low = mean_of(-400.0, 0.0), high = mean_of(900.0, 0.0), steep = mean_of(-400.0, 3.0);
    EXPECT_GT(high[0], 190.0);
    EXPECT_LT(low[0], 150.0);
    EXPECT_GT(low[1] - low[2], 30.0);  // green
    EXPECT_LT(std::abs(steep[1] - steep[2]), 25.0);
}

TEST_F(GroundMaterialTest, FlatMaterialsHaveTheirColoursWithoutDetailUntilTheyEnd) {
    TerrainRenderer renderer = make({.snow_line = 100.0, .rock_slope = 1.0});
    const auto expect_colour = [&](const Scene& scene, const View& view, const char* name) {
        SCOPED_TRACE(name);
        renderer.set_flat_materials(false);
        const Image before = test::draw(renderer, scene.mesh(), view);
        renderer.set_flat_materials(true);
        const Image flat = test::draw(renderer, scene.mesh(), view);
        EXPECT_LT(fine_energy(square_of(flat, 96, 64)),
                  0.01 * fine_energy(square_of(before, 96, 64)));
        // the hue is nearest to that of its colour
        const std::uint8_t* const rgb = pixel(flat, kWidth / 2, kHeight / 2);
        const auto distance = [rgb](const FlatMaterial& material) {
            const Colour& colour = material.colour;
            return std::hypot(1.0 * rgb[0] / rgb[1] - colour.red / colour.green,
                              1.0 * rgb[2] / rgb[1] - colour.blue / colour.green);
        };
        EXPECT_EQ(std::ranges::min(kFlatMaterials, {}, distance).name, std::string(name));
        renderer.set_flat_materials(false);
        EXPECT_EQ(count_different(test::draw(renderer, scene.mesh(), view), before), 0);
    };
    const auto over = [&](double height) {
        return view_from({256.0, 128.0, height + 60.0}, {256.0, 128.0, height}, 0.3);
    };
    expect_colour(make_plane_scene(900.0, 0.0), over(900.0), "snow");
    expect_colour(make_plane_scene(-400.0, 3.0), over(-400.0), "rock");
}

TEST_F(GroundMaterialTest, NearGroundHasAsMuchFineDetailAsThatAtMiddleDistances) {
    const Scene scene = make_plane_scene();
    for (const GroundPalette palette : kPalettes) {
        SCOPED_TRACE(static_cast<int>(palette));
        TerrainRenderer renderer = make({.palette = palette});
        const auto energy_from = [&](double height, double ahead) {
            const View view = view_from({256.0, 60.0, height}, {256.0, 60.0 + ahead, 0.0});
            return fine_energy(square_of(test::draw(renderer, scene.mesh(), view), 96, 64));
        };
        const double near = energy_from(2.0, 3.0), middle = energy_from(40.0, 120.0);
        RecordProperty("near", std::to_string(near));
        RecordProperty("middle", std::to_string(middle));
        EXPECT_GE(near, middle);
        EXPECT_GT(middle, 0.0);
    }
}

// Of lags of 250 m or more: patches of one material are smaller.
TEST_F(GroundMaterialTest, DoesNotRepeatOverTwoKilometres) {
    const Scene scene = make_plane_scene(0.0, 0.0, 16.0);
    for (const GroundPalette palette : kPalettes) {
        SCOPED_TRACE(static_cast<int>(palette));
        TerrainRenderer renderer = make({.palette = palette});
        const Image image = test::draw(renderer, scene.mesh(), view_down(scene, 2000.0 / kSquare));
        const double repeat = largest_repeat(square_of(image, 96, 64), 16);
        RecordProperty("repeat", std::to_string(repeat));
        EXPECT_LT(repeat, 0.2);
    }
}

// Two pictures of an eye that moves by ten pixels, one at the origin and one far away.
TEST_F(GroundMaterialTest, DetailStaysOnTheGroundFarFromTheOrigin) {
    for (const std::int32_t roots_east : {0, 1 << 22}) {
        SCOPED_TRACE(roots_east);
        const Scene scene = make_plane_scene(0.0, 0.0, 2.0, roots_east);
        TerrainRenderer renderer = make({});
        View view = view_down(scene, 0x1p-7);
        const Image first = test::draw(renderer, scene.mesh(), view);
        view.eye_world.x() += 10.0 * 0x1p-7;
        const Image second = test::draw(renderer, scene.mesh(), view);
        double difference = 0.0, contrast = 0.0;
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 10; x < kWidth; ++x) {
                difference += std::abs(int{*pixel(second, x - 10, y)} - int{*pixel(first, x, y)});
                contrast += std::abs(int{*pixel(first, x, y)} - int{*pixel(first, x - 10, y)});
            }
        }
        EXPECT_LT(difference, 0.1 * contrast);
    }
}

TEST_F(GroundMaterialTest, WavesMoveWithTheTimeAndOnlyWithIt) {
    const Scene scene = make_plane_scene(-20.0);
    const View view = view_from({256.0, 20.0, 12.0}, {256.0, 100.0, 0.0});
    for (const bool has_waves : {false, true}) {
        TerrainRenderer renderer = make({}, {.water_level = 0.0, .has_waves = has_waves});
        std::vector<Image> pictures;
        for (const double time : {0.0, 2.5, 0.0}) {
            ASSERT_TRUE(renderer.set_time(time));
            pictures.push_back(test::draw(renderer, scene.mesh(), view));
        }
        EXPECT_EQ(count_different(pictures[0], pictures[2]), 0);
        EXPECT_EQ(count_different(pictures[0], pictures[1]) > kWidth * kHeight / 4, has_waves);
        const Result<void> set = renderer.set_time(std::numeric_limits<double>::infinity());
        ASSERT_FALSE(set);
        EXPECT_EQ(set.error().message, "the time must be finite, got inf");
    }
}

TEST_F(GroundMaterialTest, GroundAtTheLevelOfWavesIsASeaWithoutABottom) {
    const View view = view_from({256.0, 100.0, 40.0}, {256.0, 130.0, 0.0}, 0.5);
    const auto picture_of = [&](double height, GroundPalette palette) {
        const Scene scene = make_plane_scene(height);
        TerrainRenderer renderer =
            make({.palette = palette}, {.water_level = 0.0, .has_waves = true});
        return test::draw(renderer, scene.mesh(), view);
    };
    const Image sea = picture_of(0.0, GroundPalette::desert);
    // the same over any ground, and darker than a metre of water over sand
    EXPECT_EQ(count_different(sea, picture_of(0.0, GroundPalette::moon), 2), 0);
    const Image shallow = picture_of(-1.0, GroundPalette::desert);
    EXPECT_LT(test::brightness(sea, 160, 128) + 30, test::brightness(shallow, 160, 128));
}

TEST_F(GroundMaterialTest, SettingsOutOfRangeAreRefusedInOneLine) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const auto& [look, words] : std::vector<std::pair<GroundLookSettings, const char*>>{
             {{.snow_line = nan}, "snow_line must be within 1e9 m, got nan"},
             {{.rock_slope = -1.0}, "rock_slope must be 0 to 100, got -1"},
             {{.occlusion = 1.5}, "occlusion must be 0 to 1, got 1.5"},
             {{.anisotropy = 0}, "anisotropy must be 1 to 16, got 0"}}) {
        const auto made = TerrainRenderer::create(*context_, 16, 16, {.ground_look = look});
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().message, words);
    }
}

}  // namespace ground_material_test
}  // namespace terrane::internal
