// SPDX-License-Identifier: MIT
#include "raster/raster_reader.h"

#include "raster/cancellable_work.h"
#include "raster/raster_checks.h"

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
#include <vector>

namespace terrane::internal {
namespace {

std::string in_quotes(const std::string& path) { return "\"" + path + "\""; }

/// Metres per vertical unit; 0 for an unknown name.
double metres_of_unit(std::string name) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    struct Unit {
        const char* name;
        double metres;
    };
    constexpr double kFoot = 0.3048;
    constexpr double kSurveyFoot = 1200.0 / 3937.0;
    static constexpr std::array<Unit, 21> kUnits{{
        {"m", 1.0},
        {"metre", 1.0},
        {"metres", 1.0},
        {"meter", 1.0},
        {"meters", 1.0},
        {"dm", 0.1},
        {"cm", 0.01},
        {"centimetre", 0.01},
        {"centimeter", 0.01},
        {"mm", 0.001},
        {"km", 1000.0},
        {"ft", kFoot},
        {"foot", kFoot},
        {"feet", kFoot},
        {"international foot", kFoot},
        {"us-ft", kSurveyFoot},
        {"ftus", kSurveyFoot},
        {"us_ft", kSurveyFoot},
        {"us survey foot", kSurveyFoot},
        {"us survey feet", kSurveyFoot},
        {"foot_us", kSurveyFoot},
    }};
    for (const Unit& unit : kUnits) {
        if (name == unit.name) return unit.metres;
    }
    return 0.0;
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

RasterReader::~RasterReader() { warped_.reset(); }

Result<std::unique_ptr<RasterReader>> RasterReader::open(const std::string& path,
                                                         RasterNumbers numbers) {
    TERRANE_TRY(check_is_file(path));
    register_drivers();
    const QuietGdal quiet;
    std::unique_ptr<RasterReader> reader(new RasterReader);
    reader->path_ = path;
    reader->numbers_ = numbers;
    reader->file_.reset(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR));
    if (!reader->file_) {
        return fail(ErrorCode::io,
                    "cannot open raster " + in_quotes(path) + ": " + quiet.message());
    }
    if (reader->file_->GetRasterCount() < 1) {
        return fail(ErrorCode::bad_data, "raster " + in_quotes(path) + " has 0 bands");
    }
    GDALRasterBand& band = *reader->file_->GetRasterBand(1);
    TERRANE_TRY(check_band(path, band));
    reader->find_scale(band);
    TERRANE_TRY(reader->straighten());
    TERRANE_TRY(reader->find_place());
    return reader;
}

Result<std::unique_ptr<RasterReader>> RasterReader::open(const std::string& path, double patience_s,
                                                         RasterNumbers numbers) {
    GuardedCalls calls(patience_s);
    using Opened = Result<std::unique_ptr<RasterReader>>;
    const auto opened = std::make_shared<Opened>();
    const bool answered = calls.run([opened, path, numbers] { *opened = open(path, numbers); });
    if (!answered) return stopped_answering(path, patience_s);
    return std::move(*opened);
}

tl::unexpected<Error> stopped_answering(const std::string& path, double patience_s) {
    char seconds[40];
    std::snprintf(seconds, sizeof seconds, "%.3g", patience_s);
    return fail(ErrorCode::timed_out, "raster " + in_quotes(path) +
                                          " stopped answering: GDAL has read nothing for " +
                                          seconds + " s");
}

void RasterReader::find_scale(GDALRasterBand& band) {
    scale_ = band.GetScale();
    offset_ = band.GetOffset();
    if (numbers_ == RasterNumbers::plain) return;
    double metres = metres_of_unit(band.GetUnitType());
    if (metres == 0.0) {
        metres = 1.0;
        const OGRSpatialReference* crs = file_->GetSpatialRef();
        if (crs != nullptr && crs->IsCompound()) {
            metres = crs->GetTargetLinearUnits("COMPD_CS|VERT_CS");
        }
    }
    scale_ *= metres;
    offset_ *= metres;
}

Result<void> RasterReader::straighten() {
    GDALDataset* dataset = file_.get();
    const QuietGdal quiet;
    std::array<double, 6> transform{};
    const bool placed = dataset->GetGeoTransform(transform.data()) == CE_None;
    if (placed) {
        TERRANE_TRY(check_geotransform(path_, transform));
    }
    const bool rotated = placed && (transform[2] != 0.0 || transform[4] != 0.0);
    band_ = dataset->GetRasterBand(1);
    if (rotated || (!placed && dataset->GetGCPCount() > 0)) {
        std::vector<std::string> words = {
            "-of",        "VRT",
            "-ot",        has_float_numbers() ? "Float32" : "Float64",
            "-r",         numbers_ == RasterNumbers::plain ? "near" : "bilinear",
            "-dstnodata", "nan"};
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        GDALWarpAppOptions* options = GDALWarpAppOptionsNew(arguments.data(), nullptr);
        GDALDatasetH source = GDALDataset::ToHandle(dataset);
        int usage_error = 0;
        warped_.reset(
            GDALDataset::FromHandle(GDALWarp("", nullptr, 1, &source, options, &usage_error)));
        GDALWarpAppOptionsFree(options);
        if (!warped_) {
            return fail(ErrorCode::io, "cannot straighten rotated raster " + in_quotes(path_) +
                                           ": " + quiet.message());
        }
        dataset = warped_.get();
    }
    info_.columns = dataset->GetRasterXSize();
    info_.rows = dataset->GetRasterYSize();
    if (numbers_ == RasterNumbers::heights && (info_.columns < 2 || info_.rows < 2)) {
        return fail(ErrorCode::bad_data,
                    "raster " + in_quotes(path_) + " has " + std::to_string(info_.columns) + " x " +
                        std::to_string(info_.rows) + " samples, at least 2 x 2 are needed");
    }
    band_ = dataset->GetRasterBand(1);
    mask_ = (band_->GetMaskFlags() & GMF_ALL_VALID) != 0 ? nullptr : band_->GetMaskBand();
    return {};
}

Result<void> RasterReader::find_place() {
    GDALDataset& dataset = warped_ ? *warped_ : *file_;
    const double columns = info_.columns, rows = info_.rows;
    std::array<double, 6> transform{};
    if (dataset.GetGeoTransform(transform.data()) != CE_None) {
        transform = {0.0, 1.0, 0.0, rows, 0.0, -1.0};
    }
    info_.centre_x = transform[0] + 0.5 * columns * transform[1];
    info_.centre_y = transform[3] + 0.5 * rows * transform[5];
    columns_go_west_ = transform[1] < 0.0;
    rows_go_north_ = transform[5] > 0.0;
    if (const OGRSpatialReference* crs = dataset.GetSpatialRef(); crs != nullptr) {
        if (crs->GetName() != nullptr) info_.crs = crs->GetName();
        char* wkt = nullptr;
        if (crs->exportToWkt(&wkt) == OGRERR_NONE) info_.crs_wkt = wkt;
        CPLFree(wkt);
        info_.geographic = crs->IsGeographic() != 0;
        if (info_.geographic) {
            const double half_height = 0.5 * rows * std::fabs(transform[5]);
            const Ellipsoid ellipsoid{crs->GetSemiMajor(), crs->GetSemiMinor()};
            const auto scale =
                metres_per_degree(ellipsoid, crs->GetAngularUnits(), info_.centre_y, half_height);
            if (!scale) {
                return fail(scale.error().code,
                            "raster " + in_quotes(path_) + " " + scale.error().message);
            }
            const double degrees = crs->GetAngularUnits() * 180.0 / std::numbers::pi;
            const double cell = std::fabs(transform[1]) * degrees;
            const double centre = info_.centre_x * degrees;
            TERRANE_TRY(check_longitudes(path_, centre - 0.5 * columns * cell,
                                         centre + 0.5 * columns * cell, cell));
            info_.metres_per_unit_x = scale->east;
            info_.metres_per_unit_y = scale->north;
            info_.scale_error = scale->east_error;
        } else {
            info_.metres_per_unit_x = info_.metres_per_unit_y = crs->GetLinearUnits();
        }
    }
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
    const GDALDataType type = band_->GetRasterDataType();
    constexpr int kWholeNumberBits = 24;  // a float's significand
    return type == GDT_Float32 ||
           (GDALDataTypeIsInteger(type) != 0 && GDALGetDataTypeSizeBits(type) <= kWholeNumberBits);
}

std::string RasterReader::place_in_file(int column, int row) const {
    return "column " + std::to_string(columns_go_west_ ? info_.columns - 1 - column : column) +
           ", row " + std::to_string(rows_go_north_ ? row : info_.rows - 1 - row) +
           " of the file (both from 0)";
}

Error RasterReader::too_high(double height, int column, int row) const {
    std::array<char, 240> text{};
    std::snprintf(text.data(), text.size(),
                  " has a height of %.6g m in %s, possible are "
                  "%.3g to %.3g m; is it a nodata value that the file does not declare?",
                  height, place_in_file(column, row).c_str(), -kMostHeight, kMostHeight);
    return {ErrorCode::bad_data, "raster " + in_quotes(path_) + text.data()};
}

Result<void> RasterReader::read(int column, int row, int columns, int rows,
                                std::span<double> heights_out) const {
    const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    std::vector<double> values(count);
    std::vector<std::uint8_t> valid(mask_ != nullptr ? count : 0);
    const int file_column = columns_go_west_ ? info_.columns - column - columns : column;
    const int file_row = rows_go_north_ ? row : info_.rows - row - rows;
    {
        const std::lock_guard lock(mutex_);
        const QuietGdal quiet;
        CPLErr status = band_->RasterIO(GF_Read, file_column, file_row, columns, rows,
                                        values.data(), columns, rows, GDT_Float64, 0, 0, nullptr);
        if (status == CE_None && mask_ != nullptr) {
            status = mask_->RasterIO(GF_Read, file_column, file_row, columns, rows, valid.data(),
                                     columns, rows, GDT_Byte, 0, 0, nullptr);
        }
        if (status != CE_None) {
            return fail(ErrorCode::io,
                        "cannot read raster " + in_quotes(path_) + ": " + quiet.message());
        }
    }
    for (int r = 0; r < rows; ++r) {
        const int from_r = rows_go_north_ ? r : rows - 1 - r;
        for (int c = 0; c < columns; ++c) {
            const int from_c = columns_go_west_ ? columns - 1 - c : c;
            const std::size_t from =
                static_cast<std::size_t>(from_r) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(from_c);
            const std::size_t to = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                                   static_cast<std::size_t>(c);
            const double number = values[from] * scale_ + offset_;
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
