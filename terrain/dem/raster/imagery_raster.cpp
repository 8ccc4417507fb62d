// SPDX-License-Identifier: MIT
#include "raster/cancellable_work.h"
#include "raster/crs_frame.h"
#include "raster/raster_checks.h"
#include "raster/raster_reader.h"

#include <terrane/base/text.h>
#include <terrane/dem/imagery_raster.h>

#include <gdal_priv.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// An open colour raster on an axis-aligned grid in the world.
class ImageryFile {
public:
    /// Fails: as ImageryRaster::open(), without a timeout
    static Result<std::unique_ptr<ImageryFile>> open(const std::string& path,
                                                     const ImageryRasterSettings& settings);
    ~ImageryFile();
    ImageryFile(const ImageryFile&) = delete;
    ImageryFile& operator=(const ImageryFile&) = delete;

    const ImageryRasterInfo& info() const { return info_; }
    /// As ImagerySource::read(). One thread at a time.
    Result<void> read(const WorldRect& square, int side, std::span<ImageryTexel> texels_out) const;

private:
    struct CloseDataset {
        void operator()(GDALDataset* dataset) const;
    };
    // The overlap of a square and the raster along one axis: texels of the square, and the samples under them.
    struct Range {
        int first = 0, count = 0;      // texels
        double low = 0.0, high = 0.0;  // samples
    };

    ImageryFile() = default;
    Result<void> choose_bands(const ImageryRasterSettings& settings);
    Result<void> find_stretch(const ImageryRasterSettings& settings);
    Result<void> straighten(const std::optional<DemInfo>& dem);
    Result<void> find_place(const std::optional<DemInfo>& dem);
    // Writes values of type GDT_Byte or GDT_Float32.
    Result<void> read_band(int band, bool is_mask, const Range& columns, const Range& rows,
                           GDALDataType type, void* values_out) const;
    Result<void> read_stretched(std::size_t band, const Range& columns, const Range& rows,
                                std::span<std::uint8_t> values_out) const;

    std::string path_;
    ImageryRasterInfo info_;
    bool has_palette_ = false;
    std::unique_ptr<GDALDataset, CloseDataset> file_;
    std::unique_ptr<GDALDataset, CloseDataset> warped_;  // view of file_; closed before it
    GDALDataset* dataset_ = nullptr;  // the dataset that is read: warped_ or file_
    std::vector<ImageryTexel> palette_;
    std::vector<std::array<double, 2>>
        stretch_;            // black and white of each band in use; empty: bytes as they are
    double exponent_ = 1.0;  // of stretched values
    bool rows_go_north_ = false, columns_go_west_ = false;
    mutable std::mutex mutex_;  // a GDAL dataset serves one thread at a time
};

void ImageryFile::CloseDataset::operator()(GDALDataset* dataset) const {
    const QuietGdal quiet;
    GDALClose(GDALDataset::ToHandle(dataset));
}

ImageryFile::~ImageryFile() { warped_.reset(); }

