// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"
#include "raster/cancellable_work.h"
#include "support/random.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::test {
namespace errors_test {

void write_bytes(const std::string& path, const std::string& bytes) {
    write_file(path, {bytes.begin(), bytes.end()});
}

std::string read_bytes(const std::string& path) {
    const std::vector<char> bytes = read_file(path);
    return {bytes.begin(), bytes.end()};
}

RasterSpec slope(int columns, int rows) {
    RasterSpec spec{.columns = columns, .rows = rows, .value = [](int column, int row) {
                        return 100.0 + column + 2.0 * row;
                    }};
    return spec;
}

/// The error of opening a file; fails the test where it opens.
Error error_of(const std::string& path, const DemSettings& settings = {}) {
    const auto source = DemHeights::open(path, settings);
    EXPECT_FALSE(source.has_value()) << path << " opened";
    if (source) return {};
    EXPECT_EQ(source.error().message.find('\n'), std::string::npos) << source.error().message;
    return source.error();
}

bool mentions(const Error& error, const std::string& text) {
    return error.message.find(text) != std::string::npos;
}

TEST(DemErrors, WhatIsNoRasterOfHeightsIsNamed) {
    const TemporaryFolder folder;
    const std::string text = folder.file("heights.txt"), empty = folder.file("empty.tif"),
                      whole = folder.file("whole.tif"), cut = folder.file("cut.tif"),
                      single = folder.file("single.tif"), nodata = folder.file("nodata.tif"),
                      pipe = folder.file("pipe.tif"), bands = folder.file("bands.vrt");
    write_bytes(text, "these are no heights\n");
    write_bytes(empty, "");
    write_raster(whole, slope(400, 400));
    write_bytes(cut, read_bytes(whole).substr(0, 200'000));
    write_raster(single, slope(1, 1));
    RasterSpec spec = slope(7, 5);
    spec.nodata = -9999.0;
    spec.value = [](int, int) { return -9999.0; };
    write_raster(nodata, spec);
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    struct Case {
        std::string path;
        ErrorCode code;
        const char* text = "";
    };
    for (const Case& tested : {Case{"no/such/raster.tif", ErrorCode::io},
                               {text, ErrorCode::io},
                               {empty, ErrorCode::io},
                               {cut, ErrorCode::io},
                               {single, ErrorCode::bad_data, "1 x 1"},
                               {nodata, ErrorCode::bad_data, "nodata"},
                               {pipe, ErrorCode::io, "pipe"},
                               {"/dev/null", ErrorCode::io, "device"}}) {
        const Error error = error_of(tested.path);
        EXPECT_EQ(error.code, tested.code) << tested.path;
        EXPECT_TRUE(mentions(error, tested.path) && mentions(error, tested.text)) << error.message;
    }
    write_bytes(bands, "<VRTDataset rasterXSize=\"5\" rasterYSize=\"5\"></VRTDataset>\n");
    EXPECT_TRUE(mentions(error_of(bands), bands));
}

TEST(DemErrors, TwoByTwoSamplesAreEnough) {
    EXPECT_NEAR(open_dem(slope(2, 2)).source->height(0.0, 0.0), 101.5, 1e-6);
}

TEST(DemErrors, AHeightThatQuantaCannotHoldIsNamedWithItsPlace) {
    const TemporaryFolder folder;
    const std::string path = folder.file("spike.tif");
    for (const double height : {3e11, 1e28, -1e30, 1e33, 3.4e38, -1e300}) {
        RasterSpec spec = slope(30, 20);
        spec.type = GDT_Float64;
        spec.value = [&](int column, int row) { return column >= 7 && row >= 5 ? height : 0.0; };
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        std::array<char, 40> value{};
        std::snprintf(value.data(), value.size(), "%.6g m", height);
        EXPECT_TRUE(mentions(error, value.data())) << error.message;
        EXPECT_TRUE(mentions(error, "column 7, row 19 ")) << error.message;
        // The same number, declared as nodata, is none.
        spec.nodata = height;
        write_raster(path, spec);
        EXPECT_TRUE(DemHeights::open(path, {}).has_value()) << height;
    }
}

TEST(DemErrors, ComplexNumbersAreRefusedByTheirType) {
    const TemporaryFolder folder;
    const std::string path = folder.file("complex.tif");
    for (const auto& [type, name] : {std::pair{GDT_CInt16, "CInt16"},
                                     {GDT_CInt32, "CInt32"},
                                     {GDT_CFloat32, "CFloat32"},
                                     {GDT_CFloat64, "CFloat64"}}) {
        RasterSpec spec = slope(20, 20);
        spec.type = type;
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, name) && mentions(error, path)) << error.message;
    }
}

TEST(DemErrors, AScaleThatMakesNoHeightsIsNamed) {
    const TemporaryFolder folder;
    const std::string path = folder.file("scale.tif");
    for (const double scale : {0.0, std::nan("")}) {
        RasterSpec spec = slope(20, 20);
        spec.scale = scale;
        write_raster(path, spec);
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(error, scale == 0.0 ? "scale of 0" : "scale of nan")) << error.message;
    }
}

