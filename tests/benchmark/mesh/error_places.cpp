// SPDX-License-Identifier: MIT
#include "error_places.h"

#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <utility>

#if TERRANE_BENCH_DEM
#include <terrane/dem/dem_heights.h>
#endif

namespace terrane::bench {
namespace {

Place make_map(int side) {
    const auto table = std::make_shared<const test::TableHeights>(test::make_fbm_table(side));
    return {"fBm " + std::to_string(side), table, table, false, 100.0};
}

Place make_fractal(const char* name, FractalKind kind, std::uint64_t seed) {
    const auto source = FractalHeights::create(
        {.seed = seed, .kind = kind, .finest_spacing_log2 = -3, .root_size_log2 = 16});
    return {name, source.value(), nullptr, true, 300.0};
}

#if TERRANE_BENCH_DEM
std::shared_ptr<const HeightSource> open(const std::string& name, const DemSettings& settings) {
    const char* folder = std::getenv("TERRANE_DATA");
    const std::string path =
        (folder != nullptr ? std::string(folder)
                           : std::string(TERRANE_SOURCE_DIR) + "/../shared/data") +
        "/dem/" + name;
    if (!std::filesystem::exists(path)) {
        std::printf("# %s is absent: left out\n", path.c_str());
        return nullptr;
    }
    auto source = DemHeights::open(path, settings);
    if (!source) {
        std::printf("# %s: left out\n", source.error().message.c_str());
        return nullptr;
    }
    return *source;
}

/// The largest square of 2^n + 1 samples in the middle of a raster.
std::shared_ptr<const test::TableHeights> crop(const HeightSource& source, int most_side) {
    const Lattice& lattice = source.lattice();
    const WorldRect& extent = source.extent();
    const double width = std::min(extent.east - extent.west, extent.north - extent.south);
    int cells = kChunkCells;
    while (2 * cells + 1 <= most_side && 2 * cells * lattice.spacing <= width) cells *= 2;
    const auto first = [&](double middle, double origin) {
        return static_cast<std::int64_t>(std::floor((middle - origin) / lattice.spacing)) -
               cells / 2;
    };
    const LatticePoint corner{first(0.5 * (extent.west + extent.east), lattice.origin_x),
                              first(0.5 * (extent.south + extent.north), lattice.origin_y)};
    auto table = test::read_table(source, corner, cells + 1);
    return table ? std::make_shared<const test::TableHeights>(std::move(*table)) : nullptr;
}
#endif

}  // namespace

Places make_places(bool quick) {
    Places made;
    std::vector<Place>&places = made.grounds, &tables = made.tables;
    if (quick) {
        places = {make_map(513)};
    } else {
        places = {make_map(1025), make_map(2049)};
    }
    tables = places;
#if TERRANE_BENCH_DEM
    struct Raster {
        const char* name;
        double altitude;
    };
    std::vector<Raster> rasters{{"usgs3dep_maroon_38m.tif", 500.0}};
    if (!quick) {
        rasters.insert(rasters.end(), {{"gabilan_lidar_1m.tif", 50.0},
                                       {"sthelens_10m.vrt", 500.0},
                                       {"srtm1_bigtujunga_30m.tif", 500.0},
                                       {"N44W072.hgt", 500.0},
                                       {"srtm3_rainier_1201_voids.tif", 500.0},
                                       {"tyrol_avaWog_5m_nodata.tif", 200.0}});
    }
    for (const Raster& raster : rasters) {
        const auto source = open(raster.name, {});
        if (!source) continue;
        const std::string name = std::string(raster.name).substr(0, 18);
        places.push_back({name, source, nullptr, false, raster.altitude});
        const bool has_holes =
            std::strstr(raster.name, "voids") || std::strstr(raster.name, "nodata");
        if (has_holes) continue;
        if (auto table = crop(*source, 1025)) {
            tables.push_back({name + " crop", table, table, false, raster.altitude});
        }
    }
    if (!quick) {
        if (const auto source =
                open("sthelens_10m.vrt", {.finest_spacing = 0.625, .detail_seed = 3})) {
            places.push_back({"sthelens + detail", source, nullptr, true, 200.0});
        }
    }
#endif
    places.push_back(make_fractal("fractal fbm", FractalKind::fbm, 1));
    if (!quick) places.push_back(make_fractal("fractal fbm seed 2", FractalKind::fbm, 2));
    places.push_back(make_fractal("fractal ridged", FractalKind::ridged, 1));
    places.push_back(make_fractal("fractal hybrid", FractalKind::hybrid, 1));
    places.push_back(make_fractal("fractal warped", FractalKind::warped, 1));
    return made;
}

std::vector<View> views_of(const Place& place) {
    const WorldRect& extent = place.source->extent();
    const double width = std::min(extent.east - extent.west, extent.north - extent.south);
    // fractals go on for ever: look at their middle
    const double reach = place.is_fractal ? 5000.0 : 0.3 * width;
    const double middle_x = 0.5 * (extent.west + extent.east);
    const double middle_y = 0.5 * (extent.south + extent.north);
    std::vector<View> views;
    for (int i = 0; i < 3; ++i) {
        const double angle = 0.4 + 2.0 * i;
        const double x = middle_x - reach * std::cos(angle), y = middle_y - reach * std::sin(angle);
        const WorldPos eye(x, y, place.source->height(x, y) + place.altitude);
        const WorldPos target(middle_x, middle_y, eye.z() - 0.2 * reach);
        views.push_back(look_at(eye, target, std::numbers::pi / 3.0, 1920, 1080).value());
    }
    return views;
}

}  // namespace terrane::bench
