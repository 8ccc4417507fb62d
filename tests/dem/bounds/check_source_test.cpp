// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <terrane/terrain/check_source.h>

#include <gtest/gtest.h>

namespace terrane::test {
namespace check_source_test {

void expect_clean(const std::string& path, double finest_spacing,
                  std::optional<std::uint64_t> detail_seed) {
    DemSettings settings;
    settings.finest_spacing = finest_spacing;
    settings.detail_seed = detail_seed;
    const auto source = DemHeights::open(path, settings);
    ASSERT_TRUE(source.has_value()) << source.error().message;
    const auto report = check_source(**source, {.seed = 9, .places = 8});
    ASSERT_TRUE(report.has_value()) << report.error().message;
    EXPECT_TRUE(report->is_clean()) << to_text(*report);
    EXPECT_GT(report->tightest, settings.detail_seed ? 0.1 : 0.5);
}

class CheckDem : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(RealRasters, CheckDem,
                         testing::Values("sthelens_10m.vrt", "tyrol_avaWog_5m_nodata.tif",
                                         "srtm3_N41E012_rome_1201.tif",
                                         "srtm3_rainier_1201_voids.tif",
                                         "usgs3dep_maroon_38m.tif"));

TEST_P(CheckDem, FindsNothingWrong) {
    const std::string path = real_data(GetParam());
    if (path.empty()) GTEST_SKIP() << GetParam() << " is not here";
    expect_clean(path, 0.0, std::nullopt);
    expect_clean(path, 2.0, std::nullopt);
    expect_clean(path, 2.0, 4);
}

TEST(CheckDem, FindsNothingWrongWithNoiseOnAnyShapeOfCells) {
    for (const double cell_y : {10.0, 3.7, 14.0}) {
        std::mt19937 random(5);
        RasterSpec spec;
        spec.columns = 90;
        spec.rows = 70;
        spec.transform[5] = -cell_y;
        spec.value = [&random](int, int) { return static_cast<double>(random() % 10000u) / 100.0; };
        const TemporaryFolder folder;
        write_raster(folder.file("noise.tif"), spec);
        expect_clean(folder.file("noise.tif"), 1.3, std::nullopt);
    }
}

}  // namespace check_source_test
}  // namespace terrane::test
