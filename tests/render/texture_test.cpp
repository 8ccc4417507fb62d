// SPDX-License-Identifier: MIT
//
// Textures of objects: mipmaps against slow means, and pictures of quads against quads without textures whose vertices
// have the same colours or normals.
#include "objects/mipmaps.h"
#include "render/render_scene.h"
#include "support/meshes.h"
#include "support/random.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/progressive_mesh.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace terrane::internal {
namespace mipmaps_test {

double linear_of(int level) {
    const double display = level / 255.0;
    return display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
}

double level_of(double linear) {
    const double display =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
    return 255.0 * display;
}

TextureImage random_image(int width, int height, std::uint64_t seed) {
    test::Random random(seed);
    TextureImage image = {width, height, {}};
    for (int i = 0; i < 4 * width * height; ++i)
        image.rgba.push_back(static_cast<std::uint8_t>(random.below(256)));
    return image;
}

int at(const TextureImage& image, int x, int y, int channel) {
    return image.rgba[static_cast<std::size_t>(4 * (y * image.width + x) + channel)];
}

// The mean of a channel over a pixel of a mipmap, by areas of overlap.
double mean_over(const TextureImage& image, const TextureImage& mipmap, int x, int y, int channel,
                 bool is_linear) {
    const double width = static_cast<double>(image.width) / mipmap.width,
                 height = static_cast<double>(image.height) / mipmap.height;
    double sum = 0.0;
    for (int j = 0; j < image.height; ++j) {
        const double down = std::min((y + 1) * height, j + 1.0) - std::max(y * height, 1.0 * j);
        for (int i = 0; i < image.width; ++i) {
            const double across = std::min((x + 1) * width, i + 1.0) - std::max(x * width, 1.0 * i);
            if (down <= 0.0 || across <= 0.0) continue;
            const int value = at(image, i, j, channel);
            sum += down * across * (is_linear ? linear_of(value) : value / 255.0);
        }
    }
    return sum / (width * height);
}

TEST(Mipmaps, AreMeansOverTheAreaOfTheirPixels) {
    for (const auto& [width, height] : {std::pair(16, 16), std::pair(13, 7), std::pair(1, 9)}) {
        const TextureImage image = random_image(width, height, 3);
        for (const TextureUse use : {TextureUse::colour, TextureUse::data}) {
            const std::vector<TextureImage> mipmaps = make_mipmaps(image, use, {}, 0);
            ASSERT_EQ(mipmaps.size(), static_cast<std::size_t>(mipmap_count(width, height)));
            EXPECT_EQ(mipmaps[0].rgba, image.rgba);
            EXPECT_EQ(mipmaps.back().rgba.size(), 4u);
            // the first mipmap is a mean of the image; the others are means of means, weighted alike only if even
            const std::size_t most = width == height ? mipmaps.size() : 2;
            for (std::size_t level = 1; level < most; ++level) {
                const TextureImage& mipmap = mipmaps[level];
                for (int y = 0; y < mipmap.height; ++y) {
                    for (int x = 0; x < mipmap.width; ++x) {
                        for (int k = 0; k < 4; ++k) {
                            const bool is_linear = use == TextureUse::colour && k < 3;
                            const double mean = mean_over(image, mipmap, x, y, k, is_linear);
                            EXPECT_NEAR(at(mipmap, x, y, k),
                                        is_linear ? level_of(mean) : 255.0 * mean, 0.6);
                        }
                    }
                }
            }
        }
    }
}

TEST(Mipmaps, FromALaterOneOnAreTheLastOfAll) {
    const TextureImage image = random_image(24, 40, 8);
    const auto all = make_mipmaps(image, TextureUse::colour, 0.4f, 0),
               last = make_mipmaps(image, TextureUse::colour, 0.4f, 3);
    ASSERT_EQ(last.size() + 3, all.size());
    for (std::size_t i = 0; i < last.size(); ++i) EXPECT_EQ(last[i].rgba, all[i + 3].rgba);
    EXPECT_EQ(mipmap_bytes(24, 40, 4), 4u * (1 * 2 + 1 * 1));
}

TEST(Mipmaps, OfBlendedColoursAreWeightedByOpacity) {
    const TextureImage image = random_image(16, 16, 4);
    const TextureImage mipmap = make_mipmaps(image, TextureUse::blended, {}, 0)[1];
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            double light = 0.0, opacity = 0.0;
            for (int i = 0; i < 4; ++i) {
                const int column = 2 * x + i % 2, row = 2 * y + i / 2;
                light += at(image, column, row, 3) * linear_of(at(image, column, row, 1));
                opacity += at(image, column, row, 3);
            }
            EXPECT_NEAR(at(mipmap, x, y, 1), level_of(light / opacity), 0.6);
            EXPECT_NEAR(at(mipmap, x, y, 3), opacity / 4.0, 0.6);
        }
    }
}

