// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <terrane/dem/surface_raster.h>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

namespace terrane::test {
namespace surface_raster_test {

using Map = std::shared_ptr<const SurfaceMap>;

constexpr double kLargest = std::numeric_limits<double>::max();
constexpr SurfaceProperties kGrass{.friction = 0.5, .restitution = 0.1, .material = 99};
constexpr SurfaceProperties kIce{.friction = 0.05, .restitution = 0.3, .material = 7};
constexpr SurfaceProperties kRoad{.friction = 0.9, .restitution = 0.0, .material = 2};

/// 6 x 4 cells of 10 m: materials 0, 1, 2 ... from the north-west, row by row.
RasterSpec numbered(GDALDataType type = GDT_Byte) {
    RasterSpec spec{.columns = 6, .rows = 4, .type = type, .value = [](int column, int row) {
                        return row * 6.0 + column;
                    }};
    return spec;
}

SurfaceRasterSettings with_table() { return {.materials = {kIce, kRoad}, .defaults = kGrass}; }

Map open_map(const std::string& path, const SurfaceRasterSettings& settings,
             SurfaceRasterInfo* info_out = nullptr) {
    const auto map = SurfaceRaster::open(path, settings, info_out);
    EXPECT_TRUE(map.has_value()) << (map ? "" : map.error().message);
    return map.value();
}

SurfaceProperties of_material(std::uint32_t material) {
    if (material == kIce.material) return kIce;
    if (material == kRoad.material) return kRoad;
    SurfaceProperties properties = kGrass;
    properties.material = material;
    return properties;
}

class SurfaceRasterTest : public testing::Test {
protected:
    std::string written(const RasterSpec& spec, const std::string& name = "surface.tif") {
        write_raster(folder_.file(name), spec);
        return folder_.file(name);
    }

    TemporaryFolder folder_;
};

TEST_F(SurfaceRasterTest, LiesAroundTheOriginAndAnswersWithTheSampleOfTheCell) {
    SurfaceRasterInfo info;
    const Map map = open_map(written(numbered()), with_table(), &info);
    EXPECT_EQ(info.columns, 6);
    EXPECT_EQ(info.rows, 4);
    EXPECT_EQ(info.rect.west, -30.0);
    EXPECT_EQ(info.rect.south, -20.0);
    EXPECT_EQ(info.rect.east, 30.0);
    EXPECT_EQ(info.rect.north, 20.0);
    EXPECT_NE(info.crs.find("UTM zone 33N"), std::string::npos);
    EXPECT_EQ(info.nodata_share, 0.0);
    EXPECT_EQ(info.unlisted_share, 22.0 / 24.0);
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 6; ++column) {
            const double x = (column + 0.5 - 3.0) * 10.0, y = (2.0 - row - 0.5) * 10.0;
            const auto material = static_cast<std::uint32_t>(row * 6 + column);
            for (const double off : {-4.999, 0.0, 4.999}) {
                EXPECT_EQ(map->at(x + off, y + off), of_material(material));
                EXPECT_EQ(map->at(x + off, y - off), of_material(material));
            }
        }
    }
    EXPECT_EQ(map->fault_count(), 0u);
}

TEST_F(SurfaceRasterTest, GivesEdgesToTheEastAndNorthAndItsOuterEdgesToItself) {
    const Map map = open_map(written(numbered()), with_table());
    EXPECT_EQ(map->at(0.0, 15.0).material, 3u);
    EXPECT_EQ(map->at(std::nextafter(0.0, -1.0), 15.0).material, 2u);
    EXPECT_EQ(map->at(-25.0, 10.0).material, 0u);
    EXPECT_EQ(map->at(-25.0, std::nextafter(10.0, 0.0)).material, 6u);
    EXPECT_EQ(map->at(-30.0, 20.0).material, 0u);
    EXPECT_EQ(map->at(30.0, 20.0).material, 5u);
    EXPECT_EQ(map->at(-30.0, -20.0).material, 18u);
    EXPECT_EQ(map->at(30.0, -20.0).material, 23u);
    for (const double x : {std::nextafter(30.0, 31.0), -30.1, kLargest, -kLargest, std::nan("")}) {
        EXPECT_EQ(map->at(x, 0.0), kGrass) << x;
        EXPECT_EQ(map->at(0.0, x), kGrass) << x;
    }
    EXPECT_EQ(map->at(0.0, std::nextafter(20.0, 21.0)), kGrass);
}

