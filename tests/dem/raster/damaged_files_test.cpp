// SPDX-License-Identifier: MIT
// Files with a few bits flipped, bytes changed or the end cut off: opening them ends in a source that
// works, or in one line that names the file. A bound of memory bounds the work, too.
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace terrane::test {
namespace damaged_files_test {

double hill(int column, int row) { return 100.0 + 3.0 * ((column * 7 + row * 13) % 29); }

void write_bytes(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

std::string read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

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
    RasterSpec spec;
    spec.columns = 40;
    spec.rows = 50;
    spec.nodata = -9999.0;
    spec.value = hill;
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
    for (unsigned seed = 1; seed <= static_cast<unsigned>(GetParam().seeds); ++seed) {
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