// Blades of grass: opaque strips of two pixels in twelve, which plain means would lose.
TextureImage grass(int side) {
    TextureImage image = {side, side, {}};
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            const bool is_blade = (x + y / 3) % 12 < 2;
            for (const int level :
                 {is_blade ? 40 : 250, is_blade ? 160 : 0, 30, is_blade ? 255 : 0})
                image.rgba.push_back(static_cast<std::uint8_t>(level));
        }
    }
    return image;
}

TEST(Mipmaps, KeepTheShareOfPixelsThatACutDraws) {
    const TextureImage image = grass(96);
    const float cutoff = 0.5f;
    const auto share_of = [&](const TextureImage& mipmap) {
        int count = 0;
        for (std::size_t i = 3; i < mipmap.rgba.size(); i += 4)
            count += static_cast<float>(mipmap.rgba[i]) / 255.0f >= cutoff ? 1 : 0;
        return static_cast<double>(count) / (mipmap.width * mipmap.height);
    };
    const double share = share_of(image);
    EXPECT_NEAR(share, 2.0 / 12.0, 1e-9);
    const auto kept = make_mipmaps(image, TextureUse::colour, cutoff, 0),
               plain = make_mipmaps(image, TextureUse::colour, {}, 0);
    for (std::size_t level = 1; level < kept.size(); ++level) {
        const int count = kept[level].width * kept[level].height;
        // pixels of equal opacity are kept together
        EXPECT_GE(share_of(kept[level]), share - 0.5 / count) << level;
        if (count >= 36) {
            EXPECT_LE(share_of(kept[level]), 2.2 * share) << level;
        }
        // the colour of the blades, not of what is cut
        for (std::size_t i = 0; i < kept[level].rgba.size(); i += 4) {
            if (kept[level].rgba[i + 3] == 0) continue;
            EXPECT_NEAR(kept[level].rgba[i], 40, 1);
            EXPECT_NEAR(kept[level].rgba[i + 1], 160, 1);
        }
    }
    EXPECT_EQ(share_of(plain[3]), 0.0);
}

TEST(TextureBudget, DropsTheFinestMipmapsOfTheLeastRecentlyDrawnThenOfTheLargest) {
    const std::size_t large = mipmap_bytes(256, 256, 0), small = mipmap_bytes(64, 64, 0);
    const std::vector<TextureDemand> textures = {
        {64, 64, 0, 7}, {256, 256, 0, 7}, {256, 256, 0, 5}, {64, 64, 0, 9}};
    const std::size_t sum = 2 * large + 2 * small;
    using Firsts = std::vector<int>;
    EXPECT_EQ(choose_first_mipmaps(textures, sum), Firsts({0, 0, 0, 0}));
    EXPECT_EQ(choose_first_mipmaps(textures, sum - 1), Firsts({0, 0, 1, 0}));
    // the oldest one becomes as small as it may, 32 pixels, before another one shrinks
    const std::size_t oldest = mipmap_bytes(256, 256, 3);
    EXPECT_EQ(choose_first_mipmaps(textures, large + oldest + 2 * small), Firsts({0, 0, 3, 0}));
    EXPECT_EQ(choose_first_mipmaps(textures, large + oldest + 2 * small - 1), Firsts({0, 1, 3, 0}));
    EXPECT_EQ(choose_first_mipmaps(textures, 0), Firsts({1, 3, 3, 1}));
    // what the device cannot hold is never chosen
    EXPECT_EQ(choose_first_mipmaps(std::vector<TextureDemand>{{4096, 16, 2, 1}}, sum), Firsts({2}));
    EXPECT_TRUE(choose_first_mipmaps({}, 0).empty());
}

}  // namespace mipmaps_test
}  // namespace terrane::internal

