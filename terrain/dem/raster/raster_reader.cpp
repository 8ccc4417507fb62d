// SPDX-License-Identifier: MIT
#include "raster/raster_reader.h"

#include "raster/cancellable_work.h"
#include "raster/crs_frame.h"
#include "raster/raster_checks.h"

#include <terrane/base/text.h>

#include <cpl_error.h>
#include <gdal_priv.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string_view>
#include <vector>

namespace terrane::internal {
namespace {

/// The names of a dataset's subdatasets.
std::vector<std::string> subdatasets_of(GDALDataset& dataset) {
    constexpr std::string_view kKey = "_NAME=";
    std::vector<std::string> names;
    char** items = dataset.GetMetadata("SUBDATASETS");
    for (; items != nullptr && *items != nullptr; ++items) {
        const std::string_view item = *items;
        const std::size_t at = item.find(kKey);
        if (at != std::string_view::npos) names.emplace_back(item.substr(at + kKey.size()));
    }
    return names;
}

/// The first names, for messages.
std::string list_of(const std::vector<std::string>& names) {
    constexpr std::size_t kMostNamed = 8;
    std::string list;
    for (std::size_t i = 0; i < std::min(names.size(), kMostNamed); ++i) {
        if (i > 0) list += ", ";
        list += names[i];
    }
    if (names.size() > kMostNamed) list += ", ...";
    return list;
}

/// Sets coefficients that only rounding has kept from being 0: of a turn by a multiple of 90 degrees.
void clear_rounding(std::array<double, 6>& transform) {
    constexpr double kRounding = 1e-12;
    double largest = 0.0;
    for (const std::size_t i : {1u, 2u, 4u, 5u}) {
        largest = std::max(largest, std::fabs(transform[i]));
    }
    for (const std::size_t i : {1u, 2u, 4u, 5u}) {
        if (std::fabs(transform[i]) <= kRounding * largest) transform[i] = 0.0;
    }
}

/// The smallest rectangle around a transformed one: smallest x and y, largest x and y.
std::array<double, 4> rect_around(const std::array<double, 4>& rect,
                                  const std::array<double, 6>& transform) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::array<double, 4> around{kInfinity, kInfinity, -kInfinity, -kInfinity};
    for (const double x : {rect[0], rect[2]}) {
        for (const double y : {rect[1], rect[3]}) {
            const double to_x = transform[0] + transform[1] * x + transform[2] * y;
            const double to_y = transform[3] + transform[4] * x + transform[5] * y;
            around = {std::min(around[0], to_x), std::min(around[1], to_y),
                      std::max(around[2], to_x), std::max(around[3], to_y)};
        }
    }
    return around;
}

}  // namespace

QuietGdal::QuietGdal() {
    CPLPushErrorHandler(CPLQuietErrorHandler);
    CPLErrorReset();
}
QuietGdal::~QuietGdal() { CPLPopErrorHandler(); }

std::string QuietGdal::message() const {
    std::string text = CPLGetLastErrorMsg();
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text.empty() ? "GDAL gives no reason" : text;
}

void register_drivers() {
    static const bool done = [] {
        GDALAllRegister();
        return true;
    }();
    static_cast<void>(done);
}

void RasterReader::CloseDataset::operator()(GDALDataset* dataset) const {
    const QuietGdal quiet;
    GDALClose(GDALDataset::ToHandle(dataset));
}

// Closes views before the datasets that they read.
RasterReader::~RasterReader() {
    warped_.reset();
    file_.reset();
}

