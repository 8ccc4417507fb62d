// SPDX-License-Identifier: MIT
//
// Judges a trace of `terrane drop` without code of the library. Exit code 0: no pose is deeper than the tolerance; 1: a
// pose is; 2: the trace cannot be judged.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>

#ifdef TRACE_JUDGE_GDAL
#include <gdal_priv.h>
#endif

#include "judge.h"

namespace {

constexpr const char* kUsage =
    "trace_judge --trace FILE --shape sphere|capsule|box|hull|compound|mixed (--heights FILE | "
    "--dem FILE)\n"
    "            [--parity 0|1] [--tolerance M] [--slack M] [--allow-unjudged]\n"
    "\n"
    "--heights: a text file; first line `spacing west south parity`, then `column row height` a "
    "line,\n"
    "           as judge_drop.py writes it.\n"
    "--dem:     a projected raster with square cells; --parity gives the diagonal of cell (0, 0) "
    "at "
    "its\n"
    "           south-western sample (0: south-west to north-east).\n";

int refuse(const std::string& message) {
    std::fprintf(stderr, "trace_judge: %s\n", message.c_str());
    return 2;
}

bool read_heights(const std::string& path, judge::Surface& surface, std::string& error) {
    std::ifstream file(path);
    if (!(file >> surface.spacing >> surface.west >> surface.south >> surface.parity) ||
        !(surface.spacing > 0.0)) {
        error = "cannot read heights from " + path;
        return false;
    }
    std::int64_t column = 0, row = 0;
    double height = 0.0;
    while (file >> column >> row >> height) surface.set_point(column, row, height);
    if (!file.eof()) error = "heights end early in " + path;
    return file.eof();
}

#ifdef TRACE_JUDGE_GDAL
bool read_dem(const std::string& path, judge::Surface& surface, std::string& error) {
    GDALAllRegister();
    const std::unique_ptr<GDALDataset> raster(
        GDALDataset::FromHandle(GDALOpen(path.c_str(), GA_ReadOnly)));
    if (!raster) {
        error = "cannot open " + path;
        return false;
    }
    double transform[6] = {};
    if (raster->GetGeoTransform(transform) != CE_None || transform[2] != 0.0 ||
        transform[4] != 0.0 || transform[1] != -transform[5]) {
        error = path + " has no square cells in rows from the north";
        return false;
    }
    const int columns = raster->GetRasterXSize(), rows = raster->GetRasterYSize();
    std::vector<double> north_first(static_cast<std::size_t>(columns) *
                                    static_cast<std::size_t>(rows));
    GDALRasterBand* band = raster->GetRasterBand(1);
    if (band->RasterIO(GF_Read, 0, 0, columns, rows, north_first.data(), columns, rows, GDT_Float64,
                       0, 0) != CE_None) {
        error = "cannot read " + path;
        return false;
    }
    int has_nodata = 0;
    const double nodata = band->GetNoDataValue(&has_nodata);
    int has_scale = 0, has_offset = 0;
    const double scale = band->GetScale(&has_scale), offset = band->GetOffset(&has_offset);
    std::vector<double> heights(north_first.size());
    const auto width = static_cast<std::size_t>(columns);
    for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
        for (std::size_t column = 0; column < width; ++column) {
            double z = north_first[(static_cast<std::size_t>(rows) - 1 - row) * width + column];
            if (has_nodata && z == nodata) z = std::nan("");
            if (has_scale) z *= scale;
            if (has_offset) z += offset;
            heights[row * width + column] = z;
        }
    }
    surface.spacing = transform[1];
    surface.west = (0.5 - 0.5 * columns) * surface.spacing;
    surface.south = (0.5 - 0.5 * rows) * surface.spacing;
    surface.set_grid(columns, rows, std::move(heights));
    return true;
}
#else
bool read_dem(const std::string& path, judge::Surface&, std::string& error) {
    error = "built without GDAL, cannot read " + path;
    return false;
}
#endif

bool parse_shape(const std::string& name, judge::DropShape& shape_out) {
    const struct {
        const char* name;
        judge::DropShape shape;
    } shapes[] = {{"sphere", judge::DropShape::sphere},     {"capsule", judge::DropShape::capsule},
                  {"box", judge::DropShape::box},           {"hull", judge::DropShape::hull},
                  {"compound", judge::DropShape::compound}, {"mixed", judge::DropShape::mixed}};
    for (const auto& entry : shapes) {
        if (name != entry.name) continue;
        shape_out = entry.shape;
        return true;
    }
    return false;
}

}  // namespace

int main(int argc, char** argv) {
    std::string trace_path, heights_path, dem_path, parity;
    judge::Settings settings;
    bool has_shape = false, allow_unjudged = false;
    for (int i = 1; i < argc; ++i) {
        const std::string key = argv[i];
        if (key == "--help") {
            std::fputs(kUsage, stdout);
            return 0;
        }
        if (key == "--allow-unjudged") {
            allow_unjudged = true;
            continue;
        }
        if (i + 1 == argc) return refuse(key + " is unknown or needs a value");
        const std::string value = argv[++i];
        if (key == "--trace") {
            trace_path = value;
        } else if (key == "--heights") {
            heights_path = value;
        } else if (key == "--dem") {
            dem_path = value;
        } else if (key == "--parity") {
            parity = value;
        } else if (key == "--tolerance") {
            settings.tolerance = std::atof(value.c_str());
        } else if (key == "--slack") {
            settings.slack = std::atof(value.c_str());
        } else if (key == "--shape") {
            has_shape = parse_shape(value, settings.shape);
            if (!has_shape) return refuse("--shape is unknown: " + value);
        } else {
            return refuse(key + " is unknown");
        }
    }
    if (trace_path.empty() || !has_shape || heights_path.empty() == dem_path.empty()) {
        std::fputs(kUsage, stderr);
        return 2;
    }
    judge::Surface surface;
    std::string error;
    const bool is_read = dem_path.empty() ? read_heights(heights_path, surface, error)
                                          : read_dem(dem_path, surface, error);
    if (!is_read) return refuse(error);
    if (!parity.empty()) surface.parity = parity == "1" ? 1 : 0;
    std::ifstream trace(trace_path);
    if (!trace) return refuse("cannot open " + trace_path);
    const judge::Report report = judge::judge_trace(trace, surface, settings);
    if (!report.error.empty()) return refuse(report.error);
    std::printf(
        "{\"bodies\":%llu,\"poses\":%llu,\"touching\":%llu,\"too_deep\":%llu,\"unjudged\":%llu,"
        "\"max_lift_m\":%.9g,\"max_depth_m\":%.9g}\n",
        static_cast<unsigned long long>(report.bodies),
        static_cast<unsigned long long>(report.poses),
        static_cast<unsigned long long>(report.touching),
        static_cast<unsigned long long>(report.too_deep),
        static_cast<unsigned long long>(report.unjudged), report.max_lift, report.max_depth);
    if (report.too_deep > 0) {
        std::fprintf(stderr, "trace_judge: first too deep: %s\n", report.first_too_deep.c_str());
        return 1;
    }
    if (report.unjudged > 0 && !allow_unjudged) {
        return refuse(std::to_string(report.unjudged) + " poses have no known ground under them");
    }
    return 0;
}