namespace terrane {
namespace texture_test {

using test::count_different;
using test::draw;
using test::instance_at;
using test::largest_difference;
using test::pixel;

constexpr int kWidth = 160, kHeight = 120;

class TextureTest : public test::PictureTest<kWidth, kHeight> {};

std::shared_ptr<const TextureImage> image_of(int width, int height,
                                             const std::vector<std::array<int, 4>>& texels) {
    TextureImage image = {width, height, {}};
    for (const std::array<int, 4>& texel : texels) {
        for (const int level : texel) image.rgba.push_back(static_cast<std::uint8_t>(level));
    }
    return std::make_shared<const TextureImage>(std::move(image));
}

// A square of 2 m in the plane y = 0, facing south, with texture coordinates from 0 to `repeats`.
TriangleMesh square(float repeats = 1.0f) {
    TriangleMesh mesh;
    mesh.positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    mesh.texture_coordinates = {{0, 0}, {repeats, 0}, {repeats, repeats}, {0, repeats}};
    mesh.normals.assign(4, -Eigen::Vector3f::UnitY());
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

TriangleMesh coloured(TriangleMesh mesh, std::array<std::uint8_t, 4> colour) {
    mesh.colours.assign(mesh.positions.size(), colour);
    return mesh;
}

// A view of the square from the south that shows it 100 pixels wide at a distance of 10 m.
View view_from_south(double distance = 10.0) {
    const double fov = 2.0 * std::atan(0.5 * kHeight / 100.0 * 2.0 / 10.0);
    return look_at({0, -distance, 0}, {0, 0, 0}, fov, kWidth, kHeight).value();
}

RendererSettings settings_of(int sample_count = 1) {
    return {.sun_direction = {0.3, -0.8, 0.5},
            .haze_distance = std::numeric_limits<double>::infinity(),
            .sample_count = sample_count};
}

Image picture_of(TerrainRenderer& renderer, MeshId id, const View& view) {
    const ObjectInstance instance = instance_at(view, {0, 0, 0});
    const MeshDraw one = {id, 0, 0, 1};
    return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}});
}

void expect_near(const std::uint8_t* rgb, const std::uint8_t* expected, int by,
                 const std::string& where) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(rgb[k], expected[k], by) << where << " channel " << k;
}

// The corners of the cube of colours, which are the same in linear light as for display.
const std::vector<std::array<int, 4>> kCorners = {
    {0, 0, 0, 255},   {255, 0, 0, 255},   {0, 255, 0, 255},   {255, 255, 0, 255},
    {0, 0, 255, 255}, {255, 0, 255, 255}, {0, 255, 255, 255}, {255, 255, 255, 255}};

TEST_F(TextureTest, ShowsItsTexelsInFullAndInOrder) {
    TerrainRenderer renderer = make(settings_of());
    std::vector<std::array<int, 4>> texels = kCorners;
    texels.insert(texels.end(), kCorners.rbegin(), kCorners.rend());
    MeshMaterial material;
    material.colour_texture.image = image_of(4, 4, texels);
    const TriangleMesh white = coloured(square(), {255, 255, 255, 255});
    const View view = view_from_south();
    const Image image = picture_of(renderer, renderer.add_mesh(white, {}, material).value(), view);
    for (std::size_t i = 0; i < kCorners.size(); ++i) {
        const auto& [red, green, blue, opacity] = kCorners[i];
        const TriangleMesh plain =
            coloured(square(), {static_cast<std::uint8_t>(red), static_cast<std::uint8_t>(green),
                                static_cast<std::uint8_t>(blue), 255});
        const Image expected = picture_of(renderer, renderer.add_mesh(plain).value(), view);
        for (const std::size_t place : {i, texels.size() - 1 - i}) {
            // the middle of the texel; the square's upper left corner is at (30, 10)
            const int x = 30 + 25 * static_cast<int>(place % 4) + 12,
                      y = 10 + 25 * static_cast<int>(place / 4) + 12;
            expect_near(pixel(image, x, y), pixel(expected, x, y), 1,
                        "texel " + std::to_string(place));
        }
    }
}

TEST_F(TextureTest, IsDecodedFromDisplayColoursAndMultipliesTheVertices) {
    TerrainRenderer renderer = make(settings_of());
    MeshMaterial material;
    material.colour_texture.image = image_of(1, 1, {{188, 137, 99, 255}});
    const View view = view_from_south();
    const TriangleMesh white = coloured(square(), {255, 255, 255, 255});
    const Image image = picture_of(renderer, renderer.add_mesh(white, {}, material).value(), view);
    // 188, 137 and 99 are 0.503, 0.251 and 0.125 linear; vertices have a gamma of 2.2
    const Image expected = picture_of(
        renderer, renderer.add_mesh(coloured(square(), {187, 136, 99, 255})).value(), view);
    EXPECT_LE(largest_difference(image, expected), 1);
    const Image darker = picture_of(
        renderer, renderer.add_mesh(coloured(square(), {187, 187, 187, 255}), {}, material).value(),
        view);
    const Image half = picture_of(
        renderer, renderer.add_mesh(coloured(square(), {136, 99, 72, 255})).value(), view);
    EXPECT_LE(largest_difference(darker, half), 2);
}

