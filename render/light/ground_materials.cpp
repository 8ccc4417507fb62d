// SPDX-License-Identifier: MIT
//
// Procedural textures of materials, and palettes that colour them.
//
// Sources: K. Perlin. Improving Noise. SIGGRAPH 2002 (gradient noise).
//          S. Worley. A Cellular Texture Basis Function. SIGGRAPH 1996 (stones, tufts, cracks).
#include "light/ground_materials.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <numbers>
#include <span>

namespace terrane::internal {
namespace {

constexpr double kPeriod = 1.0;      // of the smallest scale, metres
constexpr double kScaleRatio = 8.0;  // as in ground_material.glsl
constexpr float kDeviation = 0.20f;  // standard deviation of each channel

std::uint32_t hash_of(int x, int y, int seed) {
    std::uint32_t h = static_cast<std::uint32_t>(x) * 0x9e3779b1u ^
                      static_cast<std::uint32_t>(y) * 0x85ebca77u ^
                      static_cast<std::uint32_t>(seed) * 0xc2b2ae3du;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return h ^ (h >> 15);
}
float unit(std::uint32_t hash) { return static_cast<float>(hash & 0xffffffu) / 16777216.0f; }

int wrapped(int index, int count) { return ((index % count) + count) % count; }

// Gradient noise with cells_x * cells_y cells in the unit square, about -0.7 to 0.7.
float gradient_noise(float u, float v, int cells_x, int cells_y, int seed) {
    constexpr float kHalf = std::numbers::sqrt2_v<float> / 2.0f;
    constexpr std::array<std::array<float, 2>, 8> kDirections{{{1.0f, 0.0f},
                                                               {kHalf, kHalf},
                                                               {0.0f, 1.0f},
                                                               {-kHalf, kHalf},
                                                               {-1.0f, 0.0f},
                                                               {-kHalf, -kHalf},
                                                               {0.0f, -1.0f},
                                                               {kHalf, -kHalf}}};
    const float x = u * static_cast<float>(cells_x), y = v * static_cast<float>(cells_y);
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
    const auto corner = [&](int i, int j) {
        const auto& towards =
            kDirections[hash_of(wrapped(column + i, cells_x), wrapped(row + j, cells_y), seed) &
                        7u];
        return towards[0] * (a - static_cast<float>(i)) + towards[1] * (b - static_cast<float>(j));
    };
    const auto smooth = [](float t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); };
    const float p = smooth(a), q = smooth(b);
    return std::lerp(std::lerp(corner(0, 0), corner(1, 0), p),
                     std::lerp(corner(0, 1), corner(1, 1), p), q);
}

// Octaves of gradient noise from `cells` to `last` cells, each with `gain` times the amplitude of the previous one.
float fractal_noise(float u, float v, int cells, int last, float gain, int seed) {
    float sum = 0.0f, amplitude = 1.0f;
    for (; cells <= last; cells *= 2, amplitude *= gain, ++seed)
        sum += amplitude * gradient_noise(u, v, cells, cells, seed);
    return sum;
}

// Distances to the nearest and second nearest of random points, one in each cell, in cells, and a random number of the
// nearest point, 0 to 1.
struct Nearest {
    float first = 9.0f, second = 9.0f, random = 0.0f;
};
Nearest nearest_points(float u, float v, int cells, int seed) {
    const float x = u * static_cast<float>(cells), y = v * static_cast<float>(cells);
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    Nearest found;
    for (int j = row - 1; j <= row + 1; ++j) {
        for (int i = column - 1; i <= column + 1; ++i) {
            const std::uint32_t hash = hash_of(wrapped(i, cells), wrapped(j, cells), seed);
            const float dx = static_cast<float>(i) + unit(hash) - x;
            const float dy = static_cast<float>(j) + unit(hash * 0x9e3779b1u >> 8) - y;
            const float distance = std::sqrt(dx * dx + dy * dy);
            if (distance < found.first) {
                found = {distance, found.first, unit(hash * 0x2c1b3c6du >> 8)};
            } else {
                found.second = std::min(found.second, distance);
            }
        }
    }
    return found;
}

enum class Pattern { turf, shrub, soil, gravel, rock, snow, sand, regolith };

struct Texel {
    float tone = 0.0f, height = 0.0f;
};

// Rounded stones with `cells` cells along the side; 0 in the gaps.
Texel stones(float u, float v, int cells, int seed) {
    const Nearest point = nearest_points(u, v, cells, seed);
    const float inside = std::clamp(2.2f * (point.second - point.first), 0.0f, 1.0f);
    const float dome = inside * (2.0f - inside);
    return {dome * (0.5f + 0.8f * point.random), dome * (0.4f + 0.6f * point.random)};
}

// Craters with `cells` cells along the side: a bowl, a rim and ejecta.
Texel craters(float u, float v, int cells, int seed) {
    const Nearest point = nearest_points(u, v, cells, seed);
    const float radius = 0.10f + 0.30f * point.random * point.random;
    const float r = point.first / radius;
    const float bowl = r < 1.0f ? r * r - 1.0f : 0.0f;
    const float rim = std::exp(-10.0f * (r - 1.0f) * (r - 1.0f));
    return {0.5f * rim + 0.3f * bowl, radius * (1.6f * bowl + 0.9f * rim)};
}

Texel texel_of(Pattern pattern, float u, float v) {
    const auto noise = [&](int cells, int last, float gain, int seed) {
        return fractal_noise(u, v, cells, last, gain, seed);
    };
    switch (pattern) {
        case Pattern::turf: {
            // tufts, and blades bent about one direction
            const float bend = 0.02f * noise(4, 8, 0.6f, 11);
            const Nearest tuft = nearest_points(u + bend, v, 40, 12);
            const float blades = gradient_noise(u + 0.5f * v + bend, v, 192, 48, 13) +
                                 gradient_noise(u, v + bend, 96, 160, 14);
            const float height = 0.5f - 0.6f * tuft.first + 0.5f * noise(8, 64, 0.6f, 15);
            return {
                0.7f * height + 0.40f * blades + 0.30f * tuft.random + 0.5f * noise(4, 8, 0.7f, 16),
                height + 0.25f * blades};
        }
        case Pattern::shrub: {
            const float warp = 0.03f * noise(8, 16, 0.6f, 21);
            const Nearest bush = nearest_points(u + warp, v - warp, 16, 22);
            const Nearest leaf = nearest_points(u, v, 96, 23);
            const float crown = std::max(0.0f, 1.0f - 1.3f * bush.first) * (0.5f + bush.random);
            return {1.2f * crown - 0.5f * leaf.first + 0.3f * leaf.random +
                        0.4f * noise(16, 64, 0.7f, 24),
                    1.6f * crown - 0.35f * leaf.first};
        }
        case Pattern::soil: {
            const Texel pebble = stones(u, v, 72, 31);
            const bool is_there = noise(8, 16, 0.6f, 32) > 0.12f;
            const float earth = noise(8, 128, 0.72f, 33);
            return {earth + (is_there ? 0.5f * pebble.tone : 0.0f),
                    0.8f * earth + (is_there ? 0.7f * pebble.height : 0.0f)};
        }
        case Pattern::gravel: {
            const Texel large = stones(u, v, 22, 41), small = stones(u, v, 60, 42);
            const bool is_large = large.height > 0.45f;
            const float rough = 0.25f * noise(32, 128, 0.7f, 43);
            return {(is_large ? large.tone : 0.75f * small.tone) + rough,
                    (is_large ? 0.25f + large.height : 0.6f * small.height) + 0.5f * rough};
        }
        case Pattern::rock: {
            // beds across v, which is up on cliffs; cracks
            const float warp = 0.05f * noise(4, 16, 0.55f, 51);
            const float beds = gradient_noise(u, v + warp, 3, 24, 52) +
                               0.6f * gradient_noise(u, v + warp, 6, 64, 53);
            const Nearest block = nearest_points(u + warp, v + 0.6f * warp, 10, 54);
            const float crack = std::clamp(5.0f * (block.second - block.first), 0.0f, 1.0f);
            const float rough = noise(8, 128, 0.68f, 55);
            return {0.7f * beds + 0.6f * rough + 0.30f * crack + 0.30f * block.random,
                    0.5f * beds + 0.7f * rough + 0.35f * crack + 0.35f * block.random};
        }
        case Pattern::snow: {
            const float drifts = gradient_noise(u + 0.05f * noise(4, 8, 0.6f, 61), v, 7, 11, 62);
            const float crust = noise(16, 128, 0.62f, 63);
            return {0.8f * drifts + 0.5f * crust, drifts + 0.35f * crust};
        }
        case Pattern::sand: {
            const float bend = 0.10f * noise(4, 16, 0.5f, 71);
            const float phase =
                2.0f * std::numbers::pi_v<float> * (14.0f * u + 5.0f * v + 6.0f * bend);
            const float ripple = std::sin(phase) + 0.3f * std::sin(2.0f * phase + 1.0f);
            const float grain = noise(32, 256, 0.8f, 72);
            return {0.25f * ripple + 0.7f * grain + 0.6f * noise(4, 16, 0.6f, 73),
                    0.5f * ripple + 0.25f * grain};
        }
        case Pattern::regolith: {
            const Texel large = craters(u, v, 5, 81), middle = craters(u, v, 14, 82),
                        small = craters(u, v, 40, 83);
            const float dust = noise(8, 256, 0.75f, 84);
            return {large.tone + 0.7f * middle.tone + 0.5f * small.tone + 0.5f * dust,
                    large.height + 0.5f * middle.height + 0.25f * small.height + 0.05f * dust};
        }
    }
    return {};
}

// Moves values to mean 1/2 and a standard deviation of kDeviation, and writes them to a channel.
void write_channel(std::span<const float> values, int channel, std::vector<std::uint8_t>& texels) {
    double sum = 0.0, squares = 0.0;
    for (const float value : values) {
        sum += double{value};
        squares += double{value} * double{value};
    }
    const double count = static_cast<double>(values.size());
    const double mean = sum / count;
    const double deviation = std::sqrt(std::max(squares / count - mean * mean, 1e-12));
    const auto scale = static_cast<float>(double{kDeviation} / deviation);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const float moved = 0.5f + scale * (values[i] - static_cast<float>(mean));
        texels[4 * i + static_cast<std::size_t>(channel)] =
            static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(moved, 0.0f, 1.0f)));
    }
}