TEST(DemErrors, CellsWithoutAreaAreNamedWithTheirGeotransform) {
    const TemporaryFolder folder;
    const std::string tif = folder.file("slope.tif"), path = folder.file("placed.vrt");
    write_raster(tif, slope(20, 20));
    for (const char* transform :
         {"0, 0, 0, 0, 0, 0", "0, 0, 0, 0, 0, -10", "0, nan, 0, 0, 0, -10", "0, 10, 0, nan, 0, -10",
          "0, inf, 0, 0, 0, -10", "0, 1, 1, 0, 1, 1"}) {
        std::ofstream(path)
            << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><GeoTransform>" << transform
            << "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource>"
               "<SourceFilename relativeToVRT=\"1\">slope.tif</SourceFilename></SimpleSource>"
               "</VRTRasterBand></VRTDataset>\n";
        const Error error = error_of(path);
        EXPECT_EQ(error.code, ErrorCode::bad_data) << transform;
        EXPECT_TRUE(mentions(error, path) && mentions(error, "geotransform")) << error.message;
    }
}

TEST(DemErrors, CellsThatAreTooOblongAreNamed) {
    const TemporaryFolder folder;
    const std::string path = folder.file("oblong.tif");
    RasterSpec spec = slope(20, 20);
    spec.transform[1] = 1.0;
    spec.transform[5] = -1000.0;
    write_raster(path, spec);
    const Error error = error_of(path);
    EXPECT_EQ(error.code, ErrorCode::bad_data);
    EXPECT_TRUE(mentions(error, "1 x 1000 m") && mentions(error, "32")) << error.message;
    spec.transform[5] = -32.0;
    write_raster(path, spec);
    EXPECT_TRUE(DemHeights::open(path, {}).has_value());
}

TEST(DemErrors, DegreesBeyondTheEarthAreRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("degrees.tif");
    struct Place {
        double west, north, cell;
        const char* reason;  ///< null: it opens
    };
    for (const Place& place : {Place{10.0, 91.0, 0.01, "latitude 91 degrees"},
                               {10.0, 90.05, 0.01, "latitude 90.05"},
                               {10.0, -89.9, 0.01, "latitude -90.1"},
                               {10.0, 89.99, 0.1, "times too long"},
                               {-180.0, 90.0, 9.0, "times too long"},
                               {10.0, 5e6, 30.0, "latitude"},
                               {5e5, 10.0, 0.01, "longitude 500000"},
                               {0.0, 10.0, 20.0, "latitude -390"},
                               {10.0, 80.0, 0.01, nullptr},
                               {350.0, 60.0, 1.0, nullptr},
                               {-180.0, 60.0, 6.0, nullptr}}) {
        RasterSpec spec = slope(20, 20);
        spec.crs = "EPSG:4326";
        spec.transform = {place.west, place.cell, 0.0, place.north, 0.0, -place.cell};
        write_raster(path, spec);
        DemInfo info;
        const auto source = DemHeights::open(path, {}, &info);
        if (place.reason == nullptr) {
            ASSERT_TRUE(source.has_value()) << source.error().message;
            EXPECT_LE(info.scale_error, 9.0);
            continue;
        }
        ASSERT_FALSE(source.has_value()) << place.north << ", scale error " << info.scale_error;
        EXPECT_EQ(source.error().code, ErrorCode::bad_data);
        EXPECT_TRUE(mentions(source.error(), place.reason)) << source.error().message;
        EXPECT_TRUE(mentions(source.error(), path)) << source.error().message;
    }
}