Result<std::unique_ptr<ImageryFile>> ImageryFile::open(const std::string& path,
                                                       const ImageryRasterSettings& settings) {
    TERRANE_TRY(check_is_file(path));
    register_drivers();
    const QuietGdal quiet;
    std::unique_ptr<ImageryFile> made(new ImageryFile);
    made->path_ = path;
    made->file_.reset(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
    if (!made->file_)
        return fail(ErrorCode::io, "cannot open " + named_raster(path) + ": " + quiet.message());
    std::optional<DemInfo> dem = settings.aligned_with;
    const OGRSpatialReference* crs = made->file_->GetSpatialRef();
    if (crs == nullptr || (dem && dem->crs_wkt.empty())) dem.reset();
    TERRANE_TRY(made->choose_bands(settings));
    TERRANE_TRY(made->straighten(dem));
    TERRANE_TRY(made->find_place(dem));
    TERRANE_TRY(made->find_stretch(settings));
    return made;
}

Result<void> ImageryFile::choose_bands(const ImageryRasterSettings& settings) {
    const std::vector<int>& wanted = settings.bands;
    const bool has_limits = settings.limits || settings.percentiles;
    const int count = file_->GetRasterCount();
    if (count < 1) return fail(ErrorCode::bad_data, named_raster(path_) + " has 0 bands");
    info_.bands = wanted.empty() ? bands_by_colour(*file_) : wanted;
    for (const int band : info_.bands) {
        if (band < 1 || band > count) {
            return fail(ErrorCode::invalid_argument, named_raster(path_) + " has bands 1 to " +
                                                         std::to_string(count) + ", got band " +
                                                         std::to_string(band));
        }
        const GDALDataType type = file_->GetRasterBand(band)->GetRasterDataType();
        const bool is_readable =
            type == GDT_Byte || (has_limits && GDALDataTypeIsComplex(type) == FALSE);
        if (!is_readable) {
            return fail(ErrorCode::bad_data, named_raster(path_) + " has " +
                                                 GDALGetDataTypeName(type) + " samples in band " +
                                                 std::to_string(band) +
                                                 (has_limits ? ", imagery needs real ones"
                                                             : ", imagery needs 8-bit ones, or "
                                                               "limits or percentiles"));
        }
    }
    const GDALColorTable* table = file_->GetRasterBand(info_.bands[0])->GetColorTable();
    has_palette_ = info_.bands.size() == 1 && table != nullptr;
    if (!has_palette_) return {};
    if (has_limits || settings.gamma != 1.0) {
        return fail(ErrorCode::bad_data,
                    named_raster(path_) + " has a palette, whose colours are not stretched");
    }
    palette_.assign(256, ImageryTexel{});
    for (int i = 0; i < std::min(table->GetColorEntryCount(), 256); ++i) {
        GDALColorEntry entry;
        table->GetColorEntryAsRGB(i, &entry);
        const auto byte = [](short value) { return static_cast<std::uint8_t>(value); };
        palette_[static_cast<std::size_t>(i)] = {byte(entry.c1), byte(entry.c2), byte(entry.c3),
                                                 byte(entry.c4)};
    }
    return {};
}

// Replaces a rotated raster, or one in another CRS than the DEM's, by GDAL's warped view of it.
Result<void> ImageryFile::straighten(const std::optional<DemInfo>& dem) {
    const QuietGdal quiet;
    dataset_ = file_.get();
    const auto transform = geotransform_of(*file_);
    if (transform) {
        TERRANE_TRY(check_geotransform(path_, *transform));
    }
    const OGRSpatialReference* crs = file_->GetSpatialRef();
    if (crs != nullptr && crs->GetName() != nullptr) info_.crs = crs->GetName();
    const bool is_rotated = transform && ((*transform)[2] != 0.0 || (*transform)[4] != 0.0);
    bool is_foreign = false;
    if (dem) {
        // In the axis order of GDAL's datasets, because IsSame() also compares axis orders.
        const auto wanted = import_crs(dem->crs_wkt);
        is_foreign = wanted == nullptr || crs->IsSame(wanted.get()) == 0;
    }
    if (!is_rotated && !is_foreign && (transform || file_->GetGCPCount() == 0)) return {};
    // An added alpha band marks texels beyond the raster.
    std::vector<std::string> words = {"-of", "VRT", "-r", has_palette_ ? "near" : "bilinear",
                                      "-dstalpha"};
    if (is_foreign) words.insert(words.end(), {"-t_srs", dem->crs_wkt});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    GDALWarpAppOptions* options = GDALWarpAppOptionsNew(arguments.data(), nullptr);
    GDALDatasetH source = GDALDataset::ToHandle(file_.get());
    int usage_error = 0;
    warped_.reset(
        GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &source, options, &usage_error)));
    GDALWarpAppOptionsFree(options);
    if (!warped_) {
        return fail(ErrorCode::bad_data, "cannot bring " + named_raster(path_) +
                                             " into the ground's CRS: " + quiet.message());
    }
    dataset_ = warped_.get();
    return {};
}