Result<std::unique_ptr<RasterReader>> RasterReader::open(const std::string& path,
                                                         RasterNumbers numbers,
                                                         const NumberReading& reading) {
    TERRANE_TRY(check_is_file(path));
    register_drivers();
    const QuietGdal quiet;
    std::unique_ptr<RasterReader> reader(new RasterReader);
    reader->path_ = path;
    reader->numbers_ = numbers;
    reader->reading_ = reading;
    reader->file_.reset(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
    if (!reader->file_) {
        return fail(ErrorCode::io, "cannot open " + named_raster(path) + ": " + quiet.message());
    }
    const std::vector<std::string> subdatasets = subdatasets_of(*reader->file_);
    if (reader->file_->GetRasterCount() < 1) {
        if (subdatasets.empty()) {
            return fail(ErrorCode::bad_data, named_raster(path) + " has 0 bands");
        }
        return fail(ErrorCode::bad_data,
                    named_raster(path) + " has " + std::to_string(subdatasets.size()) +
                        " subdatasets, give one of them instead: " + list_of(subdatasets));
    }
    if (subdatasets.size() > 1) {
        reader->info_.notes.push_back(
            named_raster(path) + " has " + std::to_string(subdatasets.size()) +
            " subdatasets, of which the default is read: " + list_of(subdatasets));
    }
    TERRANE_TRY(reader->meaning_,
                read_meaning(path, *reader->file_, numbers, reading, reader->info_));
    if (reading.crop) TERRANE_TRY(reader->crop());
    TERRANE_TRY(reader->straighten());
    TERRANE_TRY(reader->find_place());
    return reader;
}

std::string RasterReader::file_versions() const {
    const std::lock_guard lock(mutex_);
    const QuietGdal quiet;
    char** const files = (whole_ ? *whole_ : *file_).GetFileList();
    std::vector<std::string> versions;
    for (char** file = files; file != nullptr && *file != nullptr; ++file) {
        VSIStatBufL status;
        if (VSIStatL(*file, &status) != 0) continue;
        versions.push_back(std::string(CPLGetFilename(*file)) + ", " +
                           std::to_string(status.st_size) + " bytes, " +
                           std::to_string(status.st_mtime) + "\n");
    }
    CSLDestroy(files);
    std::ranges::sort(versions);
    std::string text;
    for (const std::string& version : versions) text += version;
    return text;
}

Result<std::unique_ptr<RasterReader>> RasterReader::open(const std::string& path, double patience_s,
                                                         RasterNumbers numbers,
                                                         const NumberReading& reading) {
    GuardedCalls calls(patience_s);
    using Opened = Result<std::unique_ptr<RasterReader>>;
    const auto opened = std::make_shared<Opened>();
    const bool answered =
        calls.run([opened, path, numbers, reading] { *opened = open(path, numbers, reading); });
    if (!answered) return stopped_answering(path, patience_s);
    return std::move(*opened);
}

tl::unexpected<Error> stopped_answering(const std::string& path, double patience_s) {
    char seconds[40];
    std::snprintf(seconds, sizeof seconds, "%.3g", patience_s);
    return fail(
        ErrorCode::timed_out,
        named_raster(path) + " stopped answering: GDAL has read nothing for " + seconds + " s");
}

Result<void> RasterReader::check_placement() {
    const std::string name = named_raster(path_);
    const bool is_cell_set = reading_.cell > 0.0;
    if (transform_ || points_) {
        if (!is_cell_set || is_resampled()) return {};
        return fail(ErrorCode::bad_data,
                    name + " has " + info_.placement +
                        "; the side of a cell (--cell-m, DemSettings::cell) is only for rasters "
                        "without georeferencing, and for those that are rotated or projected");
    }
    std::array<char, 40> cell{};
    std::snprintf(cell.data(), cell.size(), "%.6g m", is_cell_set ? reading_.cell : 1.0);
    info_.placement =
        std::string("none: cells of ") + cell.data() + (is_cell_set ? ", as set" : ", assumed");
    if (const OGRSpatialReference* crs = file_->GetSpatialRef(); crs != nullptr) {
        info_.notes.push_back(name + " has the CRS \"" +
                              (crs->GetName() != nullptr ? crs->GetName() : "") +
                              "\" but no geotransform: the CRS is not used");
    }
    const char* unread = file_->GetMetadata("RPC") != nullptr           ? "a rational polynomial"
                         : file_->GetMetadata("GEOLOCATION") != nullptr ? "a geolocation array"
                                                                        : nullptr;
    if (unread != nullptr) {
        info_.notes.push_back(name + " is georeferenced by " + unread +
                              ", which is not read; gdalwarp can apply it");
    }
    const bool is_unit_assumed =
        numbers_ == RasterNumbers::heights && info_.height_unit == "metre, assumed";
    std::string assumed;
    if (!is_cell_set) assumed = std::string("cells of ") + cell.data() + " (--cell-m)";
    if (is_unit_assumed) {
        assumed +=
            (assumed.empty() ? "" : " and ") + std::string("numbers in metres (--height-scale)");
    }
    if (!assumed.empty()) {
        info_.notes.push_back(name + " has no georeferencing: " + assumed + " are assumed");
    }
    return {};
}

Result<void> RasterReader::crop() {
    const QuietGdal quiet;
    const std::string name = named_raster(path_);
    const std::array<double, 4>& crop = *reading_.crop;
    const double columns = file_->GetRasterXSize(), rows = file_->GetRasterYSize();
    std::optional<std::array<double, 6>> crs_from_pixel = geotransform_of(*file_);
    if (!crs_from_pixel && file_->GetGCPCount() > 0) {
        return fail(ErrorCode::bad_data, name +
                                             " has ground control points, so that it cannot be "
                                             "cropped: straighten it first, with gdalwarp for "
                                             "example");
    }
    if (crs_from_pixel) {
        TERRANE_TRY(check_geotransform(path_, *crs_from_pixel));
        clear_rounding(*crs_from_pixel);
    } else {
        const double side = reading_.cell > 0.0 ? reading_.cell : 1.0;
        crs_from_pixel = {0.0, side, 0.0, rows * side, 0.0, -side};
    }
    std::array<double, 6> pixel_from_crs{};
    if (GDALInvGeoTransform(crs_from_pixel->data(), pixel_from_crs.data()) == 0) {
        return fail(ErrorCode::bad_data, name + " has cells without area");
    }
    const std::array<double, 4> pixels = rect_around(crop, pixel_from_crs);
    if (!(pixels[0] < columns && pixels[1] < rows && pixels[2] > 0.0 && pixels[3] > 0.0)) {
        const std::array<double, 4> all = rect_around({0.0, 0.0, columns, rows}, *crs_from_pixel);
        return fail(ErrorCode::bad_data, "crop " + crop_text(crop) + " is outside " + name +
                                             ", which extends over " + crop_text(all));
    }
    // A sample is in the middle of its pixel. Numbers of pixels have rounding errors.
    constexpr double kRounding = 1e-6;
    const auto first_below = [](double pixel, double count) {
        return std::clamp(std::floor(pixel - 0.5 + kRounding), 0.0, count);
    };
    const auto end_above = [](double pixel, double count) {
        return std::clamp(std::ceil(pixel - 0.5 - kRounding) + 1.0, 0.0, count);
    };
    const double column = first_below(pixels[0], columns), row = first_below(pixels[1], rows);
    std::vector<std::string> words = {"-of", "VRT", "-srcwin"};
    for (const double number :
         {column, row, end_above(pixels[2], columns) - column, end_above(pixels[3], rows) - row}) {
        words.push_back(std::to_string(static_cast<std::int64_t>(number)));
    }
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    GDALTranslateOptions* options = GDALTranslateOptionsNew(arguments.data(), nullptr);
    int usage_error = 0;
    GDALDatasetH view =
        GDALTranslate("", GDALDataset::ToHandle(file_.get()), options, &usage_error);
    GDALTranslateOptionsFree(options);
    if (view == nullptr) {
        return fail(ErrorCode::io, "cannot crop " + name + ": " + quiet.message());
    }
    whole_ = std::move(file_);
    file_.reset(GDALDataset::FromHandle(view));
    return {};
}

// Replaces the file by GDAL's warped view of it, on axes that point east and north.
Result<void> RasterReader::warp() {
    const QuietGdal quiet;
    if (meaning_.is_decoded()) {
        return fail(ErrorCode::bad_data, named_raster(path_) + " has " + info_.placement +
                                             ", and its numbers need decoding (" + info_.numbers +
                                             ", nodata: " + info_.nodata +
                                             "): straighten it first, with gdalwarp for example");
    }
    // Scales of 1: GDAL interpolates between the four nearest samples, whatever the ratio of the windows' sizes.
    std::vector<std::string> words = {
        "-of",        "VRT",
        "-ot",        has_float_numbers() ? "Float32" : "Float64",
        "-r",         numbers_ == RasterNumbers::plain ? "near" : "bilinear",
        "-wo",        "XSCALE=1",
        "-wo",        "YSCALE=1",
        "-dstnodata", "nan"};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    GDALWarpAppOptions* options = GDALWarpAppOptionsNew(arguments.data(), nullptr);
    GDALDatasetH source = GDALDataset::ToHandle(file_.get());
    int usage_error = 0;
    warped_.reset(
        GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &source, options, &usage_error)));
    GDALWarpAppOptionsFree(options);
    if (warped_) return {};
    return fail(ErrorCode::io,
                "cannot straighten rotated " + named_raster(path_) + ": " + quiet.message());
}

