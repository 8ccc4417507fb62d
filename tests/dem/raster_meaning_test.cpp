// SPDX-License-Identifier: MIT
//
// What the numbers of a raster mean: type, encoding, unit, axis, nodata and placement.
#include "dem/raster_files.h"
#include "raster/height_numbers.h"

#include <terrane/dem/imagery_raster.h>
#include <terrane/dem/surface_raster.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace terrane::test {
namespace meaning_test {

constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937.0;

RasterSpec ramp(int columns = 4, int rows = 3) {
    return {.columns = columns, .rows = rows, .value = [columns](int column, int row) {
                return 1.0 + column + columns * row;
            }};
}

/// Settings without fractal detail.
DemSettings plain(std::string height_unit = {}, std::optional<std::vector<double>> nodata = {}) {
    DemSettings settings;
    settings.detail_seed = {};
    settings.height_unit = std::move(height_unit);
    settings.nodata = std::move(nodata);
    return settings;
}

/// Error of opening a raster; fails the test if it opens.
std::string refusal(const std::string& path, const DemSettings& settings = {}) {
    const auto source = DemHeights::open(path, settings);
    EXPECT_FALSE(source.has_value()) << path << " opened";
    return source ? "" : source.error().message;
}

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// All notes of an opened raster.
std::string notes_of(const OpenedDem& dem) {
    std::string notes;
    for (const std::string& note : dem.info.notes) notes += note + "\n";
    return notes;
}

class DemMeaning : public testing::Test {
protected:
    std::string written(const RasterSpec& spec) {
        write_raster(folder_.file("raster.tif"), spec);
        return folder_.file("raster.tif");
    }

    /// Writes a raster without CRS, and a VRT of it.
    ///
    /// @param of_dataset, of_band XML elements
    std::string view(RasterSpec spec, const std::string& of_dataset, const std::string& of_band,
                     const std::string& type = "Float32") {
        spec.crs.clear();
        spec.has_place = false;
        written(spec);
        std::ofstream(folder_.file("view.vrt"))
            << "<VRTDataset rasterXSize=\"" << spec.columns << "\" rasterYSize=\"" << spec.rows
            << "\">" << of_dataset << "<VRTRasterBand dataType=\"" << type << "\" band=\"1\">"
            << of_band
            << "<SimpleSource><SourceFilename "
               "relativeToVRT=\"1\">raster.tif</SourceFilename><SourceBand>1</SourceBand>"
               "</SimpleSource></VRTRasterBand></VRTDataset>\n";
        return folder_.file("view.vrt");
    }

    /// Writes 8-bit bands to a file of a driver.
    ///
    /// @param bands [samples] of each band, from the north-west
    std::string picture(const char* driver, const char* name, int columns,
                        const std::vector<std::vector<std::uint8_t>>& bands,
                        bool has_palette = false) {
        GDALAllRegister();
        const int rows = static_cast<int>(bands[0].size()) / columns;
        const int count = static_cast<int>(bands.size());
        auto& manager = *GetGDALDriverManager();
        GDALDataset* memory =
            manager.GetDriverByName("MEM")->Create("", columns, rows, count, GDT_Byte, nullptr);
        constexpr std::array kColours{GCI_RedBand, GCI_GreenBand, GCI_BlueBand, GCI_AlphaBand};
        for (int i = 0; i < count; ++i) {
            GDALRasterBand& band = *memory->GetRasterBand(i + 1);
            if (count >= 3) band.SetColorInterpretation(kColours[static_cast<std::size_t>(i)]);
            std::vector<std::uint8_t> bytes = bands[static_cast<std::size_t>(i)];
            EXPECT_EQ(band.RasterIO(GF_Write, 0, 0, columns, rows, bytes.data(), columns, rows,
                                    GDT_Byte, 0, 0, nullptr),
                      CE_None);
        }
        if (has_palette) {
            GDALColorTable table;
            constexpr GDALColorEntry kGreen{0, 200, 0, 255};
            for (int i = 0; i < 256; ++i) table.SetColorEntry(i, &kGreen);
            memory->GetRasterBand(1)->SetColorTable(&table);
        }
        const std::string path = folder_.file(name);
        GDALClose(GDALDataset::ToHandle(manager.GetDriverByName(driver)->CreateCopy(
            path.c_str(), memory, 0, nullptr, nullptr, nullptr)));
        GDALClose(GDALDataset::ToHandle(memory));
        return path;
    }

