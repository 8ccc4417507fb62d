// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <terrane/dem/surface_raster.h>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <string>

namespace terrane::test {
namespace surface_raster_errors_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

RasterSpec constant(double value, GDALDataType type = GDT_Float64) {
    RasterSpec spec;
    spec.columns = 30;
    spec.rows = 20;
    spec.type = type;
    spec.value = [value](int column, int row) { return column >= 7 && row >= 5 ? value : 0.0; };
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

TEST(SurfaceRasterErrors, AMissingFileATextFileAndAPipeAreNamed) {
    const TemporaryFolder folder;
    const std::string text = folder.file("text.tif"), pipe = folder.file("pipe.tif");
    std::ofstream(text) << "these are no materials\n";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    for (const std::string& path : {std::string("no/such/raster.tif"), text, pipe}) {
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::io);
        EXPECT_TRUE(mentions(error, path)) << error.message;
    }
}

TEST(SurfaceRasterErrors, ATruncatedFileDoesNotOpen) {
    const TemporaryFolder folder;
    const std::string path = folder.file("whole.tif"), cut = folder.file("cut.tif");
    RasterSpec spec = constant(1.0);
    spec.columns = spec.rows = 400;
    write_raster(path, spec);
    std::ifstream from(path, std::ios::binary);
    std::string bytes(200000, '\0');
    from.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    std::ofstream(cut, std::ios::binary).write(bytes.data(), from.gcount());
    const Error error = error_of(cut);
    EXPECT_EQ(error.code, ErrorCode::io);
    EXPECT_TRUE(mentions(error, cut)) << error.message;
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
    const std::string pipe = folder.file("pipe.tif"), path = folder.file("mosaic.vrt");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    std::ofstream(path)
        << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><VRTRasterBand dataType=\"Byte\" "
           "band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">pipe.tif"
           "</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>\n";
    const Error error = error_of(path, {.read_timeout = 0.3});
    EXPECT_EQ(error.code, ErrorCode::timed_out) << error.message;
    EXPECT_TRUE(mentions(error, path) && mentions(error, "0.3 s")) << error.message;
    // Releases the thread that waits for the pipe.
    const int writer = open(pipe.c_str(), O_RDWR | O_NONBLOCK);
    ASSERT_GE(writer, 0);
    close(writer);
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
