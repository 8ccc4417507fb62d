// SPDX-License-Identifier: MIT
#include "raster_files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

namespace terrane::test {
namespace {

void require(bool ok, const char* what, const std::string& path) {
    if (ok) return;
    std::fprintf(stderr, "cannot make test raster %s: %s\n", path.c_str(), what);
    std::abort();
}

}  // namespace

void write_raster(const std::string& path, const RasterSpec& spec) {
    GDALAllRegister();
    CPLSetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    require(driver != nullptr, "no GTiff driver", path);
    GDALDataset* file =
        driver->Create(path.c_str(), spec.columns, spec.rows, 1, spec.type, nullptr);
    require(file != nullptr, "Create", path);
    if (spec.has_place) {
        std::array<double, 6> transform = spec.transform;
        require(file->SetGeoTransform(transform.data()) == CE_None, "SetGeoTransform", path);
    }
    if (!spec.crs.empty()) {
        OGRSpatialReference crs;
        require(crs.SetFromUserInput(spec.crs.c_str()) == OGRERR_NONE, "CRS", path);
        require(file->SetSpatialRef(&crs) == CE_None, "SetSpatialRef", path);
    }
    GDALRasterBand* band = file->GetRasterBand(1);
    if (spec.nodata) band->SetNoDataValue(*spec.nodata);
    if (spec.scale != 1.0 || spec.offset != 0.0) {
        band->SetScale(spec.scale);
        band->SetOffset(spec.offset);
    }
    if (!spec.unit.empty()) band->SetUnitType(spec.unit.c_str());
    std::vector<double> values;
    for (int row = 0; row < spec.rows; ++row) {
        for (int column = 0; column < spec.columns; ++column) {
            values.push_back(spec.value(column, row));
        }
    }
    require(band->RasterIO(GF_Write, 0, 0, spec.columns, spec.rows, values.data(), spec.columns,
                           spec.rows, GDT_Float64, 0, 0, nullptr) == CE_None,
            "write", path);
    if (!spec.mask.empty()) {
        require(file->CreateMaskBand(GMF_PER_DATASET) == CE_None, "CreateMaskBand", path);
        std::vector<std::uint8_t> mask = spec.mask;
        require(band->GetMaskBand()->RasterIO(GF_Write, 0, 0, spec.columns, spec.rows, mask.data(),
                                              spec.columns, spec.rows, GDT_Byte, 0, 0,
                                              nullptr) == CE_None,
                "write mask", path);
    }
    GDALClose(GDALDataset::ToHandle(file));
}

std::string real_data(const std::string& name) {
    const char* folder = std::getenv("TERRANE_DATA");
    const std::string path =
        (folder != nullptr ? std::string(folder)
                           : std::string(TERRANE_SOURCE_DIR) + "/../shared/data") +
        "/dem/" + name;
    return std::filesystem::exists(path) ? path : std::string();
}

HungMosaic::HungMosaic(const TemporaryFolder& folder, const std::string& type)
    : path(folder.file("mosaic.vrt")), pipe_(folder.file("pipe.tif")) {
    EXPECT_EQ(mkfifo(pipe_.c_str(), 0600), 0);
    std::ofstream(path)
        << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><VRTRasterBand "
           "dataType=\""
        << type
        << "\" band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">"
           "pipe.tif</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>\n";
}

HungMosaic::~HungMosaic() {
    // releases the thread that waits for the pipe
    const int writer = open(pipe_.c_str(), O_RDWR | O_NONBLOCK);
    EXPECT_GE(writer, 0);
    close(writer);
}

OpenedDem open_dem(const std::string& path, const DemSettings& settings) {
    OpenedDem opened;
    const auto source = DemHeights::open(path, settings, &opened.info);
    EXPECT_TRUE(source.has_value()) << (source ? "" : source.error().message);
    opened.source = source.value();
    return opened;
}

OpenedDem open_dem(const RasterSpec& spec, const DemSettings& settings) {
    const TemporaryFolder folder;
    write_raster(folder.file("raster.tif"), spec);
    return open_dem(folder.file("raster.tif"), settings);
}

namespace {

struct Answers {
    std::vector<double> heights;
    std::vector<float> vertices, cells, mesh_vertices, mesh_cells;
    std::vector<std::uint8_t> flags;
    bool operator==(const Answers&) const = default;
};

Answers answers_of(const HeightSource& source, const SampleGrid& grid) {
    const auto cells = static_cast<std::size_t>((grid.columns - 1) * (grid.rows - 1));
    Answers answers{.heights = std::vector<double>(grid.size()),
                    .vertices = std::vector<float>(grid.size()),
                    .cells = std::vector<float>(cells),
                    .mesh_vertices = std::vector<float>(grid.size()),
                    .mesh_cells = std::vector<float>(cells),
                    .flags = std::vector<std::uint8_t>(cells)};
    EXPECT_TRUE(source.sample(grid, answers.heights));
    EXPECT_TRUE(source.vertex_bounds(grid, answers.vertices));
    EXPECT_TRUE(source.cell_bounds(grid, answers.cells));
    EXPECT_TRUE(source.mesh_bounds(grid, answers.mesh_vertices, answers.mesh_cells));
    EXPECT_TRUE(source.cell_flags(grid, answers.flags));
    return answers;
}

}  // namespace

void expect_same_answers(const HeightSource& a, const HeightSource& b) {
    const Lattice& lattice = a.lattice();
    ASSERT_EQ(lattice, b.lattice());
    std::mt19937 random(11);
    for (std::int64_t step = 1; step <= 4 * lattice.chunk_side(0); step *= 2) {
        const auto somewhere = [&](std::int64_t low, std::int64_t high) {
            const auto places = std::max<std::int64_t>((high - low) / (2 * step), 1);
            return (low / (2 * step) + static_cast<std::int64_t>(random()) % places) * 2 * step;
        };
        const std::int64_t x = somewhere(lattice.west(), lattice.east());
        const SampleGrid grid{{x, somewhere(lattice.south(), lattice.north())}, step, 33, 21};
        EXPECT_TRUE(answers_of(a, grid) == answers_of(b, grid)) << "step " << step;
    }
    const WorldRect& e = a.extent();
    for (int i = 0; i < 200; ++i) {
        const double x = e.west + random_unit(random) * (e.east - e.west);
        const double y = e.south + random_unit(random) * (e.north - e.south);
        EXPECT_EQ(a.height(x, y), b.height(x, y));
    }
    for (double side = 3.0; side < 5000.0; side *= 1.7) {
        const HeightInterval of_a = a.interval({-side, -100.0, side, side});
        const HeightInterval of_b = b.interval({-side, -100.0, side, side});
        EXPECT_EQ(of_a.low, of_b.low);
        EXPECT_EQ(of_a.high, of_b.high);
        EXPECT_EQ(a.rise_bound(side), b.rise_bound(side));
    }
}

}  // namespace terrane::test
