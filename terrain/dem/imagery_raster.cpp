// SPDX-License-Identifier: MIT
#include "imagery/imagery_file.h"
#include "raster/guarded_calls.h"
#include "raster/raster_reader.h"

#include <terrane/dem/imagery_raster.h>
#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

namespace terrane {
namespace {

using internal::GuardedCalls;
using internal::ImageryFile;

class RasterImagery final : public ImagerySource {
public:
    RasterImagery(std::string path, std::shared_ptr<const ImageryFile> file, double read_timeout)
        : path_(std::move(path)), file_(std::move(file)), calls_(read_timeout) {}

    WorldRect rect() const override { return file_->info().rect; }
    double texel_size() const override {
        const WorldRect& rect = file_->info().rect;
        return std::min((rect.east - rect.west) / file_->info().columns,
                        (rect.north - rect.south) / file_->info().rows);
    }

    Result<void> read(const WorldRect& square, int side,
                      std::span<ImageryTexel> texels_out) const override {
        // a read that timed out continues, so it owns its buffer
        struct Read {
            std::vector<ImageryTexel> texels;
            Result<void> done;
        };
        const auto read = std::make_shared<Read>();
        read->texels.resize(texels_out.size());
        const bool answered = calls_.run([read, file = file_, square, side] {
            read->done = file->read(square, side, read->texels);
        });
        if (!answered) return internal::stopped_answering(path_, calls_.patience_s());
        if (!read->done) return read->done;
        std::copy(read->texels.begin(), read->texels.end(), texels_out.begin());
        return {};
    }

private:
    std::string path_;
    std::shared_ptr<const ImageryFile> file_;
    mutable GuardedCalls calls_;
};

Result<void> check_settings(const ImageryRasterSettings& settings) {
    if (!settings.bands.empty() && settings.bands.size() != 1 && settings.bands.size() != 3) {
        return fail(ErrorCode::invalid_argument,
                    "bands must be none, one for grey or three for red, green and blue, got " +
                        number_text(settings.bands.size()));
    }
    if (settings.read_timeout > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "read_timeout must be above 0 s, got " + number_text(settings.read_timeout));
}

}  // namespace

Result<std::shared_ptr<const ImagerySource>> ImageryRaster::open(
    const std::string& path, const ImageryRasterSettings& settings, ImageryRasterInfo* info_out) {
    if (auto ok = check_settings(settings); !ok) return tl::unexpected(ok.error());
    try {
        using Opened = Result<std::unique_ptr<ImageryFile>>;
        const auto opened = std::make_shared<Opened>();
        GuardedCalls calls(settings.read_timeout);
        const bool answered =
            calls.run([opened, path, settings] { *opened = ImageryFile::open(path, settings); });
        if (!answered) return internal::stopped_answering(path, settings.read_timeout);
        if (!*opened) return tl::unexpected(opened->error());
        const std::shared_ptr<const ImageryFile> file = std::move(**opened);
        if (info_out != nullptr) *info_out = file->info();
        return std::make_shared<const RasterImagery>(path, file, settings.read_timeout);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory,
                    "out of memory while opening raster \"" + path + "\"");
    }
}

}  // namespace terrane