TEST_F(TextureTest, BecomesTheMeanOfItsLightWithDistance) {
    TerrainRenderer renderer = make(settings_of(4));
    std::vector<std::array<int, 4>> texels;
    for (int i = 0; i < 64 * 64; ++i) {
        const int level = (i + i / 64) % 2 * 255;
        texels.push_back({level, level, level, 255});
    }
    MeshMaterial material;
    material.colour_texture.image = image_of(64, 64, texels);
    const View view = view_from_south(50.0);  // 20 pixels
    const TriangleMesh mesh = coloured(square(4.0f), {255, 255, 255, 255});
    const Image image = picture_of(renderer, renderer.add_mesh(mesh, {}, material).value(), view);
    // half the light, 0.5 = (186 / 255)^2.2
    const Image expected = picture_of(
        renderer, renderer.add_mesh(coloured(square(), {186, 186, 186, 255})).value(), view);
    EXPECT_LE(largest_difference(image, expected), 3);
}

TEST_F(TextureTest, WrapsAsItsMaterialSays) {
    TerrainRenderer renderer = make(settings_of());
    const TriangleMesh mesh = coloured(square(2.0f), {255, 255, 255, 255});
    const View view = view_from_south();
    // red on the left of each copy
    const auto colours_of = [&](TextureWrap wrap) {
        MeshMaterial material;
        material.colour_texture = {.image = image_of(2, 1, {{255, 0, 0, 255}, {0, 0, 255, 255}}),
                                   .wrap_right = wrap};
        const MeshId id = renderer.add_mesh(mesh, {}, material).value();
        const Image image = picture_of(renderer, id, view);
        std::string letters;
        for (const int x : {42, 67, 92, 117}) {
            const std::uint8_t* rgb = pixel(image, x, 60);
            letters += rgb[0] > rgb[2] ? 'r' : 'b';
        }
        return letters;
    };
    EXPECT_EQ(colours_of(TextureWrap::repeat), "rbrb");
    EXPECT_EQ(colours_of(TextureWrap::mirror), "rbbr");
    EXPECT_EQ(colours_of(TextureWrap::clamp), "rbbb");
}

TEST_F(TextureTest, IsCutWhereItsOpacityIsBelowTheCutoff) {
    const View view = view_from_south();
    for (const int samples : {1, 4}) {
        TerrainRenderer renderer = make(settings_of(samples));
        const Image sky = draw(renderer, view, {});
        MeshMaterial material;
        material.colour_texture.image = image_of(2, 1, {{90, 200, 90, 255}, {90, 200, 90, 20}});
        material.colour_texture.wrap_right = TextureWrap::clamp;
        const MeshId opaque = renderer.add_mesh(square(), {}, material).value();
        EXPECT_EQ(count_different(picture_of(renderer, opaque, view), sky), 100 * 100);
        for (const float cutoff : {0.3f, 0.5f, 0.9f}) {
            material.alpha_cutoff = cutoff;
            const Image image =
                picture_of(renderer, renderer.add_mesh(square(), {}, material).value(), view);
            // opacity falls from 1 to 20 / 255 between the middles of the texels, from 25 to 75 pixels
            const double edge =
                25.0 + 50.0 * (1.0 - static_cast<double>(cutoff)) / (1.0 - 20.0 / 255.0);
            EXPECT_NEAR(count_different(image, sky) / 100.0, edge, 1.0)
                << cutoff << " with " << samples << " samples";
        }
    }
}

TEST_F(TextureTest, CastsTheShadowOfWhatTheCutLeaves) {
    const test::Scene ground = test::make_plane_scene();
    const WorldPos place(256.0, 128.0, 2.0);
    const View view =
        look_at({256.0, 127.9, 40.0}, {256.0, 128.0, 0.0}, 0.3, kWidth, kHeight).value();
    TriangleMesh flat;  // level, 4 m wide
    flat.positions = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
    flat.texture_coordinates = square().texture_coordinates;
    flat.triangles = {{0, 1, 2}, {0, 2, 3}};
    const auto dark_pixels = [&](std::optional<float> cutoff) {
        MeshMaterial material;
        material.colour_texture = {.image = image_of(2, 1, {{99, 99, 99, 255}, {99, 99, 99, 0}}),
                                   .wrap_right = TextureWrap::clamp};
        material.alpha_cutoff = cutoff;
        Image images[2];
        for (const bool has_shadows : {false, true}) {
            TerrainRenderer renderer = make({.sun_direction = {-1.0, 0.0, 0.4},
                                             .sample_count = 1,
                                             .shadow_distance = has_shadows ? 100.0 : 0.0});
            const MeshId id = renderer.add_mesh(flat, {}, material).value();
            const ObjectInstance instance = instance_at(view, place);
            const MeshDraw one = {id, 0, 0, 1};
            images[has_shadows] = draw(
                renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}}, ground.mesh());
        }
        int count = 0;
        // east of the square, where its shadow falls
        for (int y = 0; y < kHeight; ++y) {
            for (int x = kWidth / 2 + 24; x < kWidth; ++x) {
                count += test::brightness(images[1], x, y) + 60 < test::brightness(images[0], x, y)
                             ? 1
                             : 0;
            }
        }
        return count;
    };
    const int whole = dark_pixels(std::nullopt), half = dark_pixels(0.5f);
    EXPECT_GT(whole, 500);
    EXPECT_NEAR(half, 0.5 * whole, 0.15 * whole);
}