Result<void> ImageryFile::find_place(const std::optional<DemInfo>& dem) {
    const QuietGdal quiet;
    info_.columns = dataset_->GetRasterXSize();
    info_.rows = dataset_->GetRasterYSize();
    const double columns = info_.columns, rows = info_.rows;
    const std::array<double, 6> transform =
        geotransform_of(*dataset_).value_or(std::array<double, 6>{0.0, 1.0, 0.0, rows, 0.0, -1.0});
    columns_go_west_ = transform[1] < 0.0;
    rows_go_north_ = transform[5] > 0.0;
    const CrsRect rect{
        transform[0] + 0.5 * columns * transform[1], transform[3] + 0.5 * rows * transform[5],
        0.5 * columns * std::fabs(transform[1]), 0.5 * rows * std::fabs(transform[5])};
    WorldFrame frame{rect.centre_x, rect.centre_y};
    if (dem) {
        frame = world_frame_of(*dem);
    } else if (const OGRSpatialReference* crs = dataset_->GetSpatialRef(); crs != nullptr) {
        const auto plane = crs_scale_of(*crs, rect);
        if (!plane) {
            return fail(plane.error().code, named_raster(path_) + " " + plane.error().message);
        }
        frame.metres_x = plane->metres_x;
        frame.metres_y = plane->metres_y;
    }
    DemInfo cells;
    cells.cell_x = std::fabs(transform[1]) * frame.metres_x;
    cells.cell_y = std::fabs(transform[5]) * frame.metres_y;
    TERRANE_TRY(check_cells(path_, cells));
    info_.rect = frame.rect_of(rect);
    if (!dem) return {};
    const double half_x = 0.5 * dem->columns * dem->cell_x, half_y = 0.5 * dem->rows * dem->cell_y;
    const WorldRect& at = info_.rect;
    if (at.west < half_x && at.east > -half_x && at.south < half_y && at.north > -half_y) return {};
    const auto text = [](const WorldRect& r) {
        return "x " + number_text(r.west) + " to " + number_text(r.east) + " m, y " +
               number_text(r.south) + " to " + number_text(r.north) + " m";
    };
    return fail(ErrorCode::bad_data, named_raster(path_) + " covers " + text(at) +
                                         " of the world, and does not meet the ground, " +
                                         text({-half_x, -half_y, half_x, half_y}));
}

// Finds black and white of each band. Percentiles are those of a grid of the values with data.
Result<void> ImageryFile::find_stretch(const ImageryRasterSettings& settings) {
    constexpr int kMostAlong = 512;
    constexpr std::array<double, 2> kBytes{0.0, 255.0};
    if (!settings.limits && !settings.percentiles && settings.gamma == 1.0) return {};
    exponent_ = 1.0 / settings.gamma;
    stretch_.assign(info_.bands.size(), settings.limits.value_or(kBytes));
    if (!settings.percentiles) return {};
    const Range columns{0, std::min(info_.columns, kMostAlong), 0.0, 1.0 * info_.columns};
    const Range rows{0, std::min(info_.rows, kMostAlong), 0.0, 1.0 * info_.rows};
    const auto count =
        static_cast<std::size_t>(columns.count) * static_cast<std::size_t>(rows.count);
    const QuietGdal quiet;
    for (std::size_t i = 0; i < stretch_.size(); ++i) {
        std::vector<float> values(count);
        std::vector<std::uint8_t> mask(count);
        auto read = read_band(info_.bands[i], false, columns, rows, GDT_Float32, values.data());
        if (read) read = read_band(info_.bands[i], true, columns, rows, GDT_Byte, mask.data());
        if (!read) return fail(read.error().code, read.error().message + ": " + quiet.message());
        std::vector<float> sorted;
        for (std::size_t at = 0; at < count; ++at) {
            if (mask[at] > 0 && std::isfinite(values[at])) sorted.push_back(values[at]);
        }
        if (sorted.empty()) continue;  // nothing is displayed
        std::sort(sorted.begin(), sorted.end());
        const auto at_percent = [&](double percent) {
            const double place = 0.01 * percent * static_cast<double>(sorted.size() - 1);
            return double{sorted[static_cast<std::size_t>(std::lround(place))]};
        };
        stretch_[i] = {at_percent((*settings.percentiles)[0]),
                       at_percent((*settings.percentiles)[1])};
    }
    return {};
}