bool RasterReader::is_resampled() const {
    return is_rotated_ ||
           (numbers_ == RasterNumbers::heights && reading_.projection == DemProjection::local);
}

Result<void> RasterReader::straighten() {
    const QuietGdal quiet;
    GDALDataset* dataset = file_.get();
    band_ = dataset->GetRasterBand(1);
    transform_ = geotransform_of(*dataset);
    info_.placement = "a geotransform";
    if (transform_) {
        TERRANE_TRY(check_geotransform(path_, *transform_));
        clear_rounding(*transform_);
    }
    is_transposed_ = transform_ && (*transform_)[1] == 0.0 && (*transform_)[5] == 0.0;
    const bool is_rotated =
        transform_ && !is_transposed_ && ((*transform_)[2] != 0.0 || (*transform_)[4] != 0.0);
    const int point_count = transform_ ? 0 : dataset->GetGCPCount();
    is_rotated_ = (is_rotated || point_count > 0) && numbers_ == RasterNumbers::heights;
    if (is_transposed_) info_.placement += ", turned by 90 degrees";
    if (is_rotated) info_.placement += ", rotated";
    if (point_count > 0) info_.placement = std::to_string(point_count) + " ground control points";
    if (point_count > 0 && is_rotated_) {
        points_ = ControlPoints::create(*dataset);
        if (!points_) {
            return fail(ErrorCode::bad_data, named_raster(path_) + " has " + info_.placement +
                                                 " that do not place it: " + quiet.message());
        }
    }
    if ((is_rotated || point_count > 0) && !is_rotated_) {
        if (point_count > 0) info_.placement += ", resampled";
        TERRANE_TRY(warp());
        dataset = warped_.get();
        transform_ = geotransform_of(*dataset);
    }
    TERRANE_TRY(check_placement());
    info_.columns = dataset->GetRasterXSize();
    info_.rows = dataset->GetRasterYSize();
    if (is_transposed_) {
        std::swap(info_.columns, info_.rows);
        std::swap((*transform_)[1], (*transform_)[2]);
        std::swap((*transform_)[4], (*transform_)[5]);
    }
    if (numbers_ == RasterNumbers::heights && (info_.columns < 2 || info_.rows < 2)) {
        return fail(ErrorCode::bad_data,
                    named_raster(path_) + " has " + std::to_string(info_.columns) + " x " +
                        std::to_string(info_.rows) + " samples, at least 2 x 2 are needed");
    }
    band_ = dataset->GetRasterBand(1);
    mask_ = (band_->GetMaskFlags() & GMF_ALL_VALID) != 0 ? nullptr : band_->GetMaskBand();
    return {};
}

