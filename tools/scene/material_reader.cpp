// SPDX-License-Identifier: MIT
//
// Images of textures, and Wavefront material files. Images are decoded here, not in the renderer, which takes pixels.
// PNG is decoded by libpng, which the pictures need anyway: it expands palettes, 16 bits and transparent colours. JPEG
// is decoded by GDAL, which the heights need anyway: no further library.
#include "scene/mesh_files.h"

#include <terrane/render/material.h>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_vsi.h>
#include <fmt/format.h>
#include <gdal.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

/// Fails: bad_data for an image of too many pixels: called before memory for them is allocated.
Result<void> check_size(std::uint64_t width, std::uint64_t height) {
    if (width == 0 || height == 0) return fail(ErrorCode::bad_data, "it has no pixels");
    constexpr auto kMostSide = static_cast<std::uint64_t>(kLargestTextureSide);
    if (width <= kMostSide && height <= kMostSide && width * height <= kMostTexturePixels)
        return {};
    return fail(ErrorCode::bad_data,
                fmt::format("it has {} x {} pixels, more than {} a side or {} in all", width,
                            height, kLargestTextureSide, kMostTexturePixels));
}

Result<TextureImage> decode_png(std::string_view bytes) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    const auto refuse = [&] {
        std::string message(png.message);
        png_image_free(&png);
        return fail(ErrorCode::bad_data, "libpng: " + message);
    };
    if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return refuse();
    if (const Result<void> good = check_size(png.width, png.height); !good) {
        png_image_free(&png);
        return tl::unexpected(good.error());
    }
    TextureImage image = {static_cast<int>(png.width), static_cast<int>(png.height), {}};
    png.format = PNG_FORMAT_RGBA;
    image.rgba.resize(PNG_IMAGE_SIZE(png));
    if (png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr) == 0) return refuse();
    return image;
}

/// A file in memory for GDAL, removed by the destructor.
class MemoryFile {
public:
    explicit MemoryFile(std::string_view bytes) {
        static std::atomic<std::uint64_t> count = 0;
        name_ = fmt::format("/vsimem/terrane_texture_{}", count++);
        std::vector<GByte> copy(bytes.begin(), bytes.end());
        if (VSILFILE* const file = VSIFOpenL(name_.c_str(), "wb"); file != nullptr) {
            VSIFWriteL(copy.data(), 1, copy.size(), file);
            VSIFCloseL(file);
        }
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { VSIUnlink(name_.c_str()); }
    const char* name() const { return name_.c_str(); }

private:
    std::string name_;
};

/// Keeps GDAL from printing errors, and makes it report damaged JPEG data as errors.
class StrictGdal {
public:
    StrictGdal() {
        CPLPushErrorHandler(CPLQuietErrorHandler);
        CPLErrorReset();
        CPLSetThreadLocalConfigOption(kWarnings, "TRUE");
    }
    StrictGdal(const StrictGdal&) = delete;
    StrictGdal& operator=(const StrictGdal&) = delete;
    ~StrictGdal() {
        CPLSetThreadLocalConfigOption(kWarnings, nullptr);
        CPLPopErrorHandler();
    }

private:
    static constexpr const char* kWarnings = "GDAL_ERROR_ON_LIBJPEG_WARNING";
};

Result<TextureImage> decode_jpeg(std::string_view bytes) {
    GDALAllRegister();
    const StrictGdal strict;
    const MemoryFile file(bytes);
    const auto reason = [] {
        std::string text = CPLGetLastErrorMsg();
        std::ranges::replace(text, '\n', ' ');
        return text.empty() ? std::string("GDAL gives no reason") : text;
    };
    constexpr std::array<const char*, 2> kDrivers = {"JPEG", nullptr};
    struct Closer {
        void operator()(void* dataset) const { GDALClose(dataset); }
    };
    const std::unique_ptr<void, Closer> dataset(GDALOpenEx(
        file.name(), GDAL_OF_RASTER | GDAL_OF_READONLY, kDrivers.data(), nullptr, nullptr));
    if (dataset == nullptr) return fail(ErrorCode::bad_data, reason());
    const int width = GDALGetRasterXSize(dataset.get()), height = GDALGetRasterYSize(dataset.get());
    TERRANE_TRY(check_size(static_cast<std::uint64_t>(width), static_cast<std::uint64_t>(height)));
    const int bands = GDALGetRasterCount(dataset.get());
    if (bands != 1 && bands != 3)
        return fail(ErrorCode::bad_data, fmt::format("a JPEG with {} channels", bands));
    TextureImage image = {width, height, {}};
    image.rgba.assign(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 255);
    for (int channel = 0; channel < 3; ++channel) {
        const GDALRasterBandH band = GDALGetRasterBand(dataset.get(), bands == 1 ? 1 : channel + 1);
        const CPLErr error =
            GDALRasterIO(band, GF_Read, 0, 0, width, height, image.rgba.data() + channel, width,
                         height, GDT_Byte, 4, 4 * width);
        if (error != CE_None) return fail(ErrorCode::bad_data, reason());
    }
    return image;
}

bool is_number(std::string_view word) {
    double value = 0.0;
    return std::from_chars(word.data(), word.data() + word.size(), value).ec == std::errc();
}

/// The file that a line such as "map_Kd -clamp on -s 2 2 1 wood.png" names, and its wrap; options have one or more
/// arguments: numbers, "on", "off" or the name of a channel.
struct MapLine {
    std::string file;
    TextureWrap wrap = TextureWrap::repeat;
};

MapLine read_map(std::string_view rest) {
    MapLine made;
    for (rest = trimmed(rest); rest.starts_with('-'); rest = trimmed(rest)) {
        const std::string_view option = read_word(rest);
        std::string_view after = rest;
        std::string_view argument = read_word(after);
        if (option == "-clamp" && argument == "on") made.wrap = TextureWrap::clamp;
        if (!is_number(argument)) {
            rest = after;
            continue;
        }
        // the last word is the file, whatever it looks like
        while (is_number(argument) && !trimmed(after).empty()) {
            rest = after;
            argument = read_word(after);
        }
    }
    made.file = std::string(rest);
    std::ranges::replace(made.file, '\\', '/');
    return made;
}

}  // namespace