TEST_F(TextureTest, BumpsAreNormalsInTheFrameOfItsCoordinates) {
    TerrainRenderer renderer = make(settings_of());
    const View view = view_from_south();
    const auto with_normal = [](const Eigen::Vector3d& n) {
        TriangleMesh mesh = square();
        mesh.normals.assign(4, n.normalized().cast<float>());
        return mesh;
    };
    // right of the square is east, up is up, out is south
    for (const auto& [bump, normal] :
         {std::pair(std::array{128, 128, 255, 255}, Eigen::Vector3d(0, -1, 0)),
          std::pair(std::array{218, 128, 218, 255}, Eigen::Vector3d(1, -1, 0)),
          std::pair(std::array{128, 218, 218, 255}, Eigen::Vector3d(0, -1, 1)),
          std::pair(std::array{60, 90, 230, 255},
                    Eigen::Vector3d(60 - 127.5, 127.5 - 230, 90 - 127.5))}) {
        MeshMaterial material;
        material.normal_texture.image = image_of(1, 1, {bump});
        const Image image =
            picture_of(renderer, renderer.add_mesh(square(), {}, material).value(), view);
        const Image expected =
            picture_of(renderer, renderer.add_mesh(with_normal(normal)).value(), view);
        EXPECT_LE(largest_difference(image, expected), 2) << bump[0] << ", " << bump[1];
        // with mirrored coordinates, right is west
        TriangleMesh mirrored = square();
        for (Eigen::Vector2f& place : mirrored.texture_coordinates) place.x() = 1.0f - place.x();
        const Image turned =
            picture_of(renderer, renderer.add_mesh(mirrored, {}, material).value(), view);
        const Image expected_turned = picture_of(
            renderer, renderer.add_mesh(with_normal({-normal.x(), normal.y(), normal.z()})).value(),
            view);
        EXPECT_LE(largest_difference(turned, expected_turned), 2) << bump[0] << ", " << bump[1];
    }
}

TEST_F(TextureTest, IsShownInEveryKindOfLight) {
    RendererSettings settings = settings_of();
    settings.haze_distance = 60e3;
    settings.atmosphere = true;
    settings.smooth_edges = true;
    settings.shadow_distance = 100.0;
    settings.sun_radius = 0.005;
    settings.water_level = -100.0;
    settings.has_waves = true;
    settings.ground_look.emplace();
    TerrainRenderer renderer = make(settings);
    MeshMaterial material;
    material.colour_texture.image = image_of(1, 1, {{200, 40, 40, 255}});
    material.normal_texture.image = image_of(1, 1, {{128, 128, 255, 255}});
    material.roughness_metal_texture.image = image_of(1, 1, {{255, 255, 0, 255}});
    // draw() checks that OpenGL has no errors
    const Image image =
        picture_of(renderer, renderer.add_mesh(square(), {}, material).value(), view_from_south());
    const std::uint8_t* const middle = pixel(image, kWidth / 2, kHeight / 2);
    EXPECT_GT(middle[0], 2 * middle[1]);
}

TEST_F(TextureTest, ATwoSidedOneIsLitFromTheSideOfTheEye) {
    TerrainRenderer renderer = make(settings_of());
    const View behind = look_at({0, 10, 0}, {0, 0, 0}, 0.24, kWidth, kHeight).value();
    MeshMaterial material;
    material.colour_texture.image = image_of(1, 1, {{255, 255, 255, 255}});
    const TriangleMesh mesh = coloured(square(), {200, 150, 100, 255});
    const auto picture = [&](const MeshMaterial& of) {
        return picture_of(renderer, renderer.add_mesh(mesh, {}, of).value(), behind);
    };
    const Image sky = draw(renderer, behind, {});
    EXPECT_EQ(count_different(picture(material), sky), 0);
    material.is_two_sided = true;
    const Image image = picture(material);
    EXPECT_GT(count_different(image, sky), 9000);
    EXPECT_LE(largest_difference(image, picture({.is_two_sided = true})), 1);
}