/// Scales the CRS to the metres of the world.
Result<void> RasterReader::choose_plane(const OGRSpatialReference& crs, const CrsRect& rect) {
    const auto plane = crs_scale_of(crs, rect);
    if (!plane) {
        return fail(plane.error().code, named_raster(path_) + " " + plane.error().message);
    }
    if (plane->is_scaled) {
        info_.notes.push_back(named_raster(path_) + " has the CRS \"" + info_.crs +
                              "\", whose metres are not true lengths here: in the world a metre "
                              "of it is " +
                              number_text(plane->metres_x) + " m east and " +
                              number_text(plane->metres_y) + " m north");
    }
    info_.geographic = plane->is_geographic;
    info_.metres_per_unit_x = plane->metres_x;
    info_.metres_per_unit_y = plane->metres_y;
    info_.scale_error = plane->scale_error;
    return {};
}

Result<void> RasterReader::find_place() {
    GDALDataset& dataset = warped_ ? *warped_ : *file_;
    const double columns = info_.columns, rows = info_.rows;
    const double side = reading_.cell > 0.0 ? reading_.cell : 1.0;
    const std::array<double, 6> transform =
        transform_.value_or(std::array<double, 6>{0.0, side, 0.0, rows * side, 0.0, -side});
    info_.centre_x = transform[0] + 0.5 * (columns * transform[1] + rows * transform[2]);
    info_.centre_y = transform[3] + 0.5 * (columns * transform[4] + rows * transform[5]);
    columns_go_west_ = !is_rotated_ && transform[1] < 0.0;
    rows_go_north_ = is_rotated_ || transform[5] > 0.0;
    // Of columns and rows in the order of read(), which are those of the file or the opposite.
    const double by_column = columns_go_west_ ? -1.0 : 1.0, by_row = rows_go_north_ ? 1.0 : -1.0;
    std::array<double, 6>& t = crs_from_sample_;
    t = {0.0, by_column * transform[1], by_row * transform[2],
         0.0, by_column * transform[4], by_row * transform[5]};
    t[0] = info_.centre_x - 0.5 * ((columns - 1.0) * t[1] + (rows - 1.0) * t[2]);
    t[3] = info_.centre_y - 0.5 * ((columns - 1.0) * t[4] + (rows - 1.0) * t[5]);
    rect_ = {info_.centre_x, info_.centre_y,
             0.5 * (columns * std::fabs(transform[1]) + rows * std::fabs(transform[2])),
             0.5 * (columns * std::fabs(transform[4]) + rows * std::fabs(transform[5]))};
    double step = std::max(std::fabs(transform[1]), std::fabs(transform[2]));
    if (points_) {
        rect_ = points_->extent(info_.columns, info_.rows);
        info_.centre_x = rect_.centre_x;
        info_.centre_y = rect_.centre_y;
        step = 2.0 * std::max(rect_.half_width / columns, rect_.half_height / rows);
    }
    const OGRSpatialReference* crs = transform_ ? dataset.GetSpatialRef()
                                     : points_  ? dataset.GetGCPSpatialRef()
                                                : nullptr;
    if (crs != nullptr) {
        if (crs->GetName() != nullptr) info_.crs = crs->GetName();
        char* wkt = nullptr;
        if (crs->exportToWkt(&wkt) == OGRERR_NONE) info_.crs_wkt = wkt;
        CPLFree(wkt);
        if (reading_.projection == DemProjection::own) TERRANE_TRY(choose_plane(*crs, rect_));
        const double degrees = crs->GetAngularUnits() * 180.0 / std::numbers::pi;
        if (crs->IsGeographic() != 0) {
            TERRANE_TRY(check_longitudes(path_, (rect_.centre_x - rect_.half_width) * degrees,
                                         (rect_.centre_x + rect_.half_width) * degrees,
                                         step * degrees));
        }
    }
    if (is_resampled()) return {};  // PlaneMap chooses the cells
    info_.cell_x = std::fabs(transform[1]) * info_.metres_per_unit_x;
    info_.cell_y = std::fabs(transform[5]) * info_.metres_per_unit_y;
    TERRANE_TRY(check_cells(path_, info_));
    // Treats cells as square if their sides differ only by rounding.
    if (std::fabs(info_.cell_x - info_.cell_y) <= 1e-9 * info_.cell_x) {
        info_.cell_y = info_.cell_x;
    }
    return {};
}