TEST_F(SurfaceRasterTest, ReadsRowsFromTheSouthAndColumnsFromTheEastAsTheFileHasThem) {
    RasterSpec spec = numbered();
    spec.transform = {1060.0, -10.0, 0.0, 4960.0, 0.0, 10.0};
    const Map map = open_map(written(spec), with_table());
    EXPECT_EQ(map->at(25.0, -15.0).material, 0u);
    EXPECT_EQ(map->at(-25.0, -15.0).material, 5u);
    EXPECT_EQ(map->at(25.0, 15.0).material, 18u);
}

TEST_F(SurfaceRasterTest, OfFrictionHasTheRestFromItsDefaults) {
    RasterSpec spec = numbered(GDT_Float64);
    spec.value = [](int column, int row) { return row == 0 ? 0.1 * column : 1e6; };
    spec.unit = "ft";  // no height: not converted
    const Map map =
        open_map(written(spec), {.numbers = SurfaceNumbers::friction, .defaults = kGrass});
    EXPECT_EQ(map->at(-25.0, 15.0).friction, 0.0);
    const SurfaceProperties found = map->at(-5.0, 15.0);
    EXPECT_EQ(found.friction, static_cast<double>(0.2f));
    EXPECT_EQ(found.restitution, kGrass.restitution);
    EXPECT_EQ(found.material, kGrass.material);
    EXPECT_EQ(map->at(0.0, -5.0).friction, 1e6);
    EXPECT_EQ(map->at(100.0, 0.0), kGrass);
}

TEST_F(SurfaceRasterTest, AppliesScaleAndOffset) {
    RasterSpec spec = numbered();
    spec.scale = 0.01;
    spec.offset = 0.5;
    const Map map = open_map(written(spec), {.numbers = SurfaceNumbers::friction});
    EXPECT_EQ(map->at(25.0, -15.0).friction, static_cast<double>(0.73f));
}

TEST_F(SurfaceRasterTest, HasTheDefaultsWhereThereIsNodata) {
    RasterSpec spec = numbered();
    spec.nodata = 7.0;  // listed, and yet nodata
    SurfaceRasterInfo info;
    const Map map = open_map(written(spec), with_table(), &info);
    EXPECT_EQ(map->at(-15.0, 5.0), kGrass);
    EXPECT_EQ(info.nodata_share, 1.0 / 24.0);
    EXPECT_EQ(info.unlisted_share, 22.0 / 24.0);
    RasterSpec holes = numbered(GDT_Float32);
    holes.value = [](int column, int row) {
        if (column == 0) return std::nan("");
        if (column == 1) return std::numeric_limits<double>::infinity();
        return row * 1.0;
    };
    const SurfaceRasterSettings frictions{.numbers = SurfaceNumbers::friction, .defaults = kGrass};
    const Map other = open_map(written(holes), frictions, &info);
    EXPECT_EQ(other->at(-25.0, 0.0), kGrass);
    EXPECT_EQ(other->at(-15.0, 0.0), kGrass);
    EXPECT_EQ(other->at(-5.0, -15.0).friction, 3.0);
    EXPECT_EQ(info.nodata_share, 8.0 / 24.0);
    EXPECT_EQ(info.unlisted_share, 0.0);
}

TEST_F(SurfaceRasterTest, MayHaveASingleSampleOrNoValidOne) {
    RasterSpec spec = numbered();
    spec.columns = spec.rows = 1;
    spec.value = [](int, int) { return 7.0; };
    const Map map = open_map(written(spec), with_table());
    EXPECT_EQ(map->at(-5.0, 5.0), kIce);
    EXPECT_EQ(map->at(5.0, -5.0), kIce);
    EXPECT_EQ(map->at(5.1, 0.0), kGrass);
    spec.nodata = 7.0;
    const Map empty = open_map(written(spec), with_table());
    EXPECT_EQ(empty->at(0.0, 0.0), kGrass);
}

TEST_F(SurfaceRasterTest, LiesInTheRectangleThatItIsGiven) {
    SurfaceRasterSettings settings = with_table();
    settings.rect = WorldRect{1e6, -8.0, 1e6 + 3.0, 0.0};
    SurfaceRasterInfo info;
    const Map map = open_map(written(numbered()), settings, &info);
    EXPECT_EQ(info.rect.east, 1e6 + 3.0);
    EXPECT_EQ(map->at(1e6 + 0.25, -1.0).material, 0u);
    EXPECT_EQ(map->at(1e6 + 0.5, -2.0).material, 1u);
    EXPECT_EQ(map->at(1e6 + 3.0, -8.0).material, 23u);
    EXPECT_EQ(map->at(0.0, 0.0), kGrass);
}