struct Material {
    Pattern pattern;
    std::array<float, 3> dark, light;  // albedo
    float roughness, slopes;           // of Oren and Nayar; factor of the slopes
};

struct Palette {
    std::array<Material, kMaterials> materials;
    double snow_share;  // height of the snow line, share of the range of tints; infinity: none
    double rock_slope;  // rise over run
    float scree_share;  // height from which scree covers level ground, share of the range of tints
    float shrub, soil;  // bias of their noise
    float variation;    // over large distances
};

constexpr double kNoSnow = 1e6;

constexpr Palette kAlpine{
    {{{Pattern::turf, {0.034f, 0.046f, 0.014f}, {0.200f, 0.205f, 0.085f}, 0.5f, 1.1f},
      {Pattern::shrub, {0.010f, 0.017f, 0.008f}, {0.085f, 0.112f, 0.046f}, 0.5f, 1.5f},
      {Pattern::soil, {0.075f, 0.054f, 0.034f}, {0.260f, 0.205f, 0.145f}, 0.6f, 1.0f},
      {Pattern::gravel, {0.095f, 0.088f, 0.078f}, {0.440f, 0.415f, 0.375f}, 0.6f, 1.4f},
      {Pattern::rock, {0.058f, 0.053f, 0.049f}, {0.290f, 0.265f, 0.245f}, 0.5f, 1.6f},
      {Pattern::snow, {0.66f, 0.72f, 0.82f}, {0.93f, 0.95f, 0.97f}, 0.3f, 0.5f}}},
    0.84,
    0.62,
    0.62f,
    0.00f,
    0.02f,
    0.45f};