Result<void> ImageryFile::read_stretched(std::size_t band, const Range& columns, const Range& rows,
                                         std::span<std::uint8_t> values_out) const {
    std::vector<float> raw(values_out.size());
    TERRANE_TRY(read_band(info_.bands[band], false, columns, rows, GDT_Float32, raw.data()));
    const auto [black, white] = stretch_[band];
    for (std::size_t i = 0; i < raw.size(); ++i) {
        // a band with one value is white
        const double share = white > black ? (double{raw[i]} - black) / (white - black) : 1.0;
        const double shown = share > 0.0 ? std::pow(std::min(share, 1.0), exponent_) : 0.0;
        values_out[i] = static_cast<std::uint8_t>(std::lround(255.0 * shown));
    }
    return {};
}

Result<void> ImageryFile::read_band(int band, bool is_mask, const Range& columns, const Range& rows,
                                    GDALDataType type, void* values_out) const {
    GDALRasterBand* from = dataset_->GetRasterBand(band);
    if (is_mask) from = from->GetMaskBand();
    GDALRasterIOExtraArg extra;
    INIT_RASTERIO_EXTRA_ARG(extra);
    const bool is_coarser = columns.high - columns.low > columns.count;
    extra.eResampleAlg = has_palette_ ? GRIORA_NearestNeighbour
                         : is_coarser ? GRIORA_Average
                                      : GRIORA_Bilinear;
    extra.bFloatingPointWindowValidity = TRUE;
    extra.dfXOff = columns.low;
    extra.dfYOff = rows.low;
    extra.dfXSize = columns.high - columns.low;
    extra.dfYSize = rows.high - rows.low;
    // GDAL also needs the window of whole samples around the range.
    const auto begin = [](double low) { return static_cast<int>(std::floor(low)); };
    const auto count = [&](const Range& range, int most) {
        return std::min(static_cast<int>(std::ceil(range.high)), most) - begin(range.low);
    };
    if (from->RasterIO(GF_Read, begin(columns.low), begin(rows.low), count(columns, info_.columns),
                       count(rows, info_.rows), values_out, columns.count, rows.count, type, 0, 0,
                       &extra) == CE_None) {
        return {};
    }
    return fail(ErrorCode::io, "cannot read " + named_raster(path_));
}

