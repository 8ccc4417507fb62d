// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/imagery_raster.h>

#include <array>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

class GDALDataset;

namespace terrane::internal {

/// An open raster of colours on a grid along the world's axes.
class ImageryFile {
public:
    /// Fails: as ImageryRaster::open(), without a timeout
    static Result<std::unique_ptr<ImageryFile>> open(const std::string& path,
                                                     const ImageryRasterSettings& settings);
    ~ImageryFile();
    ImageryFile(const ImageryFile&) = delete;
    ImageryFile& operator=(const ImageryFile&) = delete;

    const ImageryRasterInfo& info() const { return info_; }
    /// As ImagerySource::read(). One reads at a time.
    Result<void> read(const WorldRect& square, int side, std::span<ImageryTexel> texels_out) const;

private:
    struct CloseDataset {
        void operator()(GDALDataset* dataset) const;
    };
    // The overlap of a square and the raster along one axis: texels of the square, and the part of the raster under
    // them.
    struct Range {
        int first = 0, count = 0;      // texels
        double low = 0.0, high = 0.0;  // samples
    };

    ImageryFile() = default;
    Result<void> choose_bands(const std::vector<int>& wanted);
    Result<void> straighten(const std::optional<DemInfo>& dem);
    Result<void> find_place(const std::optional<DemInfo>& dem);
    Result<void> read_band(int band, bool is_mask, const Range& columns, const Range& rows,
                           std::span<std::uint8_t> values_out) const;

    std::string path_;
    ImageryRasterInfo info_;
    bool has_palette_ = false;
    std::unique_ptr<GDALDataset, CloseDataset> file_;
    std::unique_ptr<GDALDataset, CloseDataset> warped_;  // of file_; closed before it
    GDALDataset* dataset_ = nullptr;                     // the one that is read
    std::vector<ImageryTexel> palette_;
    bool rows_go_north_ = false, columns_go_west_ = false;
    mutable std::mutex mutex_;  // a GDAL dataset serves one thread at a time
};

}  // namespace terrane::internal