constexpr Palette kTemperate{
    {{{Pattern::turf, {0.036f, 0.056f, 0.016f}, {0.185f, 0.225f, 0.078f}, 0.5f, 1.0f},
      {Pattern::shrub, {0.010f, 0.020f, 0.007f}, {0.070f, 0.110f, 0.038f}, 0.5f, 1.5f},
      {Pattern::soil, {0.085f, 0.058f, 0.034f}, {0.270f, 0.200f, 0.130f}, 0.6f, 0.9f},
      {Pattern::gravel, {0.100f, 0.092f, 0.075f}, {0.380f, 0.350f, 0.300f}, 0.6f, 1.3f},
      {Pattern::rock, {0.070f, 0.064f, 0.054f}, {0.300f, 0.275f, 0.240f}, 0.5f, 1.5f},
      {Pattern::snow, {0.66f, 0.72f, 0.82f}, {0.93f, 0.95f, 0.97f}, 0.3f, 0.5f}}},
    1.60,
    0.85,
    1.30f,
    0.06f,
    0.05f,
    0.45f};

constexpr Palette kDesert{
    {{{Pattern::sand, {0.310f, 0.205f, 0.110f}, {0.610f, 0.440f, 0.270f}, 0.5f, 0.7f},
      {Pattern::shrub, {0.150f, 0.115f, 0.060f}, {0.400f, 0.310f, 0.180f}, 0.5f, 1.1f},
      {Pattern::soil, {0.240f, 0.150f, 0.090f}, {0.500f, 0.355f, 0.235f}, 0.6f, 0.9f},
      {Pattern::gravel, {0.170f, 0.105f, 0.070f}, {0.500f, 0.350f, 0.240f}, 0.6f, 1.3f},
      {Pattern::rock, {0.130f, 0.062f, 0.038f}, {0.430f, 0.240f, 0.150f}, 0.5f, 1.7f},
      {Pattern::sand, {0.400f, 0.280f, 0.170f}, {0.680f, 0.520f, 0.350f}, 0.5f, 0.6f}}},
    kNoSnow,
    0.45,
    1.05f,
    -0.14f,
    0.08f,
    0.35f};