TEST_F(TextureTest, AMetalReflectsTheSunWhereAMattSurfaceIsEven) {
    TerrainRenderer renderer = make(settings_of());
    const View view = view_from_south();
    TriangleMesh mesh = coloured(square(), {255, 255, 255, 255});
    // normals between those that mirror the sun to the eye and others
    mesh.normals = {Eigen::Vector3f(0.15f, -0.95f, 0.27f).normalized(),
                    Eigen::Vector3f(0.9f, -0.4f, 0.0f).normalized(),
                    Eigen::Vector3f(0.9f, -0.4f, 0.0f).normalized(),
                    Eigen::Vector3f(0.15f, -0.95f, 0.27f).normalized()};
    MeshMaterial material;
    material.colour_texture.image = image_of(1, 1, {{200, 170, 60, 255}});
    const auto picture = [&] {
        return picture_of(renderer, renderer.add_mesh(mesh, {}, material).value(), view);
    };
    const Image matt = picture();
    material.metal = 1.0f;
    material.roughness = 0.3f;
    const Image metal = picture();
    EXPECT_GT(test::brightness(metal, 32, 60), test::brightness(matt, 32, 60));
    EXPECT_LT(test::brightness(metal, 127, 60), test::brightness(matt, 127, 60));
    // the texture's numbers are factors
    material.roughness_metal_texture.image = image_of(1, 1, {{0, 255, 0, 255}});
    material.roughness = 1.0f;
    const Image paint = picture();
    material.roughness_metal_texture = {};
    material.roughness = 0.999f;
    material.metal = 0.0f;
    EXPECT_LE(largest_difference(picture(), paint), 2);
    material.emission = {0.0f, 0.0f, 2.0f};
    EXPECT_GT(pixel(picture(), 127, 60)[2], pixel(paint, 127, 60)[2] + 30);
}

// A cube with a material for each side: a texture, or the colour of its vertices.
struct Cube {
    TriangleMesh mesh;
    std::vector<MeshMaterial> materials;
};

Cube cube_of(bool is_textured) {
    Cube cube;
    for (std::uint16_t side = 0; side < 6; ++side) {
        const std::array<int, 4>& colour = kCorners[side + 1u];
        const Eigen::Vector3d normal =
            (side % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(side / 2);
        const Eigen::Vector3d right = Eigen::Vector3d::Unit((side / 2 + 1) % 3);
        const Eigen::Vector3d up = normal.cross(right);
        const auto first = static_cast<std::uint32_t>(cube.mesh.positions.size());
        for (const auto& [u, v] :
             {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)}) {
            cube.mesh.positions.emplace_back(normal + u * right + v * up);
            cube.mesh.normals.emplace_back(normal.cast<float>());
            cube.mesh.texture_coordinates.emplace_back(0.5f * static_cast<float>(u + 1),
                                                       0.5f * static_cast<float>(v + 1));
            cube.mesh.materials.push_back(side);
            std::array<std::uint8_t, 4> own = {255, 255, 255, 255};
            for (std::size_t k = 0; k < 3 && !is_textured; ++k)
                own[k] = static_cast<std::uint8_t>(colour[k]);
            cube.mesh.colours.push_back(own);
        }
        cube.mesh.triangles.push_back({first, first + 1, first + 2});
        cube.mesh.triangles.push_back({first, first + 2, first + 3});
        MeshMaterial material;
        // one of them is plain
        if (is_textured && side != 4) material.colour_texture.image = image_of(1, 1, {colour});
        if (side == 4) {
            for (std::size_t i = cube.mesh.colours.size() - 4; i < cube.mesh.colours.size(); ++i)
                cube.mesh.colours[i] = {255, 0, 255, 255};
        }
        cube.materials.push_back(std::move(material));
    }
    return cube;
}