TEST(DemErrors, SettingsOutOfRangeAreNamedWithTheirValue) {
    const TemporaryFolder folder;
    const std::string path = folder.file("slope.tif");
    write_raster(path, slope(20, 20));
    for (const double spacing : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        const Error error =
            error_of(path, DemSettings{.finest_spacing = spacing, .detail_seed = {}});
        EXPECT_EQ(error.code, ErrorCode::invalid_argument);
        EXPECT_TRUE(mentions(error, "finest_spacing")) << error.message;
    }
    for (const double seconds : {0.0, -1.0, std::nan("")}) {
        DemSettings hasty{.detail_seed = {}, .read_timeout = seconds};
        EXPECT_TRUE(mentions(error_of(path, hasty), "read_timeout"));
    }
    DemSettings rough{.detail_seed = 1, .detail_roughness = -2.0};
    EXPECT_TRUE(mentions(error_of(path, rough), "detail_roughness"));
}

TEST(DemErrors, ASpacingThatNeedsMoreThan24LevelsIsRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("slope.tif");
    write_raster(path, slope(20, 20));
    DemSettings settings{.finest_spacing = 1e-9, .detail_seed = {}};
    const Error error = error_of(path, settings);
    EXPECT_EQ(error.code, ErrorCode::invalid_argument);
    EXPECT_TRUE(mentions(error, "1e-09")) << error.message;
    // The same for cells that are not square.
    RasterSpec oblong = slope(20, 20);
    oblong.transform[5] = -7.0;
    write_raster(path, oblong);
    EXPECT_EQ(error_of(path, settings).code, ErrorCode::invalid_argument);
}

}  // namespace errors_test

// Files with a few bits flipped, bytes changed or the end cut off: opening them ends in a source that
// works, or in one line that names the file. A bound of memory bounds the work, too.

namespace damaged_files_test {

using errors_test::read_bytes;
using errors_test::write_bytes;

double hill(int column, int row) { return 100.0 + 3.0 * ((column * 7 + row * 13) % 29); }

std::string ascii_grid(int columns, int rows) {
    std::ostringstream text;
    text << "ncols " << columns << "\nnrows " << rows
         << "\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\nNODATA_value -9999\n";
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) text << hill(column, row) << ' ';
        text << '\n';
    }
    return text.str();
}

std::string geotiff(const std::string& path, const char* compression) {
    RasterSpec spec{.columns = 40, .rows = 50, .nodata = -9999.0, .value = hill};
    write_raster(path, spec);
    if (compression == nullptr) return read_bytes(path);
    auto* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    auto* from = GDALDataset::FromHandle(GDALOpen(path.c_str(), GA_ReadOnly));
    std::string option = std::string("COMPRESS=") + compression;
    char* options[] = {option.data(), nullptr};
    const std::string packed = path + ".packed.tif";
    GDALClose(GDALDataset::ToHandle(
        driver->CreateCopy(packed.c_str(), from, 0, options, nullptr, nullptr)));
    GDALClose(GDALDataset::ToHandle(from));
    return read_bytes(packed);
}