bool RasterReader::has_float_numbers() const {
    if (meaning_.is_encoded()) return true;  // 24 bits
    const GDALDataType type = band_->GetRasterDataType();
    constexpr int kWholeNumberBits = 24;  // a float's significand
    return type == GDT_Float32 ||
           (GDALDataTypeIsInteger(type) != 0 && GDALGetDataTypeSizeBits(type) <= kWholeNumberBits);
}

Result<void> RasterReader::check_extremes(const ExtremeHeights& extremes) const {
    if (reading_.nodata) return {};
    const auto suspects = extremes.undeclared_nodata(meaning_.nodata_scale, meaning_.nodata_offset);
    if (suspects.empty()) return {};
    std::string numbers;
    for (const ExtremeHeights::Height& suspect : suspects) {
        const double number =
            number_of(suspect.height, meaning_.nodata_scale, meaning_.nodata_offset);
        if (!numbers.empty()) numbers += ',';
        numbers += exact_text(number);
    }
    const ExtremeHeights::Height& first = suspects.front();
    const auto width = static_cast<std::size_t>(info_.columns);
    const auto column = static_cast<int>(first.index % width);
    const auto row = static_cast<int>(first.index / width);
    return fail(ErrorCode::bad_data,
                named_raster(path_) + " has a height of " + number_text(first.height) + " m in " +
                    place_in_file(column, row) +
                    ", far from all others; is it a nodata value that the file does not declare? "
                    "Give --nodata " +
                    numbers + " if it is, otherwise --nodata none (DemSettings::nodata)");
}