TEST_F(TextureTest, EachTriangleHasItsMaterialInstancedStreamedAndAsAnImpostor) {
    TerrainRenderer renderer = make(settings_of());
    const Cube textured = cube_of(true), plain = cube_of(false);
    const MeshId id = renderer.add_mesh(textured.mesh, {}, textured.materials).value();
    const MeshId expected_id = renderer.add_mesh(plain.mesh, {}, plain.materials).value();
    const View view = look_at({5, -6, 4}, {0, 0, 0}, 0.4, kWidth, kHeight).value();
    const Image image = picture_of(renderer, id, view);
    EXPECT_EQ(renderer.counts().objects_drawn, 1u);
    EXPECT_EQ(renderer.counts().triangles, 12u);
    const Image expected = picture_of(renderer, expected_id, view);
    const int covered = count_different(expected, draw(renderer, view, {}));
    EXPECT_GT(covered, 2000);
    EXPECT_LE(largest_difference(image, expected), 1);

    const ObjectInstance instance = instance_at(view, {0, 0, 0});
    std::vector<Eigen::Vector3f> positions;
    for (const Eigen::Vector3d& p : textured.mesh.positions) positions.push_back(p.cast<float>());
    const StreamedDraw streamed = {id, positions, textured.mesh.triangles, 0};
    EXPECT_EQ(
        count_different(
            draw(renderer, view, {.instances = {&instance, 1}, .streamed = {&streamed, 1}}), image),
        0);
    EXPECT_EQ(renderer.counts().objects_drawn, 1u);

    const auto as_impostor = [&](MeshId mesh) {
        const ImpostorDraw one = {renderer.add_impostor(mesh).value(), 0, 1};
        return draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&one, 1}});
    };
    EXPECT_LE(count_different(as_impostor(id), as_impostor(expected_id), 3), covered / 100);
}

TEST_F(TextureTest, ImpostorsShowTheTextureAndItsCut) {
    TerrainRenderer renderer = make(settings_of(4));
    MeshMaterial material;
    material.is_two_sided = true;
    material.alpha_cutoff = 0.5f;
    material.colour_texture = {
        .image = image_of(
            2, 2, {{200, 40, 40, 255}, {40, 200, 40, 0}, {40, 40, 200, 255}, {200, 200, 40, 255}}),
        .wrap_right = TextureWrap::clamp,
        .wrap_up = TextureWrap::clamp};
    const MeshId id =
        renderer.add_mesh(coloured(square(), {255, 255, 255, 255}), {}, material).value();
    const ImpostorId impostor = renderer.add_impostor(id).value();
    const View view = view_from_south(25.0);  // 40 pixels
    const Image mesh = picture_of(renderer, id, view);
    const ObjectInstance instance = instance_at(view, {0, 0, 0});
    const ImpostorDraw one = {impostor, 0, 1};
    const Image image = draw(renderer, view, {.instances = {&instance, 1}, .impostors = {&one, 1}});
    const int covered = count_different(mesh, draw(renderer, view, {}));
    EXPECT_NEAR(covered, 0.75 * 40 * 40, 60);
    EXPECT_LE(count_different(mesh, image, 24), covered / 6);
    for (const auto& [x, y] :
         {std::pair(70, 50), std::pair(90, 50), std::pair(70, 70), std::pair(90, 70)})
        expect_near(pixel(image, x, y), pixel(mesh, x, y), 8,
                    "at " + std::to_string(x) + ", " + std::to_string(y));
}

TEST_F(TextureTest, PlainMaterialsTakeNoMemoryForTextures) {
    TerrainRenderer renderer = make(settings_of());
    const TriangleMesh mesh = square();
    const std::size_t plain = 4 * 28 + 2 * 12;
    const MeshId first = renderer.add_mesh(mesh).value();
    EXPECT_EQ(renderer.buffer_bytes(), plain);
    // roughness and metal alone are not drawn
    renderer.add_mesh(mesh, {}, {.roughness = 0.2f, .metal = 1.0f}).value();
    EXPECT_EQ(renderer.buffer_bytes(), 2 * plain);
    MeshMaterial material;
    material.colour_texture.image = image_of(4, 2, kCorners);
    const MeshId second = renderer.add_mesh(mesh, {}, material).value();
    const std::size_t textured = plain + 4 * 8, texels = 4 * (8 + 2 + 1);
    EXPECT_EQ(renderer.buffer_bytes(), 2 * plain + textured + texels);
    // the same image takes its memory once, and gives it back with the last mesh
    const MeshId third = renderer.add_mesh(mesh, {}, material).value();
    EXPECT_EQ(renderer.buffer_bytes(), 2 * plain + 2 * textured + texels);
    renderer.remove_mesh(second);
    renderer.remove_mesh(first);
    EXPECT_EQ(renderer.buffer_bytes(), plain + textured + texels);
    renderer.remove_mesh(third);
    EXPECT_EQ(renderer.buffer_bytes(), plain);
}