std::string png(const std::string& path) {
    GDALAllRegister();
    auto* memory =
        GetGDALDriverManager()->GetDriverByName("MEM")->Create("", 40, 50, 1, GDT_UInt16, nullptr);
    std::vector<double> values;
    for (int i = 0; i < 2000; ++i) values.push_back(hill(i % 40, i / 40));
    EXPECT_EQ(memory->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 40, 50, values.data(), 40, 50,
                                                 GDT_Float64, 0, 0, nullptr),
              CE_None);
    GDALClose(GDALDataset::ToHandle(GetGDALDriverManager()->GetDriverByName("PNG")->CreateCopy(
        path.c_str(), memory, 0, nullptr, nullptr, nullptr)));
    GDALClose(GDALDataset::ToHandle(memory));
    return read_bytes(path);
}

std::string vrt() {
    return "<VRTDataset rasterXSize=\"40\" rasterYSize=\"50\">\n"
           "<SRS>EPSG:32633</SRS>\n"
           "<GeoTransform>500000, 10, 0, 4000000, 0, -10</GeoTransform>\n"
           "<VRTRasterBand dataType=\"Float32\" band=\"1\">\n"
           "<NoDataValue>-9999</NoDataValue><Offset>3</Offset><Scale>0.1</Scale>\n"
           "<SimpleSource><SourceFilename relativeToVRT=\"1\">whole.tif</SourceFilename>\n"
           "<SourceBand>1</SourceBand>\n"
           "<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"40\" ySize=\"50\"/>\n"
           "<DstRect xOff=\"0\" yOff=\"0\" xSize=\"40\" ySize=\"50\"/>\n"
           "</SimpleSource></VRTRasterBand></VRTDataset>\n";
}

std::string hgt() {
    std::string bytes;
    for (int row = 0; row < 1201; ++row) {
        for (int column = 0; column < 1201; ++column) {
            const int height = static_cast<int>(hill(column, row));
            bytes += static_cast<char>(height >> 8);
            bytes += static_cast<char>(height & 255);
        }
    }
    return bytes;
}

/// Half of the damage goes to the first bytes, where headers are.
std::string damaged(std::string bytes, unsigned seed) {
    std::mt19937 random(seed);
    const std::size_t head = std::min<std::size_t>(bytes.size(), 400);
    const unsigned count = 1 + random() % 4;
    for (unsigned i = 0; i < count && !bytes.empty(); ++i) {
        const std::size_t at = random() % 2 == 0 ? random() % head : random() % bytes.size();
        const unsigned kind = random() % 8;
        char& byte = bytes[std::min(at, bytes.size() - 1)];
        if (kind < 5) byte = static_cast<char>(byte ^ static_cast<char>(1u << random() % 8));
        if (kind == 5) byte = static_cast<char>(random() % 256);
        if (kind == 6) byte = static_cast<char>('0' + random() % 10);
        if (kind == 7) bytes.resize(at);
    }
    return bytes;
}

void expect_an_end(const std::string& path) {
    DemSettings settings;
    // About two million samples.
    settings.memory_bytes = std::size_t{100} << 20;
    DemInfo info;
    const auto source = DemHeights::open(path, settings, &info);
    if (!source) {
        const std::string& message = source.error().message;
        EXPECT_NE(message.find(std::filesystem::path(path).filename().string()), std::string::npos)
            << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return;
    }
    const HeightSource& heights = **source;
    EXPECT_TRUE(std::isfinite(heights.height(0.0, 0.0)));
    const HeightInterval range = heights.interval(heights.extent());
    EXPECT_TRUE(std::isfinite(range.low) && std::isfinite(range.high));
    EXPECT_LE(info.min_m, info.max_m);
}

