// SPDX-License-Identifier: MIT
#include <terrane/render/image.h>

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace terrane {
namespace {

// Limit for the size in a file header; no picture of ours is larger.
constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;

// Owns the memory of libpng's simplified interface.
struct PngImage {
    png_image png{};
    PngImage() { png.version = PNG_IMAGE_VERSION; }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
    ~PngImage() { png_image_free(&png); }
};

Result<void> check_image(const Image& image, const std::string& path) {
    if (image.width < 1 || image.height < 1 ||
        image.rgb.size() !=
            static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3) {
        return fail(ErrorCode::invalid_argument,
                    "cannot write " + path + ": a picture of " + std::to_string(image.width) +
                        " x " + std::to_string(image.height) + " pixels with " +
                        std::to_string(image.rgb.size()) + " bytes is none");
    }
    return {};
}

}  // namespace

Result<void> write_png(const Image& image, const std::string& path) {
    if (const Result<void> good = check_image(image, path); !good) return good;
    // beside the file, so that the rename stays on one file system
    const std::string part = path + ".part";
    const auto refuse = [&](const std::string& why) -> Result<void> {
        std::remove(part.c_str());
        return fail(ErrorCode::io, "cannot write " + path + ": " + why);
    };
    std::FILE* file = std::fopen(part.c_str(), "wb");
    if (file == nullptr) {
        return fail(ErrorCode::io, "cannot write " + path + ": " + std::strerror(errno));
    }
    PngImage out;
    out.png.width = static_cast<png_uint_32>(image.width);
    out.png.height = static_cast<png_uint_32>(image.height);
    out.png.format = PNG_FORMAT_RGB;
    // fast rather than small: about a tenth larger, for hundreds of frames
    out.png.flags = PNG_IMAGE_FLAG_FAST;
    const int is_written =
        png_image_write_to_stdio(&out.png, file, 0, image.rgb.data(), 0, nullptr);
    // a full disk may only show at the flush
    const bool is_flushed = std::fflush(file) == 0;
    const int flush_error = errno;
    std::fclose(file);
    if (is_written == 0) return refuse(static_cast<const char*>(out.png.message));
    if (!is_flushed) return refuse(std::strerror(flush_error));
    std::error_code error;
    std::filesystem::rename(part, path, error);
    if (error) return refuse(error.message());
    return {};
}

Result<Image> read_png(const std::string& path) {
    PngImage in;
    if (png_image_begin_read_from_file(&in.png, path.c_str()) == 0) {
        return fail(ErrorCode::io,
                    "cannot read " + path + ": " + static_cast<const char*>(in.png.message));
    }
    if (std::uint64_t{in.png.width} * in.png.height > kMaxPixels) {
        return fail(ErrorCode::io, "cannot read " + path + ": " + std::to_string(in.png.width) +
                                       " x " + std::to_string(in.png.height) +
                                       " pixels are too many");
    }
    in.png.format = PNG_FORMAT_RGB;
    Image image;
    image.width = static_cast<int>(in.png.width);
    image.height = static_cast<int>(in.png.height);
    image.rgb.resize(PNG_IMAGE_SIZE(in.png));
    const png_color black{0, 0, 0};
    if (png_image_finish_read(&in.png, &black, image.rgb.data(), 0, nullptr) == 0) {
        return fail(ErrorCode::io,
                    "cannot read " + path + ": " + static_cast<const char*>(in.png.message));
    }
    return image;
}

}  // namespace terrane