constexpr Palette kMoon{
    {{{Pattern::regolith, {0.050f, 0.048f, 0.046f}, {0.150f, 0.146f, 0.140f}, 0.7f, 1.5f},
      {Pattern::regolith, {0.036f, 0.035f, 0.034f}, {0.118f, 0.115f, 0.111f}, 0.7f, 1.5f},
      {Pattern::soil, {0.055f, 0.053f, 0.050f}, {0.150f, 0.146f, 0.140f}, 0.7f, 1.0f},
      {Pattern::gravel, {0.060f, 0.058f, 0.055f}, {0.185f, 0.180f, 0.173f}, 0.7f, 1.4f},
      {Pattern::rock, {0.065f, 0.063f, 0.060f}, {0.200f, 0.195f, 0.188f}, 0.6f, 1.3f},
      {Pattern::regolith, {0.070f, 0.068f, 0.065f}, {0.200f, 0.195f, 0.188f}, 0.7f, 1.4f}}},
    kNoSnow,
    0.75,
    1.40f,
    0.00f,
    -0.06f,
    0.40f};

// Muted colours: imagery covers most of them.
constexpr Palette kImagery{
    {{{Pattern::turf, {0.045f, 0.050f, 0.024f}, {0.190f, 0.195f, 0.110f}, 0.5f, 1.0f},
      {Pattern::shrub, {0.018f, 0.023f, 0.013f}, {0.100f, 0.115f, 0.068f}, 0.5f, 1.3f},
      {Pattern::soil, {0.090f, 0.070f, 0.050f}, {0.260f, 0.215f, 0.165f}, 0.6f, 0.9f},
      {Pattern::gravel, {0.110f, 0.100f, 0.090f}, {0.390f, 0.365f, 0.330f}, 0.6f, 1.2f},
      {Pattern::rock, {0.080f, 0.072f, 0.065f}, {0.290f, 0.265f, 0.245f}, 0.5f, 1.4f},
      {Pattern::snow, {0.66f, 0.72f, 0.82f}, {0.93f, 0.95f, 0.97f}, 0.3f, 0.5f}}},
    1.60,
    0.75,
    1.20f,
    0.02f,
    0.04f,
    0.30f};