struct Kind {
    const char* name;  ///< of the file
    int seeds;
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class DamagedFile : public testing::TestWithParam<Kind> {
protected:
    std::string whole() const {
        const std::string name = GetParam().name, path = folder_.file("whole.tif");
        if (name == "grid.asc") return ascii_grid(40, 50);
        if (name == "tall.asc") return ascii_grid(4, 600);
        if (name == "plain.tif") return geotiff(path, nullptr);
        if (name == "packed.tif") return geotiff(path, "DEFLATE");
        if (name == "picture.png") return png(folder_.file("whole.png"));
        if (name == "N44W072.hgt") return hgt();
        geotiff(path, nullptr);
        return vrt();
    }
    const TemporaryFolder folder_;
};

TEST_P(DamagedFile, OpensOrEndsInOneLineThatNamesIt) {
    const std::string bytes = whole(), path = folder_.file(GetParam().name);
    write_bytes(path, bytes);
    ASSERT_TRUE(DemHeights::open(path, {}).has_value());
    for (unsigned seed = 1;
         seed <= static_cast<unsigned>(few_or_many(GetParam().seeds / 3, GetParam().seeds));
         ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        write_bytes(path, damaged(bytes, seed));
        expect_an_end(path);
    }
}

INSTANTIATE_TEST_SUITE_P(Formats, DamagedFile,
                         testing::Values(Kind{"grid.asc", 120}, Kind{"tall.asc", 60},
                                         Kind{"plain.tif", 120}, Kind{"packed.tif", 120},
                                         Kind{"picture.png", 80}, Kind{"mosaic.vrt", 120},
                                         Kind{"N44W072.hgt", 2}),
                         [](const testing::TestParamInfo<Kind>& param) {
                             std::string name = param.param.name;
                             std::replace(name.begin(), name.end(), '.', '_');
                             return name;
                         });

/// A reader that goes back to the first row that it knows for every row that it does not know took
/// twice as long for every row after the damage.
TEST(DamagedFiles, AnAsciiGridThatEndsEarlyEndsInAnError) {
    const TemporaryFolder folder;
    const std::string path = folder.file("short.asc");
    std::string bytes = ascii_grid(30, 1200);
    // A bit of the number of columns: 30 becomes 70.
    bytes.replace(bytes.find("30"), 2, "70");
    write_bytes(path, bytes);
    const auto source = DemHeights::open(path, {});
    ASSERT_FALSE(source.has_value());
    EXPECT_EQ(source.error().code, ErrorCode::io);
    EXPECT_NE(source.error().message.find(path), std::string::npos) << source.error().message;
}

}  // namespace damaged_files_test
}  // namespace terrane::test

namespace terrane::internal::guarded_calls_test {

constexpr double kForEver = std::numeric_limits<double>::infinity();

TEST(GuardedCalls, RunEveryCallOneAtATimeFromAnyThread) {
    GuardedCalls calls(kForEver);
    int count = 0;  // no atomic: calls do not overlap
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
        threads.emplace_back([&] {
            for (int k = 0; k < 250; ++k) EXPECT_TRUE(calls.run([&count] { ++count; }));
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(count, 1000);
}

TEST(GuardedCalls, PassOnWhatACallThrows) {
    GuardedCalls calls(kForEver);
    EXPECT_THROW(calls.run([] { throw std::runtime_error("damaged"); }), std::runtime_error);
    int count = 0;
    EXPECT_TRUE(calls.run([&count] { ++count; }));
    EXPECT_EQ(count, 1);
}

TEST(GuardedCalls, GiveUpACallThatDoesNotReturnAndEveryOneAfterIt) {
    const auto is_free = std::make_shared<std::atomic<bool>>(false);
    {
        GuardedCalls calls(0.05);
        EXPECT_FALSE(calls.run([is_free] {
            while (!*is_free) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }));
        EXPECT_FALSE(calls.run([] { FAIL() << "ran after a call that was given up"; }));
    }
    *is_free = true;
}

TEST(GuardedCallsDeathTest, AProcessWithACallThatWasGivenUpEndsWithItsStatus) {
    testing::GTEST_FLAG(death_test_style) = "threadsafe";
    EXPECT_EXIT(
        {
            // A destructor that the call in the background would meet.
            static const struct AtEnd {
                ~AtEnd() { std::abort(); }
            } at_end;
            GuardedCalls calls(0.05);
            static_cast<void>(
                calls.run([] { std::this_thread::sleep_for(std::chrono::hours(1)); }));
            std::exit(7);
        },
        testing::ExitedWithCode(7), "");
}

}  // namespace terrane::internal::guarded_calls_test
