// SPDX-License-Identifier: MIT
#include "objects/mipmaps.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>

namespace terrane::internal {
namespace {

// A texture keeps at least its mipmap with a longer side of this many pixels.
constexpr int kLeastSide = 32;

double linear_of(double display) {
    return display <= 0.04045 ? display / 12.92 : std::pow((display + 0.055) / 1.055, 2.4);
}

double display_of(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

// Linear levels of display levels, and display levels of linear ones in steps of 1 / 65535.
struct ColourTables {
    std::array<float, 256> linear;
    std::vector<std::uint8_t> display;

    ColourTables() : display(65536) {
        for (std::size_t i = 0; i < linear.size(); ++i)
            linear[i] = static_cast<float>(linear_of(static_cast<double>(i) / 255.0));
        for (std::size_t i = 0; i < display.size(); ++i) {
            display[i] = static_cast<std::uint8_t>(
                255.0 * display_of(static_cast<double>(i) / 65535.0) + 0.5);
        }
    }
};

const ColourTables& colour_tables() {
    static const ColourTables tables;
    return tables;
}

// Pixels with fractions, while mipmaps are computed: linear colour, opacity, each 0 to 1.
struct Level {
    int width = 0, height = 0;
    std::vector<std::array<float, 4>> pixels;
};

// The weights of the pixels of a row that a pixel of the next mipmap covers: two, or three of an odd row.
struct Taps {
    std::array<int, 3> at{};
    std::array<float, 3> weight{};
    int count = 0;
};

std::vector<Taps> taps_of(int before, int after) {
    std::vector<Taps> taps(static_cast<std::size_t>(after));
    const double step = static_cast<double>(before) / after;
    for (int i = 0; i < after; ++i) {
        Taps& made = taps[static_cast<std::size_t>(i)];
        const double from = i * step, to = std::min((i + 1) * step, static_cast<double>(before));
        for (int k = static_cast<int>(from); k < before && made.count < 3; ++k) {
            const double share = std::min(to, k + 1.0) - std::max(from, static_cast<double>(k));
            if (share < 1e-9) break;
            const auto place = static_cast<std::size_t>(made.count++);
            made.at[place] = k;
            made.weight[place] = static_cast<float>(share / (to - from));
        }
    }
    return taps;
}

Level half_of(const Level& before, bool weighs_opacity) {
    Level made;
    made.width = std::max(before.width / 2, 1);
    made.height = std::max(before.height / 2, 1);
    made.pixels.resize(static_cast<std::size_t>(made.width) *
                       static_cast<std::size_t>(made.height));
    const std::vector<Taps> across = taps_of(before.width, made.width),
                            down = taps_of(before.height, made.height);
    std::size_t place = 0;
    for (const Taps& rows : down) {
        for (const Taps& columns : across) {
            std::array<float, 4> plain{}, weighted{};
            for (int j = 0; j < rows.count; ++j) {
                for (int i = 0; i < columns.count; ++i) {
                    const auto row = static_cast<std::size_t>(rows.at[static_cast<std::size_t>(j)]);
                    const auto column =
                        static_cast<std::size_t>(columns.at[static_cast<std::size_t>(i)]);
                    const std::array<float, 4>& p =
                        before.pixels[row * static_cast<std::size_t>(before.width) + column];
                    const float weight = rows.weight[static_cast<std::size_t>(j)] *
                                         columns.weight[static_cast<std::size_t>(i)];
                    for (std::size_t k = 0; k < 4; ++k) plain[k] += weight * p[k];
                    for (std::size_t k = 0; k < 3; ++k) weighted[k] += weight * p[3] * p[k];
                }
            }
            std::array<float, 4>& out = made.pixels[place++];
            out = plain;
            if (!weighs_opacity || !(plain[3] > 0.0f)) continue;
            for (std::size_t k = 0; k < 3; ++k) out[k] = weighted[k] / plain[3];
        }
    }
    return made;
}

// Factor of the opacities with which a share of the pixels has at least the cutoff.
float opacity_scale(const Level& level, double share, float cutoff) {
    std::vector<float> opacities;
    opacities.reserve(level.pixels.size());
    for (const std::array<float, 4>& p : level.pixels) opacities.push_back(p[3]);
    const auto count =
        static_cast<std::size_t>(share * static_cast<double>(opacities.size()) + 0.5);
    if (count == 0) return 1.0f;
    const auto last = opacities.begin() + static_cast<std::ptrdiff_t>(count - 1);
    std::nth_element(opacities.begin(), last, opacities.end(), std::greater<>());
    // rounded up, so that the last one has the cutoff in 8 bits too
    const float wanted = std::ceil(255.0f * cutoff) / 255.0f;
    return *last > 0.0f ? wanted / *last : 1.0f;
}

TextureImage image_of(const Level& level, TextureUse use, float scale) {
    const ColourTables& tables = colour_tables();
    TextureImage made = {level.width, level.height, {}};
    made.rgba.reserve(4 * level.pixels.size());
    for (const std::array<float, 4>& p : level.pixels) {
        for (std::size_t k = 0; k < 3; ++k) {
            made.rgba.push_back(
                use != TextureUse::data
                    ? tables.display[static_cast<std::size_t>(65535.0f * p[k] + 0.5f)]
                    : static_cast<std::uint8_t>(255.0f * p[k] + 0.5f));
        }
        made.rgba.push_back(
            static_cast<std::uint8_t>(255.0f * std::min(scale * p[3], 1.0f) + 0.5f));
    }
    return made;
}

}  // namespace

int mipmap_count(int width, int height) {
    return static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
}

std::size_t mipmap_bytes(int width, int height, int first) {
    std::size_t bytes = 0;
    for (int level = first; level < mipmap_count(width, height); ++level) {
        bytes += std::size_t{4} * static_cast<std::size_t>(std::max(width >> level, 1)) *
                 static_cast<std::size_t>(std::max(height >> level, 1));
    }
    return bytes;
}

std::vector<TextureImage> make_mipmaps(const TextureImage& image, TextureUse use,
                                       std::optional<float> cutoff, int first) {
    std::vector<TextureImage> made;
    if (first == 0) made.push_back(image);
    const ColourTables& tables = colour_tables();
    Level level = {image.width, image.height, {}};
    level.pixels.resize(image.rgba.size() / 4);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < level.pixels.size(); ++i) {
        for (std::size_t k = 0; k < 4; ++k) {
            const std::uint8_t value = image.rgba[4 * i + k];
            level.pixels[i][k] = use != TextureUse::data && k < 3
                                     ? tables.linear[value]
                                     : static_cast<float>(value) / 255.0f;
        }
        kept += cutoff && level.pixels[i][3] >= *cutoff ? 1u : 0u;
    }
    const double share = static_cast<double>(kept) / static_cast<double>(level.pixels.size());
    for (int i = 1; i < mipmap_count(image.width, image.height); ++i) {
        level = half_of(level, cutoff.has_value() || use == TextureUse::blended);
        if (i < first) continue;
        made.push_back(image_of(level, use, cutoff ? opacity_scale(level, share, *cutoff) : 1.0f));
    }
    return made;
}

std::vector<int> choose_first_mipmaps(std::span<const TextureDemand> textures, std::size_t limit) {
    std::vector<int> first;
    std::size_t sum = 0;
    for (const TextureDemand& texture : textures) {
        first.push_back(texture.least_first);
        sum += mipmap_bytes(texture.width, texture.height, texture.least_first);
    }
    while (sum > limit) {
        std::optional<std::size_t> least;
        std::size_t least_bytes = 0;
        for (std::size_t i = 0; i < textures.size(); ++i) {
            const TextureDemand& texture = textures[i];
            if (std::max(texture.width, texture.height) >> (first[i] + 1) < kLeastSide) continue;
            const std::size_t bytes = mipmap_bytes(texture.width, texture.height, first[i]);
            const bool goes_first =
                !least || texture.last_drawn < textures[*least].last_drawn ||
                (texture.last_drawn == textures[*least].last_drawn && bytes > least_bytes);
            if (!goes_first) continue;
            least = i;
            least_bytes = bytes;
        }
        if (!least) break;
        const TextureDemand& texture = textures[*least];
        sum -= least_bytes - mipmap_bytes(texture.width, texture.height, ++first[*least]);
    }
    return first;
}

}  // namespace terrane::internal