std::string RasterReader::place_in_file(int column, int row) const {
    int file_column = columns_go_west_ ? info_.columns - 1 - column : column;
    int file_row = rows_go_north_ ? row : info_.rows - 1 - row;
    if (is_transposed_) std::swap(file_column, file_row);
    return "column " + std::to_string(file_column) + ", row " + std::to_string(file_row) +
           " of the file (both from 0)";
}

Error RasterReader::too_high(double height, int column, int row) const {
    std::array<char, 240> text{};
    std::snprintf(text.data(), text.size(),
                  " has a height of %.6g m in %s, possible are "
                  "%.3g to %.3g m; is it a nodata value that the file does not declare (--nodata)?",
                  height, place_in_file(column, row).c_str(), -kMostHeight, kMostHeight);
    return {ErrorCode::bad_data, named_raster(path_) + text.data()};
}

bool RasterReader::read_numbers(int file_x, int file_y, int columns, int rows,
                                std::span<double> numbers_out,
                                std::span<std::uint8_t> valid_out) const {
    const auto read = [&](GDALRasterBand& band, GDALDataType type, void* out) {
        const GSpacing bytes = GDALGetDataTypeSizeBytes(type);
        const CPLErr status = is_transposed_
                                  ? band.RasterIO(GF_Read, file_y, file_x, rows, columns, out, rows,
                                                  columns, type, bytes * columns, bytes, nullptr)
                                  : band.RasterIO(GF_Read, file_x, file_y, columns, rows, out,
                                                  columns, rows, type, 0, 0, nullptr);
        return status == CE_None;
    };
    if (meaning_.is_encoded()) {
        std::vector<std::uint8_t> bytes(numbers_out.size());
        std::ranges::fill(numbers_out, 0.0);
        for (const int number : meaning_.bands) {
            if (!read(*file_->GetRasterBand(number), GDT_Byte, bytes.data())) return false;
            for (std::size_t i = 0; i < bytes.size(); ++i) {
                numbers_out[i] = numbers_out[i] * 256.0 + bytes[i];
            }
        }
    } else if (!read(*band_, GDT_Float64, numbers_out.data())) {
        return false;
    }
    if (meaning_.is_signed_byte) {
        for (double& number : numbers_out) number -= number > 127.0 ? 256.0 : 0.0;
    }
    return valid_out.empty() || read(*mask_, GDT_Byte, valid_out.data());
}

Result<void> RasterReader::read(int column, int row, int columns, int rows,
                                std::span<double> heights_out) const {
    const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    std::vector<double> values(count);
    std::vector<std::uint8_t> valid(mask_ != nullptr ? count : 0);
    const int file_x = columns_go_west_ ? info_.columns - column - columns : column;
    const int file_y = rows_go_north_ ? row : info_.rows - row - rows;
    {
        const std::lock_guard lock(mutex_);
        const QuietGdal quiet;
        if (!read_numbers(file_x, file_y, columns, rows, values, valid)) {
            return fail(ErrorCode::io,
                        "cannot read " + named_raster(path_) + ": " + quiet.message());
        }
    }
    for (const double nodata : meaning_.nodata) {
        std::ranges::replace(values, nodata, std::numeric_limits<double>::quiet_NaN());
    }
    const double scale = meaning_.scale, offset = meaning_.offset;
    for (int r = 0; r < rows; ++r) {
        const int from_r = rows_go_north_ ? r : rows - 1 - r;
        for (int c = 0; c < columns; ++c) {
            const int from_c = columns_go_west_ ? columns - 1 - c : c;
            const std::size_t from =
                static_cast<std::size_t>(from_r) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(from_c);
            const std::size_t to = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                                   static_cast<std::size_t>(c);
            const double number = values[from] * scale + offset;
            const bool is_valid =
                (valid.empty() || valid[from] != 0) && std::isfinite(values[from]);
            if (is_valid && numbers_ == RasterNumbers::heights &&
                !(std::fabs(number) <= kMostHeight)) {
                return tl::unexpected(too_high(number, column + c, row + r));
            }
            heights_out[to] = is_valid ? number : std::numeric_limits<double>::quiet_NaN();
        }
    }
    return {};
}

}  // namespace terrane::internal