TEST_F(TextureTest, StaysWithinItsLimitOfMemory) {
    constexpr std::size_t kLimit = 33'000;
    RendererSettings settings = settings_of();
    settings.texture_bytes = kLimit;
    TerrainRenderer renderer = make(settings);
    const View view = view_from_south();
    const std::size_t buffers = 4 * 28 + 2 * 12 + 4 * 8;
    std::vector<MeshId> meshes;
    std::vector<Image> full;
    for (int i = 0; i < 3; ++i) {
        std::vector<std::array<int, 4>> texels;
        for (int texel = 0; texel < 64 * 64; ++texel)
            texels.push_back({(texel * (i + 3)) % 251, texel % 256, 40 * i, 255});
        MeshMaterial material;
        material.colour_texture.image = image_of(64, 64, texels);
        meshes.push_back(renderer.add_mesh(square(), {}, material).value());
        EXPECT_LE(renderer.buffer_bytes(), kLimit + meshes.size() * buffers);
        TerrainRenderer large = make(settings_of());
        full.push_back(picture_of(large, large.add_mesh(square(), {}, material).value(), view));
    }
    for (const std::size_t i : {0u, 1u, 2u, 1u, 0u, 0u}) {
        // the texture that is drawn is whole, two others have lost their finest mipmap
        EXPECT_EQ(count_different(picture_of(renderer, meshes[i], view), full[i]), 0) << i;
        EXPECT_EQ(renderer.counts().textures_reduced, 2u);
        EXPECT_LE(renderer.buffer_bytes(), kLimit + 3 * buffers);
    }
    renderer.remove_mesh(meshes[2]);
    renderer.remove_mesh(meshes[1]);
    EXPECT_EQ(renderer.buffer_bytes(), 21'844 + buffers);
}

TEST_F(TextureTest, LevelsMorphTheirCoordinates) {
    TerrainRenderer renderer = make(settings_of());
    // the vertex in the middle of the lower edge moves to the left end
    TriangleMesh mesh = square();
    mesh.positions.emplace_back(0.0, 0.0, -1.0);
    mesh.texture_coordinates.emplace_back(0.8f, 0.0f);
    mesh.normals.push_back(mesh.normals[0]);
    mesh.triangles = {{0, 4, 3}, {4, 1, 2}, {4, 2, 3}};
    const std::vector<std::uint32_t> targets = {0, 1, 2, 3, 0};
    const std::vector<TriangleMesh::Triangle> coarse = {{0, 1, 2}, {0, 2, 3}};
    const std::vector<MeshLevel> levels = {{mesh.triangles, targets}, {coarse, {}}};
    MeshMaterial material;
    material.colour_texture.image = image_of(4, 2, kCorners);
    const MeshId id = renderer.add_mesh(mesh, levels, material).value();
    const View view = view_from_south();
    const auto picture = [&](std::uint32_t level, float coverage) {
        ObjectInstance instance = instance_at(view, {0, 0, 0});
        instance.coverage = coverage;
        const MeshDraw one = {id, level, 0, 1};
        return draw(renderer, view, {.instances = {&instance, 1}, .meshes = {&one, 1}});
    };
    EXPECT_GT(count_different(picture(0, 1.0f), picture(1, 1.0f), 20), 500);
    EXPECT_LE(count_different(picture(0, 2.0f), picture(1, 1.0f), 2), 100);
}

TEST_F(TextureTest, RefusesMaterialsThatAreWrong) {
    TerrainRenderer renderer = make(settings_of());
    const auto message = [&](const MeshMaterial& material) {
        return renderer.add_mesh(square(), {}, material).error().message;
    };
    MeshMaterial material;
    material.colour_texture.image =
        std::make_shared<const TextureImage>(TextureImage{3, 2, std::vector<std::uint8_t>(23)});
    EXPECT_EQ(message(material),
              "colour_texture must have sides of 1 to 16384 pixels and 4 bytes a pixel, got 3 x 2 "
              "pixels and 23 bytes");
    material.colour_texture.image = std::make_shared<const TextureImage>();
    EXPECT_THAT(message(material), testing::HasSubstr("got 0 x 0 pixels"));
    EXPECT_EQ(message({.roughness = 2.0f}), "roughness must be 0 to 1, got 2");
    EXPECT_THAT(message({.metal = std::nanf("")}), testing::HasSubstr("metal must be 0 to 1"));
    EXPECT_THAT(message({.alpha_cutoff = -1.0f}),
                testing::HasSubstr("alpha_cutoff must be 0 to 1"));
    TriangleMesh mesh = square();
    mesh.materials = {0, 0, 1, 0};
    EXPECT_EQ(renderer.add_mesh(mesh).error().message, "vertex 2 names material 1 of 1");
    EXPECT_EQ(renderer.add_mesh(mesh, {}, std::span<const MeshMaterial>()).error().message,
              "a mesh must have 1 to 65536 materials, got 0");
    EXPECT_EQ(renderer.buffer_bytes(), 0u);
}

}  // namespace texture_test
}  // namespace terrane