TEST_F(SurfaceRasterTest, LiesOverADemOfTheSameCrsAsTheEarthHasThem) {
    RasterSpec dem = numbered(GDT_Float32);
    dem.transform = {1000.0, 10.0, 0.0, 5000.0, 0.0, -10.0};  // centre 1030, 4980
    const DemInfo dem_info = open_dem(dem).info;
    RasterSpec spec = numbered();
    spec.transform = {1020.0, 2.5, 0.0, 4990.0, 0.0, -5.0};
    SurfaceRasterSettings settings = with_table();
    settings.aligned_with = dem_info;
    SurfaceRasterInfo info;
    const Map map = open_map(written(spec), settings, &info);
    EXPECT_EQ(info.rect.west, -10.0);
    EXPECT_EQ(info.rect.east, 5.0);
    EXPECT_EQ(info.rect.north, 10.0);
    EXPECT_EQ(info.rect.south, -10.0);
    EXPECT_EQ(map->at(-10.0, 10.0).material, 0u);
    EXPECT_EQ(map->at(0.1, -0.1), of_material(16));
}

TEST_F(SurfaceRasterTest, LiesOverADemInDegreesByTheScaleOfTheDem) {
    RasterSpec dem = numbered(GDT_Float32);
    dem.crs = "EPSG:4326";
    dem.transform = {-179.5, 0.01, 0.0, 47.0, 0.0, -0.01};
    const DemInfo dem_info = open_dem(dem).info;
    for (const double turn : {0.0, 360.0}) {
        RasterSpec spec = numbered();
        spec.crs = "EPSG:4326";
        spec.transform = {-179.5 + turn, 0.005, 0.0, 47.02, 0.0, -0.01};
        SurfaceRasterSettings settings = with_table();
        settings.aligned_with = dem_info;
        SurfaceRasterInfo info;
        const Map map = open_map(written(spec), settings, &info);
        // From the DEM's centre, in degrees: 0.03 to 0 west, 0 to 0.04 north.
        EXPECT_NEAR(info.rect.west, -0.03 * dem_info.metres_per_unit_x, 1e-6);
        EXPECT_NEAR(info.rect.east, 0.0, 1e-6);
        EXPECT_NEAR(info.rect.south, 0.0, 1e-6);
        EXPECT_NEAR(info.rect.north, 0.04 * dem_info.metres_per_unit_y, 1e-6);
    }
}

