// SPDX-License-Identifier: MIT
#include "light/ground_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace terrane::internal {
namespace {

constexpr int kSide = 256;  // texels

// Hash of the arguments, in [-1, 1].
double random_at(int column, int row, int octave) {
    std::uint32_t h = static_cast<std::uint32_t>(column) * 0x9e3779b1u ^
                      static_cast<std::uint32_t>(row) * 0x85ebca77u ^
                      static_cast<std::uint32_t>(octave) * 0xc2b2ae3du;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    h ^= h >> 15;
    return static_cast<double>(h) / 2147483647.5 - 1.0;
}

double smooth(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

// One octave of periodic value noise with `cells` cells per side.
double value_noise(int x, int y, int cells, int octave) {
    const int width = kSide / cells;
    const int column = x / width, row = y / width;
    const double u = smooth((x % width + 0.5) / width), v = smooth((y % width + 0.5) / width);
    const int next_column = (column + 1) % cells, next_row = (row + 1) % cells;
    const double south =
        std::lerp(random_at(column, row, octave), random_at(next_column, row, octave), u);
    const double north =
        std::lerp(random_at(column, next_row, octave), random_at(next_column, next_row, octave), u);
    return std::lerp(south, north, v);
}

std::uint8_t to_byte(double value) {
    return static_cast<std::uint8_t>(
        std::clamp(std::lround((value * 0.5 + 0.5) * 255.0), 0L, 255L));
}

}  // namespace

GlTexture make_ground_noise() {
    std::vector<double> values(std::size_t{kSide} * kSide);
    const auto index = [](int x, int y) {
        return static_cast<std::size_t>((y + kSide) % kSide) * kSide +
               static_cast<std::size_t>((x + kSide) % kSide);
    };
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            double sum = 0.0, amplitude = 0.42;
            for (int octave = 0, cells = 8; cells <= 128; ++octave, cells *= 2, amplitude *= 0.68) {
                sum += amplitude * value_noise(x, y, cells, octave);
            }
            values[index(x, y)] = sum;
        }
    }
    std::vector<std::uint8_t> texels(values.size() * 4);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            std::uint8_t* texel = &texels[index(x, y) * 4];
            texel[0] = to_byte(1.2 * (values[index(x + 1, y)] - values[index(x - 1, y)]));
            texel[1] = to_byte(1.2 * (values[index(x, y + 1)] - values[index(x, y - 1)]));
            texel[2] = to_byte(values[index(x, y)]);
            texel[3] = 255;
        }
    }
    GlTexture texture = make_texture_2d();
    const GLuint name = texture.name();
    glTextureStorage2D(name, 9, GL_RGBA8, kSide, kSide);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(name, 0, 0, 0, kSide, kSide, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
    glGenerateTextureMipmap(name);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    return texture;
}

}  // namespace terrane::internal