const Palette& palette_of(GroundPalette palette) {
    switch (palette) {
        case GroundPalette::alpine:
            return kAlpine;
        case GroundPalette::temperate:
            return kTemperate;
        case GroundPalette::desert:
            return kDesert;
        case GroundPalette::moon:
            return kMoon;
        case GroundPalette::imagery:
            return kImagery;
    }
    return kAlpine;
}

// Width of the snow line's transition, share of the range of tints.
constexpr double kSnowWidth = 0.12;

}  // namespace

std::vector<std::uint8_t> make_material_layer(GroundPalette palette, int layer) {
    constexpr std::size_t kCount = std::size_t{kMaterialTexels} * kMaterialTexels;
    std::vector<float> tones(kCount), heights(kCount), to_east(kCount), to_north(kCount);
    const auto index = [](int column, int row) {
        return static_cast<std::size_t>(wrapped(row, kMaterialTexels)) * kMaterialTexels +
               static_cast<std::size_t>(wrapped(column, kMaterialTexels));
    };
    const bool is_noise = layer == kMaterials;
    for (int row = 0; row < kMaterialTexels; ++row) {
        for (int column = 0; column < kMaterialTexels; ++column) {
            const float u = (static_cast<float>(column) + 0.5f) / kMaterialTexels;
            const float v = (static_cast<float>(row) + 0.5f) / kMaterialTexels;
            const std::size_t at = index(column, row);
            const Texel texel =
                is_noise
                    ? Texel{fractal_noise(u, v, 16, 256, 0.62f, 91), 0.0f}
                    : texel_of(
                          palette_of(palette).materials[static_cast<std::size_t>(layer)].pattern, u,
                          v);
            tones[at] = texel.tone;
            heights[at] = texel.height;
        }
    }
    for (int row = 0; row < kMaterialTexels; ++row) {
        for (int column = 0; column < kMaterialTexels; ++column) {
            const std::size_t at = index(column, row);
            if (is_noise) {
                // the same noise, so far away that the channels do not correlate
                heights[at] = tones[index(column + 211, row + 87)];
                to_east[at] = tones[index(column + 90, row + 301)];
                to_north[at] = tones[index(column + 333, row + 180)];
                continue;
            }
            to_east[at] = heights[index(column + 1, row)] - heights[index(column - 1, row)];
            to_north[at] = heights[index(column, row + 1)] - heights[index(column, row - 1)];
        }
    }
    std::vector<std::uint8_t> texels(4 * kCount);
    write_channel(to_east, 0, texels);
    write_channel(to_north, 1, texels);
    write_channel(tones, 2, texels);
    write_channel(heights, 3, texels);
    return texels;
}