bool is_path_below(const std::filesystem::path& name) {
    return name.is_relative() && !name.empty() && name.string().find(':') == std::string::npos &&
           std::ranges::none_of(name, [](const auto& step) { return step == ".."; });
}

Result<std::shared_ptr<const TextureImage>> decode_image(std::string_view bytes) {
    constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n", kJpeg = "\xff\xd8\xff";
    if (!bytes.starts_with(kPng) && !bytes.starts_with(kJpeg))
        return fail(ErrorCode::bad_data, "it is no PNG or JPEG image");
    TERRANE_TRY(TextureImage image,
                bytes.starts_with(kPng) ? decode_png(bytes) : decode_jpeg(bytes));
    return std::make_shared<const TextureImage>(std::move(image));
}

Result<std::shared_ptr<const TextureImage>> read_image(const std::string& folder,
                                                       const std::string& name) {
    if (!is_path_below(name))
        return fail(ErrorCode::bad_data, "it must be in the file's folder or below it");
    TERRANE_TRY(const std::string bytes,
                read_whole_file((std::filesystem::path(folder) / name).string()));
    return decode_image(bytes);
}

std::map<std::string, MeshMaterial> read_mtl(const std::string& folder, const std::string& name,
                                             MeshLosses& left_out) {
    std::map<std::string, MeshMaterial> made;
    if (!is_path_below(name)) {
        left_out.textures.push_back(
            fmt::format("materials '{:.60}' must be in the file's folder or below it", name));
        return made;
    }
    const auto text = read_whole_file((std::filesystem::path(folder) / name).string());
    if (!text) {
        left_out.textures.push_back(
            fmt::format("materials '{:.60}': {}", name, text.error().message));
        return made;
    }
    std::map<std::string, std::shared_ptr<const TextureImage>> images;
    MeshMaterial* current = nullptr;
    for (std::string_view rest = *text; !rest.empty();) {
        std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(line.size() + 1, rest.size()));
        const std::string_view keyword = read_word(line);
        if (keyword == "newmtl") current = &made[std::string(trimmed(line))];
        if (current == nullptr) continue;
        MeshMaterial& material = *current;
        if (keyword == "Kd") {
            for (std::uint8_t& level : material.colour) {
                const std::string_view word = read_word(line);
                double value = 0.0;
                std::from_chars(word.data(), word.data() + word.size(), value);
                // NaN becomes 0
                level = static_cast<std::uint8_t>(
                    255.0 * (value > 0.0 ? std::min(value, 1.0) : 0.0) + 0.5);
            }
        }
        // a texture of opacity says that the opacity of the colours matters
        if (keyword == "map_d") material.alpha_cutoff = 0.5f;
        if (keyword != "map_Kd" && keyword != "norm") continue;
        const MapLine map = read_map(line);
        const auto [image, is_new] = images.try_emplace(map.file);
        if (is_new) {
            if (auto read = read_image(folder, map.file)) {
                image->second = *read;
            } else {
                left_out.textures.push_back(
                    fmt::format("texture '{:.60}': {}", map.file, read.error().message));
            }
        }
        (keyword == "norm" ? material.normal_texture : material.colour_texture) = {
            .image = image->second, .wrap_right = map.wrap, .wrap_up = map.wrap};
    }
    return made;
}

}  // namespace terrane::tools