TEST_F(SurfaceRasterTest, IsNotAlignedWithoutTheNameOfTheSameCrs) {
    const DemInfo utm = open_dem(numbered()).info;
    for (const char* crs : {"EPSG:32632", "EPSG:32733", ""}) {
        RasterSpec spec = numbered();
        spec.crs = crs;
        SurfaceRasterSettings settings{.aligned_with = utm};
        const std::string path = written(spec);
        const auto map = SurfaceRaster::open(path, settings);
        ASSERT_FALSE(map.has_value()) << crs;
        EXPECT_EQ(map.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(map.error().message.find(path), std::string::npos) << map.error().message;
        EXPECT_NE(map.error().message.find("zone 33N"), std::string::npos) << map.error().message;
    }
    RasterSpec nameless = numbered();
    nameless.crs = "";
    SurfaceRasterSettings settings{.aligned_with = open_dem(nameless).info};
    EXPECT_FALSE(SurfaceRaster::open(written(nameless), settings).has_value());
}

TEST_F(SurfaceRasterTest, OfRotatedCellsHasNoNumberThatTheFileDoesNotHave) {
    RasterSpec spec = numbered();
    spec.columns = spec.rows = 40;
    spec.transform = {1000.0, 8.0, 6.0, 5000.0, 6.0, -8.0};
    spec.value = [](int column, int) { return column < 20 ? 2.0 : 7.0; };
    SurfaceRasterInfo info;
    const Map map = open_map(written(spec), with_table(), &info);
    EXPECT_EQ(info.unlisted_share, 0.0);
    EXPECT_GT(info.nodata_share, 0.1);
    int ice = 0, road = 0;
    for (double x = -60.0; x <= 60.0; x += 1.0) {
        for (double y = -60.0; y <= 60.0; y += 1.0) {
            const std::uint32_t material = map->at(x, y).material;
            if (material == kIce.material) ++ice;
            if (material == kRoad.material) ++road;
        }
    }
    EXPECT_EQ(ice + road, 121 * 121);
    EXPECT_GT(ice, 1000);
    EXPECT_GT(road, 1000);
}

TEST_F(SurfaceRasterTest, HasTheSamplesOfAFileOfManyStrips) {
    RasterSpec spec = numbered(GDT_UInt16);
    spec.columns = 300;
    spec.rows = 4500;
    spec.value = [](int column, int row) { return (column * 7 + row * 13) % 60000; };
    for (const bool is_flipped : {false, true}) {
        if (is_flipped) spec.transform[5] = 10.0;
        const Map map = open_map(written(spec), {});
        for (int row = 0; row < spec.rows; row += 7) {
            const double north = (0.5 * spec.rows - row - 0.5) * 10.0;
            const double y = is_flipped ? -north : north;
            for (const int column : {0, 1, 150, 299}) {
                const double x = (column + 0.5 - 150.0) * 10.0;
                ASSERT_EQ(map->at(x, y).material, spec.value(column, row))
                    << column << ' ' << row << (is_flipped ? " from the south" : "");
            }
        }
    }
}

TEST_F(SurfaceRasterTest, AnswersTheSameOnAllThreads) {
    const Map map = open_map(written(numbered()), with_table());
    std::array<int, 4> wrong{};
    std::vector<std::thread> threads;
    for (int& wrong_of_thread : wrong) {
        threads.emplace_back([&] {
            for (int i = 0; i < 24000; ++i) {
                const int column = i % 6, row = i / 6 % 4;
                const double x = (column + 0.5 - 3.0) * 10.0, y = (2.0 - row - 0.5) * 10.0;
                const auto material = static_cast<std::uint32_t>(row * 6 + column);
                if (map->at(x, y) != of_material(material)) ++wrong_of_thread;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, (std::array<int, 4>{}));
}

}  // namespace surface_raster_test

namespace surface_raster_errors_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

RasterSpec constant(double value, GDALDataType type = GDT_Float64) {
    RasterSpec spec{.columns = 30, .rows = 20, .type = type, .value = [value](int column, int row) {
                        return column >= 7 && row >= 5 ? value : 0.0;
                    }};
    return spec;
}

/// The error of opening a file; fails the test where it opens.
Error error_of(const std::string& path, const SurfaceRasterSettings& settings = {}) {
    const auto map = SurfaceRaster::open(path, settings);
    EXPECT_FALSE(map.has_value()) << path << " opened";
    if (map) return {};
    EXPECT_EQ(map.error().message.find('\n'), std::string::npos) << map.error().message;
    return map.error();
}

bool mentions(const Error& error, const std::string& text) {
    return error.message.find(text) != std::string::npos;
}

TEST(SurfaceRasterErrors, WhatIsNoRasterIsNamed) {
    const TemporaryFolder folder;
    const std::string text = folder.file("text.tif"), pipe = folder.file("pipe.tif"),
                      whole = folder.file("whole.tif"), cut = folder.file("cut.tif");
    std::ofstream(text) << "these are no materials\n";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    RasterSpec spec = constant(1.0);
    spec.columns = spec.rows = 400;
    write_raster(whole, spec);
    std::vector<char> bytes = read_file(whole);
    bytes.resize(200'000);
    write_file(cut, bytes);
    for (const std::string& path : {std::string("no/such/raster.tif"), text, pipe, cut}) {
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::io);
        EXPECT_TRUE(mentions(error, path)) << error.message;
    }
}

TEST(SurfaceRasterErrors, ASampleThatIsNoMaterialIsNamedWithItsPlace) {
    const TemporaryFolder folder;
    const std::string path = folder.file("materials.tif");
    struct Wrong {
        double value;
        const char* text;
    };
    for (const Wrong& wrong : {Wrong{-1.0, "-1"}, Wrong{0.5, "0.5"},
                               Wrong{4294967295.0, "4.29497e+09"}, Wrong{1e300, "1e+300"}}) {
        RasterSpec spec = constant(wrong.value);
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, path)) << error.message;
        EXPECT_TRUE(mentions(error, std::string("material of ") + wrong.text)) << error.message;
        EXPECT_TRUE(mentions(error, "column 7, row 19 ")) << error.message;
        // The same number, declared as nodata, is none.
        spec.nodata = wrong.value;
        write_raster(path, spec);
        EXPECT_TRUE(SurfaceRaster::open(path).has_value()) << wrong.text;
    }
    write_raster(path, constant(4294967294.0));
    const auto map = SurfaceRaster::open(path);
    ASSERT_TRUE(map.has_value()) << map.error().message;
    EXPECT_EQ((*map)->at(0.0, 0.0).material, 4294967294u);
}

TEST(SurfaceRasterErrors, ASampleThatIsNoFrictionIsNamedWithItsPlace) {
    const TemporaryFolder folder;
    const std::string path = folder.file("friction.tif");
    for (const double value : {-1e-3, -9999.0, 1.1e6}) {
        write_raster(path, constant(value));
        const Error error = error_of(path, {.numbers = SurfaceNumbers::friction});
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, path) && mentions(error, "friction of ")) << error.message;
        EXPECT_TRUE(mentions(error, "column 7, row 19 ")) << error.message;
        EXPECT_TRUE(mentions(error, "0 to 1e+06")) << error.message;
    }
}

