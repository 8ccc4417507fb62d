// SPDX-License-Identifier: MIT
#include "raster/raster_checks.h"

#include <terrane/base/text.h>

#include <gdal_priv.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace terrane::internal {

std::string named_raster(const std::string& path) {
    std::string name = "raster \"";
    name += path;
    name += '"';
    return name;
}

namespace {

tl::unexpected<Error> refuse(const std::string& raster, const std::string& why,
                             ErrorCode code = ErrorCode::bad_data) {
    return fail(code, named_raster(raster) + " " + why);
}

std::string text(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

}  // namespace

Result<void> check_is_file(const std::string& raster) {
    struct stat status {};
    // A path that the file system does not know may be one of GDAL's: /vsizip/..., a connection.
    if (stat(raster.c_str(), &status) != 0) return {};
    const char* what = nullptr;
    if (S_ISFIFO(status.st_mode)) what = "a pipe";
    if (S_ISSOCK(status.st_mode)) what = "a socket";
    if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode)) what = "a device";
    if (what == nullptr) return {};
    return fail(ErrorCode::io, "cannot open raster \"" + raster + "\": it is " + what +
                                   ", a file or folder is needed");
}

Result<void> check_band(const std::string& raster, GDALRasterBand& band) {
    const GDALDataType type = band.GetRasterDataType();
    if (GDALDataTypeIsComplex(type) != 0) {
        return refuse(raster, std::string("has complex numbers (") + GDALGetDataTypeName(type) +
                                  ") in its first band, real numbers are needed");
    }
    const double scale = band.GetScale(), offset = band.GetOffset();
    if (!std::isfinite(scale) || scale == 0.0 || !std::isfinite(offset)) {
        return refuse(raster, "has a scale of " + text(scale) + " and an offset of " +
                                  text(offset) + ", which make no numbers");
    }
    return {};
}

Result<void> check_geotransform(const std::string& raster, const std::array<double, 6>& transform) {
    const double area = transform[1] * transform[5] - transform[2] * transform[4];
    const bool is_finite =
        std::ranges::all_of(transform, [](double c) { return std::isfinite(c); });
    if (is_finite && std::isfinite(area) && area != 0.0) return {};
    std::string listed;
    for (const double coefficient : transform) {
        listed += (listed.empty() ? "" : ", ") + text(coefficient);
    }
    return refuse(raster, (is_finite ? "has cells without area, geotransform "
                                     : "has a geotransform that is not finite: ") +
                              listed);
}

Result<void> check_cells(const std::string& raster, const DemInfo& info) {
    constexpr double kLeastCell = 1e-6, kLargestCell = 1e7;
    const std::string cells =
        "has cells of " + text(info.cell_x) + " x " + text(info.cell_y) + " m, ";
    for (const double cell : {info.cell_x, info.cell_y}) {
        if (!(cell >= kLeastCell && cell <= kLargestCell)) {
            return refuse(raster, cells + "1e-6 to 1e7 m are possible");
        }
    }
    const double ratio = std::max(info.cell_x, info.cell_y) / std::min(info.cell_x, info.cell_y);
    if (ratio > kMostCellRatio) {
        return refuse(raster, cells + "one side at most " + text(kMostCellRatio) +
                                  " times the other is possible: resample it to square cells");
    }
    return {};
}

Result<void> check_longitudes(const std::string& raster, double west, double east, double cell) {
    constexpr double kTurn = 360.0;
    // Longitudes beyond two turns are metres labelled as degrees.
    const bool is_longitude = std::max(std::fabs(west), std::fabs(east)) <= 2.0 * kTurn;
    if (is_longitude && east - west <= kTurn + 2.0 * cell) return {};
    return refuse(raster, "is geographic and reaches from longitude " + text(west) + " to " +
                              text(east) +
                              " degrees, at most a turn within -720 to 720 is possible");
}

Result<void> check_memory(const std::string& raster, int columns, int rows, double needed_bytes,
                          std::size_t limit_bytes, const char* setting) {
    if (needed_bytes <= static_cast<double>(limit_bytes)) return {};
    constexpr double kMebibyte = 1024.0 * 1024.0;
    char numbers[160];
    std::snprintf(numbers, sizeof numbers,
                  "of %d x %d samples needs %.6g MiB of memory, the limit is %.6g MiB", columns,
                  rows, needed_bytes / kMebibyte, static_cast<double>(limit_bytes) / kMebibyte);
    return fail(ErrorCode::out_of_memory,
                named_raster(raster) + " " + numbers + " (" + setting + ")");
}

}  // namespace terrane::internal