Result<void> ImageryFile::read(const WorldRect& square, int side,
                               std::span<ImageryTexel> texels_out) const {
    std::fill(texels_out.begin(), texels_out.end(), ImageryTexel{});
    // Texels whose centres are in the raster, along an axis from west to east or south to north.
    const auto range_of = [side](double low, double high, double first, double last, int samples,
                                 bool is_reversed) {
        const double texel = (high - low) / side;
        Range range;
        range.first = std::clamp(
            static_cast<int>(std::ceil(std::clamp((first - low) / texel - 0.5, -1.0, side + 1.0))),
            0, side);
        const int end = std::clamp(
            static_cast<int>(std::ceil(std::clamp((last - low) / texel - 0.5, -1.0, side + 1.0))),
            range.first, side);
        range.count = end - range.first;
        const double per_metre = samples / (last - first);
        range.low = std::clamp((low + range.first * texel - first) * per_metre, 0.0, 1.0 * samples);
        range.high = std::clamp((low + end * texel - first) * per_metre, 0.0, 1.0 * samples);
        if (is_reversed)
            range = {range.first, range.count, samples - range.high, samples - range.low};
        return range;
    };
    const WorldRect& rect = info_.rect;
    const Range columns =
        range_of(square.west, square.east, rect.west, rect.east, info_.columns, columns_go_west_);
    const Range rows =
        range_of(square.south, square.north, rect.south, rect.north, info_.rows, !rows_go_north_);
    if (columns.count == 0 || rows.count == 0) return {};
    const std::size_t count =
        static_cast<std::size_t>(columns.count) * static_cast<std::size_t>(rows.count);
    const std::size_t band_count = info_.bands.size();
    std::vector<std::uint8_t> values((band_count + 1) * count);
    {
        const std::lock_guard lock(mutex_);
        const QuietGdal quiet;
        for (std::size_t i = 0; i <= band_count; ++i) {
            const bool is_mask = i == band_count;
            const auto out = std::span(values).subspan(i * count, count);
            const auto read = stretch_.empty() || is_mask
                                  ? read_band(info_.bands[is_mask ? 0 : i], is_mask, columns, rows,
                                              GDT_Byte, out.data())
                                  : read_stretched(i, columns, rows, out);
            if (!read)
                return fail(read.error().code, read.error().message + ": " + quiet.message());
        }
    }
    for (int row = 0; row < rows.count; ++row) {
        const int from_row = rows_go_north_ ? row : rows.count - 1 - row;
        for (int column = 0; column < columns.count; ++column) {
            const int from_column = columns_go_west_ ? columns.count - 1 - column : column;
            const auto from = static_cast<std::size_t>(from_row * columns.count + from_column);
            ImageryTexel& texel = texels_out[static_cast<std::size_t>((rows.first + row) * side +
                                                                      columns.first + column)];
            const auto value = [&](std::size_t band) {
                return values[std::min(band, band_count - 1) * count + from];
            };
            const std::uint8_t mask = values[band_count * count + from];
            if (has_palette_) {
                texel = palette_[value(0)];
                texel[3] = std::min(texel[3], mask);
            } else {
                texel = {value(0), value(1), value(2), mask};
            }
        }
    }
    return {};
}

}  // namespace terrane::internal

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
        // A read that timed out continues, so it owns its buffer.
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
    const auto check_pair = [](const std::string& name, const std::array<double, 2>& pair,
                               double low, double high) -> Result<void> {
        if (pair[0] >= low && pair[1] <= high && pair[0] < pair[1]) return {};
        return fail(ErrorCode::invalid_argument, name + " must be two ascending numbers from " +
                                                     number_text(low) + " to " + number_text(high) +
                                                     ", got " + number_text(pair[0]) + " and " +
                                                     number_text(pair[1]));
    };
    if (settings.limits) TERRANE_TRY(check_pair("limits", *settings.limits, -1e30, 1e30));
    if (settings.percentiles)
        TERRANE_TRY(check_pair("percentiles", *settings.percentiles, 0.0, 100.0));
    if (settings.limits && settings.percentiles) {
        return fail(ErrorCode::invalid_argument, "give limits or percentiles, not both");
    }
    if (!(settings.gamma >= 0.1 && settings.gamma <= 10.0)) {
        return fail(ErrorCode::invalid_argument,
                    "gamma must be 0.1 to 10, got " + number_text(settings.gamma));
    }
    if (settings.read_timeout > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "read_timeout must be above 0 s, got " + number_text(settings.read_timeout));
}

}  // namespace

Result<std::shared_ptr<const ImagerySource>> ImageryRaster::open(
    const std::string& path, const ImageryRasterSettings& settings, ImageryRasterInfo* info_out) {
    TERRANE_TRY(check_settings(settings));
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