TEST(SurfaceRasterErrors, ComplexNumbersAreRefusedByTheirType) {
    const TemporaryFolder folder;
    const std::string path = folder.file("complex.tif");
    write_raster(path, constant(1.0, GDT_CFloat32));
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::bad_data);
    EXPECT_TRUE(mentions(error, "CFloat32") && mentions(error, path)) << error.message;
}

TEST(SurfaceRasterErrors, ARasterAboveTheLimitIsRefusedBeforeItIsRead) {
    const TemporaryFolder folder;
    const std::string path = folder.file("huge.vrt");
    std::ofstream(path) << "<VRTDataset rasterXSize=\"100000\" rasterYSize=\"100000\">"
                           "<VRTRasterBand dataType=\"Byte\" band=\"1\"/></VRTDataset>\n";
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::out_of_memory);
    for (const char* part : {path.c_str(), "100000 x 100000", "the limit is 2048 MiB",
                             "SurfaceRasterSettings::memory_bytes"}) {
        EXPECT_TRUE(mentions(error, part)) << error.message;
    }
    const std::string small = folder.file("small.tif");
    write_raster(small, constant(1.0));
    // 600 samples: 4 bytes each in the map, 17 while they are read.
    EXPECT_EQ(error_of(small, {.memory_bytes = 600 * 21 - 1}).code, ErrorCode::out_of_memory);
    EXPECT_TRUE(SurfaceRaster::open(small, {.memory_bytes = 600 * 21}).has_value());
}

TEST(SurfaceRasterErrors, AReaderThatGivesNoAnswerIsGivenUp) {
    const TemporaryFolder folder;
    const HungMosaic hung(folder, "Byte");
    const Error error = error_of(hung.path, {.read_timeout = 0.3});
    EXPECT_EQ(error.code, ErrorCode::timed_out) << error.message;
    EXPECT_TRUE(mentions(error, hung.path) && mentions(error, "0.3 s")) << error.message;
}

TEST(SurfaceRasterErrors, SettingsOutOfRangeAreNamedWithTheirValue) {
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, constant(1.0));
    const double nan = std::nan("");
    struct Wrong {
        SurfaceRasterSettings settings;
        const char* text;
    };
    for (const Wrong& wrong :
         {Wrong{{.defaults = {.friction = -1.0}}, "defaults.friction must be 0 to 1e+06, got -1"},
          Wrong{{.materials = {{.material = 1}, {.restitution = 2.0, .material = 3}}},
                "materials[1].restitution must be 0 to 1, got 2"},
          Wrong{{.materials = {{.material = 5}, {.material = 1}, {.material = 5}}},
                "materials must list each material once, got 5 twice"},
          Wrong{{.numbers = SurfaceNumbers::friction, .materials = {{.material = 5}}},
                "materials must be empty where the numbers are friction, got 1"},
          Wrong{{.aligned_with = DemInfo{}, .rect = WorldRect{0.0, 0.0, 1.0, 1.0}},
                "aligned_with and rect exclude each other"},
          Wrong{{.rect = WorldRect{0.0, 0.0, 0.0, 1.0}}, "rect must be finite and have an area"},
          Wrong{{.rect = WorldRect{0.0, 2.0, 1.0, 1.0}}, "south 2, east 1, north 1"},
          Wrong{{.rect = WorldRect{nan, 0.0, 1.0, 1.0}}, "west nan"},
          Wrong{{.rect = WorldRect{0.0, 0.0, kInfinity, 1.0}}, "east inf"},
          Wrong{{.rect = WorldRect{-1.7e308, 0.0, 1.7e308, 1.0}}, "rect must be finite"},
          Wrong{{.rect = WorldRect{0.0, 0.0, 1e-323, 1.0}}, "the place of raster"},
          Wrong{{.read_timeout = 0.0}, "read_timeout must be above 0 s, got 0"},
          Wrong{{.read_timeout = nan}, "read_timeout must be above 0 s, got nan"}}) {
        const Error error = error_of(path, wrong.settings);
        EXPECT_TRUE(mentions(error, wrong.text)) << error.message;
    }
    EXPECT_EQ(error_of(path, {.read_timeout = -1.0}).code, ErrorCode::invalid_argument);
}

}  // namespace surface_raster_errors_test
}  // namespace terrane::test