    TemporaryFolder folder_;
};

TEST_F(DemMeaning, SignedBytesOf128AndAboveAreNegative) {
    RasterSpec spec{.columns = 16, .rows = 16, .type = GDT_Byte, .value = [](int column, int row) {
                        return column + 16.0 * row;
                    }};
    const std::string signed_byte =
        "<Metadata domain=\"IMAGE_STRUCTURE\"><MDI key=\"PIXELTYPE\">SIGNEDBYTE</MDI></Metadata>";
    const auto expect_signed = [&](const OpenedDem& dem, int nodata) {
        for (int i = 0; i < 256; ++i) {
            const int wanted = i < 128 ? i : i - 256;
            if (wanted != nodata) {
                EXPECT_EQ(dem.at(i % 16, i / 16), wanted);
            }
        }
    };
    const OpenedDem dem = open_dem(view(spec, "", signed_byte, "Byte"));
    expect_signed(dem, -1000);
    EXPECT_TRUE(has(dem.info.numbers, "SIGNEDBYTE")) << dem.info.numbers;
    EXPECT_EQ(std::pair(dem.info.min_m, dem.info.max_m), std::pair(-128.0, 127.0));
    for (const char* nodata : {"-100", "156"}) {
        const OpenedDem with_void = open_dem(
            view(spec, "", signed_byte + "<NoDataValue>" + nodata + "</NoDataValue>", "Byte"));
        expect_signed(with_void, -100);
        EXPECT_EQ(with_void.info.filled_share, 1.0 / 256.0);
        EXPECT_EQ(with_void.info.nodata, "-100, declared");
    }
}

TEST_F(DemMeaning, AUnitIsReadInEverySpelling) {
    const std::array<std::pair<const char*, double>, 34> units{{
        {"m", 1.0},
        {"[m]", 1.0},
        {"Metres", 1.0},
        {"meter", 1.0},
        {"METERS", 1.0},
        {"m.", 1.0},
        {"km", 1e3},
        {"kilometers", 1e3},
        {"Kilometre", 1e3},
        {"dm", 0.1},
        {"decimetres", 0.1},
        {"cm", 0.01},
        {"mm", 0.001},
        {"ft", kFoot},
        {"[ft]", kFoot},
        {"Feet", kFoot},
        {"international_foot", kFoot},
        {"us-ft", kSurveyFoot},
        {"Foot_US", kSurveyFoot},
        {"US survey feet", kSurveyFoot},
        {"US_survey_foot", kSurveyFoot},
        {"ftUS", kSurveyFoot},
        {"sft", kSurveyFoot},
        {"foot (US survey)", kSurveyFoot},
        {"yd", 0.9144},
        {"fathoms", 1.8288},
        {"us-yd", 3.0 * kSurveyFoot},
        {"nmi", 1852.0},
        {"gpm", 1.0},
        {"[gpm]", 1.0},
        {"m**2 s**-2", 1.0 / 9.80665},
        {"m2 s-2", 1.0 / 9.80665},
        {"[m^2/s^2]", 1.0 / 9.80665},
        {"J kg-1", 1.0 / 9.80665},
    }};
    RasterSpec spec = ramp();
    for (const auto& [unit, metres] : units) {
        spec.unit = unit;
        const OpenedDem dem = open_dem(written(spec));
        EXPECT_NEAR(dem.info.max_m, 12.0 * metres, 1e-9 * metres) << unit;
        EXPECT_TRUE(has(dem.info.height_unit, ", from the band")) << dem.info.height_unit;
    }
    EXPECT_TRUE(has(notes_of(open_dem(written(spec))), "geopotential"));
}

TEST_F(DemMeaning, AnUnknownUnitIsRefusedUnlessOneIsSet) {
    RasterSpec spec = ramp();
    for (const char* unit : {"degC", "m/s", "ms", "1", "parsec", "m2"}) {
        spec.unit = unit;
        const std::string message = refusal(written(spec));
        EXPECT_TRUE(has(message, std::string("\"") + unit + "\"") &&
                    has(message, "--height-unit") && has(message, "US survey foot"))
            << message;
        const OpenedDem dem = open_dem(written(spec), plain("feet"));
        EXPECT_NEAR(dem.info.max_m, 12.0 * kFoot, 1e-12);
        EXPECT_EQ(dem.info.height_unit, "foot, as set");
    }
    EXPECT_TRUE(has(refusal(written(ramp()), plain("stone")), "height_unit"));
    EXPECT_TRUE(
        has(refusal(written(ramp()), {.detail_seed = {}, .height_scale = 0.0}), "height_scale"));
}

TEST_F(DemMeaning, TheVerticalCrsHasUnitAndDirection) {
    struct Case {
        const char* crs;
        double metres;
        const char* axis;
    };
    for (const Case& tested : {Case{"EPSG:32633", 1.0, "up, assumed"},
                               {"EPSG:32633+5703", 1.0, "up, from the vertical CRS"},
                               {"EPSG:32633+6360", kSurveyFoot, "up, from the vertical CRS"},
                               {"EPSG:32633+8228", kFoot, "up, from the vertical CRS"},
                               {"EPSG:2263+5703", 1.0, "up, from the vertical CRS"},
                               {"EPSG:32633+5831", -1.0, "down, from the vertical CRS"},
                               {"EPSG:32633+6358", -kSurveyFoot, "down, from the vertical CRS"},
                               {"EPSG:4979", 1.0, "up, from the 3D CRS"}}) {
        const bool is_geographic = std::string(tested.crs) == "EPSG:4979";
        const std::string place = is_geographic ? "10,0.001,0,50,0,-0.001" : "1000,10,0,5000,0,-10";
        const OpenedDem dem = open_dem(view(
            ramp(),
            std::string("<SRS>") + tested.crs + "</SRS><GeoTransform>" + place + "</GeoTransform>",
            ""));
        EXPECT_NEAR(dem.at(1, 2), 10.0 * tested.metres, 1e-9) << tested.crs;
        EXPECT_TRUE(has(dem.info.vertical_axis, tested.axis)) << dem.info.vertical_axis;
    }
    // As a GeoTIFF, whose driver makes a band's unit of the vertical CRS.
    RasterSpec spec = ramp();
    spec.crs = "EPSG:32633+6358";
    EXPECT_NEAR(open_dem(written(spec)).info.min_m, -12.0 * kSurveyFoot, 1e-9);
}

TEST_F(DemMeaning, TwoUnitsAreNotedAndTheBandsIsUsed) {
    const OpenedDem dem = open_dem(
        view(ramp(), "<SRS>EPSG:32633+6360</SRS><GeoTransform>0,10,0,90,0,-10</GeoTransform>",
             "<UnitType>m</UnitType>"));
    EXPECT_EQ(dem.info.max_m, 12.0);
    EXPECT_TRUE(has(notes_of(dem), "two units of height")) << notes_of(dem);
}

TEST_F(DemMeaning, AttributesOfTheBandMakeDepths) {
    const auto attribute = [&](const char* key, const char* value) {
        return open_dem(
            view(ramp(), "",
                 std::string("<Metadata><MDI key=\"") + key + "\">" + value + "</MDI></Metadata>"));
    };
    EXPECT_EQ(attribute("positive", "down").info.min_m, -12.0);
    EXPECT_EQ(attribute("positive", "up").info.max_m, 12.0);
    EXPECT_EQ(attribute("standard_name", "sea_floor_depth_below_geoid").info.min_m, -12.0);
    EXPECT_EQ(attribute("standard_name", "surface_altitude").info.max_m, 12.0);
    const std::string described = view(ramp(), "", "<Description>depth</Description>");
    EXPECT_TRUE(has(notes_of(open_dem(described)), "--height-scale -1"));
    const OpenedDem turned = open_dem(described, {.detail_seed = {}, .height_scale = -1.0});
    EXPECT_EQ(turned.info.min_m, -12.0);
    EXPECT_FALSE(has(notes_of(turned), "depth"));
}

TEST_F(DemMeaning, ColoursAreRefusedUnlessTheirEncodingIsSet) {
    std::vector<std::vector<std::uint8_t>> bands(4, std::vector<std::uint8_t>(12, 255));
    for (std::size_t i = 0; i < 12; ++i) {
        bands[0][i] = static_cast<std::uint8_t>(1 + i / 4);
        bands[1][i] = static_cast<std::uint8_t>(i * 37);
        bands[2][i] = static_cast<std::uint8_t>(255 - i);
    }
    bands[3][5] = 0;  // transparent: a void
    const std::string png = picture("PNG", "tile.png", 4, bands);
    const std::string message = refusal(png);
    EXPECT_TRUE(has(message, "colours") && has(message, "Red") && has(message, "--encoding"))
        << message;
    for (const bool is_terrarium : {true, false}) {
        const OpenedDem dem = open_dem(
            png, {.detail_seed = {},
                  .encoding = is_terrarium ? HeightEncoding::terrarium : HeightEncoding::mapbox});
        for (std::size_t i = 0; i < 12; ++i) {
            const double r = bands[0][i], g = bands[1][i], b = bands[2][i];
            const double wanted = is_terrarium ? r * 256.0 + g + b / 256.0 - 32768.0
                                               : -10000.0 + (r * 65536.0 + g * 256.0 + b) * 0.1;
            if (i != 5) {
                EXPECT_NEAR(dem.at(static_cast<int>(i % 4), static_cast<int>(i / 4)), wanted, 1e-9);
            }
        }
        EXPECT_EQ(dem.info.filled_share, 1.0 / 12.0);
        EXPECT_TRUE(has(dem.info.height_unit, "from the encoding")) << dem.info.height_unit;
    }
    const DemSettings numbers{.detail_seed = {}, .encoding = HeightEncoding::numbers};
    const DemSettings terrarium{.detail_seed = {}, .encoding = HeightEncoding::terrarium};
    EXPECT_EQ(open_dem(png, numbers).info.max_m, 3.0);
    const std::string palette = picture("PNG", "palette.png", 4, {bands[1]}, true);
    EXPECT_TRUE(has(refusal(palette), "colour table"));
    EXPECT_EQ(open_dem(palette, numbers).at(1, 0), 37.0);
    EXPECT_TRUE(has(refusal(palette, terrarium), "has 1 bands"));
    bands.pop_back();
    EXPECT_TRUE(has(refusal(picture("JPEG", "tile.jpg", 4, bands), terrarium), "JPEG"));
}

TEST_F(DemMeaning, AnIdentityGeotransformIsNone) {
    const std::string identity = "<GeoTransform>0,1,0,0,0,1</GeoTransform>";
    const OpenedDem none = open_dem(view(ramp(), "", ""));
    for (const std::string& crs : {std::string(), std::string("<SRS>EPSG:4326</SRS>")}) {
        const OpenedDem dem = open_dem(view(ramp(), crs + identity, ""));
        EXPECT_EQ(dem.at(0, 0), 1.0);
        EXPECT_EQ(dem.at(3, 2), 12.0);
        EXPECT_EQ(dem.info.cell_x, 1.0);
        EXPECT_TRUE(has(notes_of(dem), "no georeferencing: cells of 1 m")) << notes_of(dem);
        EXPECT_EQ(has(notes_of(dem), "the CRS is not used"), !crs.empty());
        expect_same_answers(*dem.source, *none.source);
    }
    const std::string path = view(ramp(), identity, "");
    EXPECT_EQ(SurfaceRaster::open(path).value()->at(-1.5, 1.0).material, 1u);
    const std::string bytes = view(ramp(), identity, "", "Byte");
    const auto imagery = ImageryRaster::open(bytes).value();
    std::array<ImageryTexel, 1> texel{};
    ASSERT_TRUE(imagery->read({-2.0, 0.5, -1.0, 1.5}, 1, texel));
    EXPECT_EQ(texel[0][0], 1);
}

TEST_F(DemMeaning, CellsAndHeightsWithoutGeoreferencingAreScaled) {
    const std::string path = view(ramp(), "", "");
    const OpenedDem dem = open_dem(path, {.detail_seed = {}, .height_scale = 0.5, .cell = 30.0});
    EXPECT_EQ(std::pair(dem.info.cell_x, dem.info.cell_y), std::pair(30.0, 30.0));
    EXPECT_EQ(dem.at(3, 2), 6.0);
    EXPECT_EQ(notes_of(dem), "");
    EXPECT_EQ(dem.info.placement, "none: cells of 30 m, as set");
    const OpenedDem assumed = open_dem(path);
    EXPECT_TRUE(has(notes_of(assumed), "--cell-m") && has(notes_of(assumed), "--height-scale"));
    const std::string message = refusal(written(ramp()), {.detail_seed = {}, .cell = 30.0});
    EXPECT_TRUE(has(message, "geotransform") && has(message, "--cell-m")) << message;
}

TEST_F(DemMeaning, NumbersThatAreCommonlyNodataAreRefusedUntilDeclared) {
    struct Case {
        GDALDataType type;
        double first, second;
        const char* flag;
    };
    for (const Case& tested : {Case{GDT_Int16, -32768.0, -9999.0, "-32768,-9999"},
                               {GDT_Int16, -32767.0, -32767.0, "-32767"},
                               {GDT_Int16, 32767.0, -9999.0, "32767,-9999"},
                               {GDT_UInt16, 65535.0, 65535.0, "65535"},
                               {GDT_Float32, -99999.0, -9999.0, "-99999,-9999"},
                               {GDT_Float64, -1e10, -999.0, "-1e+10,-999"},
                               {GDT_Int32, -2147483648.0, -10000.0, "-2147483648,-10000"}}) {
        RasterSpec spec = ramp(9, 7);
        spec.type = tested.type;
        spec.value = [&](int column, int row) {
            if (row == 3 && column == 4) return tested.first;
            return row == 3 && column == 6 ? tested.second : 100.0 + column;
        };
        for (const char* unit : {"m", "ft"}) {
            spec.unit = unit;
            const std::string path = written(spec);
            const std::string message = refusal(path);
            EXPECT_TRUE(has(message, "is it a nodata value that the file does not declare?") &&
                        has(message, std::string("--nodata ") + tested.flag + " ") &&
                        has(message, "row 3 "))
                << message;
            const OpenedDem dem =
                open_dem(path, plain({}, std::vector{tested.first, tested.second}));
            EXPECT_GT(dem.info.min_m, 30.0);
            EXPECT_EQ(dem.info.filled_share, 2.0 / 63.0);
            EXPECT_TRUE(DemHeights::open(path, plain({}, std::vector<double>())));
        }
    }
    // The float nearest to the given number.
    RasterSpec lowest = ramp(5, 5);
    lowest.value = [](int column, int row) {
        return column == 2 && row == 2 ? -1e30 : 5.0 * column;
    };
    EXPECT_EQ(open_dem(written(lowest), plain({}, std::vector{-1e30})).info.min_m, 0.0);
}

TEST_F(DemMeaning, HeightsThatReachSuchANumberAreNotRefused) {
    for (const double end : {-9999.0, -32768.0, 65535.0}) {
        RasterSpec spec = ramp(40, 3);
        spec.value = [&](int column, int) { return end * column / 39.0; };
        EXPECT_EQ(open_dem(written(spec)).info.nodata_share, 0.0) << end;
    }
    RasterSpec flat = ramp();
    flat.value = [](int, int) { return 9999.0; };
    EXPECT_EQ(open_dem(written(flat)).info.max_m, 9999.0);
}

TEST_F(DemMeaning, VoidsOfEncodedTilesAreDecodedHeights) {
    std::vector<std::vector<std::uint8_t>> bands(3, std::vector<std::uint8_t>(12, 0));
    for (std::size_t i = 1; i < 12; ++i) {
        bands[0][i] = 129;
        bands[1][i] = static_cast<std::uint8_t>(i);
    }
    const std::string png = picture("PNG", "tile.png", 4, bands);
    DemSettings settings{.detail_seed = {}, .encoding = HeightEncoding::terrarium};
    EXPECT_TRUE(has(refusal(png, settings), "--nodata -32768 "));
    settings.nodata = std::vector{-32768.0};
    EXPECT_EQ(open_dem(png, settings).info.min_m, 257.0);
}

TEST_F(DemMeaning, ARasterTurnedByAQuarterHasItsOwnSamples) {
    // The eight symmetries of a square, with the rounding of a cosine of 90 degrees.
    const double e = 10.0 * std::cos(std::acos(-1.0) / 2.0);
    for (const auto& turn : std::vector<std::array<double, 4>>{{10, 0, 0, -10},
                                                               {-10, e, e, 10},
                                                               {10, 0, 0, 10},
                                                               {-10, 0, 0, -10},
                                                               {e, 10, 10, -e},
                                                               {0, -10, 10, 0},
                                                               {0, 10, -10, 0},
                                                               {e, -10, -10, e}}) {
        RasterSpec spec = ramp(17, 8);
        spec.value = [](int column, int row) {
            return (column * 37 + row * 91 + column * row * 5) % 251;
        };
        spec.transform = {1000.0, turn[0], turn[1], 5000.0, turn[2], turn[3]};
        const std::string path = written(spec);
        const OpenedDem dem = open_dem(path);
        const auto surface = SurfaceRaster::open(path).value();
        EXPECT_EQ(dem.info.nodata_share, 0.0);
        for (int row = 0; row < spec.rows; ++row) {
            for (int column = 0; column < spec.columns; ++column) {
                const double x =
                    1000.0 + (column + 0.5) * turn[0] + (row + 0.5) * turn[1] - dem.info.centre_x;
                const double y =
                    5000.0 + (column + 0.5) * turn[2] + (row + 0.5) * turn[3] - dem.info.centre_y;
                ASSERT_NEAR(dem.source->height(x, y), spec.value(column, row), 1e-6);
                ASSERT_EQ(surface->at(x, y).material, spec.value(column, row));
            }
        }
    }
}

TEST_F(DemMeaning, ARefusedSampleOfATurnedRasterIsNamedByItsPlaceInTheFile) {
    RasterSpec spec = ramp(17, 8);
    spec.transform = {1000.0, 0.0, 10.0, 5000.0, 10.0, 0.0};
    spec.value = [](int column, int row) { return column == 12 && row == 5 ? 1e20 : 1.0; };
    const std::string message = refusal(written(spec));
    EXPECT_TRUE(has(message, "column 12, row 5 of the file")) << message;
}

TEST_F(DemMeaning, SeveralSubdatasetsAreNamed) {
    GDALAllRegister();
    const auto add = [&](const char* driver, const std::string& path, const char* table) {
        std::vector<std::string> words{std::string("RASTER_TABLE=") + table};
        if (std::filesystem::exists(path)) words = {words[0], "APPEND_SUBDATASET=YES"};
        if (std::string(driver) == "GTiff") words.erase(words.begin());
        std::vector<char*> options;
        for (std::string& word : words) options.push_back(word.data());
        options.push_back(nullptr);
        GDALDataset* file = GetGDALDriverManager()->GetDriverByName(driver)->Create(
            path.c_str(), 4, 3, 1, GDT_Byte, options.data());
        ASSERT_NE(file, nullptr);
        std::array<double, 6> transform{10.0, 1.0, 0.0, 20.0, 0.0, -1.0};
        file->SetGeoTransform(transform.data());
        file->GetRasterBand(1)->Fill(7.0);
        GDALClose(GDALDataset::ToHandle(file));
    };
    const std::string tif = folder_.file("pages.tif");
    add("GTiff", tif, "");
    add("GTiff", tif, "");
    const OpenedDem dem = open_dem(tif);
    EXPECT_TRUE(has(notes_of(dem), "2 subdatasets") && has(notes_of(dem), "GTIFF_DIR:2:"))
        << notes_of(dem);
    if (GetGDALDriverManager()->GetDriverByName("GPKG") == nullptr)
        GTEST_SKIP() << "GDAL has no GeoPackages";
    const std::string package = folder_.file("two.gpkg");
    add("GPKG", package, "ground");
    add("GPKG", package, "roofs");
    const std::string message = refusal(package);
    EXPECT_TRUE(has(message, "2 subdatasets") && has(message, "GPKG:" + package + ":roofs"))
        << message;
}

}  // namespace meaning_test
}  // namespace terrane::test