MaterialUniforms make_material_uniforms(const RendererSettings& settings, bool is_flat) {
    const GroundLookSettings& look = *settings.ground_look;
    const Palette& palette = palette_of(look.palette);
    MaterialUniforms made;
    for (std::size_t i = 0; i < kMaterials; ++i) {
        const Material& material = palette.materials[i];
        made.dark[i] = {material.dark[0], material.dark[1], material.dark[2], material.roughness};
        made.light[i] = {material.light[0], material.light[1], material.light[2], material.slopes};
    }
    const double range = settings.tint_high - settings.tint_low;
    const double snow = look.snow_line.value_or(settings.tint_low + palette.snow_share * range);
    const double slope = look.rock_slope.value_or(palette.rock_slope);
    made.lines = {static_cast<float>(snow), static_cast<float>(1.0 / (kSnowWidth * range)),
                  static_cast<float>(1.0 - 1.0 / std::sqrt(1.0 + slope * slope)),
                  static_cast<float>(look.occlusion)};
    made.cover = {palette.shrub, palette.soil, palette.scree_share, palette.variation};
    if (!is_flat) return made;
    constexpr float kDisplayGamma = 2.2f;
    for (std::size_t i = 0; i < kMaterials; ++i) {
        const Colour& colour = kFlatMaterials[i].colour;
        made.dark[i] = {std::pow(colour.red, kDisplayGamma), std::pow(colour.green, kDisplayGamma),
                        std::pow(colour.blue, kDisplayGamma), 0.0f};
        made.light[i] = made.dark[i];  // equal at any tone, and no slopes
    }
    made.lines[3] = 0.0f;  // occlusion
    made.cover[3] = 0.0f;  // variation over large distances
    return made;
}

void set_material_places(const Lattice& lattice, const EyeFrame& eye, MaterialUniforms& uniforms) {
    // exact to a micrometre within 2^32 m of the origin
    const std::array<double, 3> eye_world{
        lattice.x(eye.x) + eye.remainder_x, lattice.y(eye.y) + eye.remainder_y,
        lattice.quantum * static_cast<double>(eye.height) + eye.remainder_z};
    double period = kPeriod;
    for (std::size_t scale = 0; scale < kMaterialScales; ++scale, period *= kScaleRatio) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double at = eye_world[axis] / period;
            const double cell = std::floor(at);
            uniforms.place[scale][axis] = static_cast<float>(at - cell);
            uniforms.cell[scale][axis] = static_cast<std::int32_t>(
                static_cast<std::uint32_t>(static_cast<std::int64_t>(cell)));
        }
        uniforms.place[scale][3] = static_cast<float>(1.0 / period);
    }
}

GroundMaterials::GroundMaterials(const RendererSettings& settings, int anisotropy)
    : uniforms_(make_material_uniforms(settings)),
      layers_(make_texture_2d_array()),
      buffer_(make_buffer()) {
    const GLuint name = layers_.name();
    glTextureStorage3D(name, 10, GL_RGBA8, kMaterialTexels, kMaterialTexels, kMaterialLayers);
    static_assert(kMaterialTexels == 1 << 9);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    std::vector<std::future<std::vector<std::uint8_t>>> made;
    for (int layer = 0; layer < kMaterialLayers; ++layer) {
        made.push_back(std::async(std::launch::async, make_material_layer,
                                  settings.ground_look->palette, layer));
    }
    for (int layer = 0; layer < kMaterialLayers; ++layer) {
        glTextureSubImage3D(name, 0, 0, 0, layer, kMaterialTexels, kMaterialTexels, 1, GL_RGBA,
                            GL_UNSIGNED_BYTE, made[static_cast<std::size_t>(layer)].get().data());
    }
    glGenerateTextureMipmap(name);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    glTextureParameterf(name, GL_TEXTURE_MAX_ANISOTROPY, static_cast<float>(anisotropy));
    glNamedBufferStorage(buffer_.name(), sizeof(MaterialUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
}

void GroundMaterials::prepare(const Lattice& lattice, const EyeFrame& eye) {
    set_material_places(lattice, eye, uniforms_);
    glNamedBufferSubData(buffer_.name(), 0, sizeof(uniforms_), &uniforms_);
}

void GroundMaterials::bind() const {
    glBindTextureUnit(12, layers_.name());
    glBindBufferBase(GL_UNIFORM_BUFFER, 5, buffer_.name());
}

std::size_t GroundMaterials::bytes() const {
    // mipmaps add a third
    return std::size_t{4} * kMaterialLayers * (4 * kMaterialTexels * kMaterialTexels - 1) / 3;
}

}  // namespace terrane::internal
