// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terrane::test {
namespace detail_test {

RasterSpec hills() {
    RasterSpec spec;
    spec.columns = 96;
    spec.rows = 64;
    // Rough in the west, a plane in the east.
    spec.value = [](int column, int row) {
        const double plane = 200.0 + 2.0 * column;
        return column < 48 ? plane + (column * 37 + row * 91) % 13 : plane;
    };
    return spec;
}

struct Pair {
    std::shared_ptr<const HeightSource> bare, detailed;
    DemInfo info;
};

Pair open_pair(const RasterSpec& spec, double roughness) {
    const TemporaryFolder folder;
    const std::string path = folder.file("detail.tif");
    write_raster(path, spec);
    DemSettings settings;
    settings.finest_spacing = 0.5;
    Pair pair;
    pair.bare = DemHeights::open(path, settings, &pair.info).value_or(nullptr);
    settings.detail_seed = 5;
    settings.detail_roughness = roughness;
    pair.detailed = DemHeights::open(path, settings).value_or(nullptr);
    return pair;
}

TEST(DemDetail, SamplesKeepTheirHeights) {
    const Pair pair = open_pair(hills(), 1.0);
    ASSERT_TRUE(pair.bare && pair.detailed);
    for (int row = 0; row < 64; ++row) {
        for (int column = 0; column < 96; ++column) {
            const double x = sample_x(pair.info, column), y = sample_y(pair.info, row);
            ASSERT_NEAR(pair.detailed->height(x, y), pair.bare->height(x, y), 1e-3);
        }
    }
}

/// Mean distance between the two surfaces over a range of columns.
double mean_detail(const Pair& pair, int west, int east) {
    double sum = 0.0;
    int count = 0;
    for (int row = 8; row < 56; ++row) {
        for (int column = west; column < east; ++column) {
            const double x = sample_x(pair.info, column) + 3.1, y = sample_y(pair.info, row) + 4.3;
            sum += std::fabs(pair.detailed->height(x, y) - pair.bare->height(x, y));
            ++count;
        }
    }
    return sum / count;
}

TEST(DemDetail, FollowsTheRoughnessAround) {
    const Pair pair = open_pair(hills(), 1.0);
    ASSERT_TRUE(pair.bare && pair.detailed);
    EXPECT_GT(mean_detail(pair, 8, 40), 0.1);
    EXPECT_LT(mean_detail(pair, 70, 90), 1e-6);
}

TEST(DemDetail, GrowsWithTheRoughnessThatIsSet) {
    const Pair one = open_pair(hills(), 1.0), two = open_pair(hills(), 2.0);
    ASSERT_TRUE(one.bare && one.detailed && two.bare && two.detailed);
    EXPECT_NEAR(mean_detail(two, 8, 40), 2.0 * mean_detail(one, 8, 40), 1e-3);
    const Pair none = open_pair(hills(), 0.0);
    ASSERT_TRUE(none.bare && none.detailed);
    EXPECT_EQ(mean_detail(none, 8, 40), 0.0);
}

TEST(DemDetail, BoundsHoldTheDetail) {
    const Pair pair = open_pair(hills(), 1.0);
    ASSERT_TRUE(pair.bare && pair.detailed);
    const HeightSource& source = *pair.detailed;
    const Lattice& l = source.lattice();
    for (std::int64_t step = 1; step <= l.step(0); step *= 2) {
        const SampleGrid grid{
            {(l.east() / 4) & -(2 * step), (l.north() / 2) & -(2 * step)}, step, 9, 9};
        std::vector<float> bounds(64);
        ASSERT_TRUE(source.cell_bounds(grid, bounds).has_value());
        for (int i = 0; i < 64; ++i) {
            const std::int64_t ix = grid.corner.x + (i % 8) * step;
            const std::int64_t iy = grid.corner.y + (i / 8) * step;
            const double side = l.spacing * static_cast<double>(step);
            const double x = l.x(ix), y = l.y(iy);
            const double sw = source.height(x, y), se = source.height(x + side, y);
            const double nw = source.height(x, y + side), ne = source.height(x + side, y + side);
            const bool to_north_east = ((ix / step + iy / step) & 1) == 0;
            for (int k = 0; k < 169; ++k) {
                const double u = (k % 13) / 12.0, v = (k / 13) / 12.0;
                double on_triangle = 0.0;
                if (to_north_east) {
                    on_triangle = u >= v ? sw + u * (se - sw) + v * (ne - se)
                                         : sw + v * (nw - sw) + u * (ne - nw);
                } else {
                    on_triangle = u + v <= 1.0 ? sw + u * (se - sw) + v * (nw - sw)
                                               : ne + (1.0 - u) * (nw - ne) + (1.0 - v) * (se - ne);
                }
                ASSERT_LE(std::fabs(source.height(x + u * side, y + v * side) - on_triangle),
                          static_cast<double>(bounds[static_cast<std::size_t>(i)]) + 1e-8)
                    << "step " << step;
            }
        }
    }
}

}  // namespace detail_test
}  // namespace terrane::test
