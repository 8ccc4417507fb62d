// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"
#include "dem_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

namespace terrane::test {
namespace window_read_test {

using internal::DemSource;
using internal::StoreSettings;

/// Nothing in memory, and a cache of four squares.
constexpr StoreSettings kByWindow{0, 0};

/// Two sources answer everything with the same bits.
void expect_same(const HeightSource& a, const HeightSource& b) {
    ASSERT_EQ(a.lattice(), b.lattice());
    const Lattice& l = a.lattice();
    std::mt19937 random(11);
    for (int level = 0; level <= l.finest_level; ++level) {
        const std::int64_t step = l.step(level);
        const std::int64_t units = (l.east() - l.west()) / (2 * step);
        const auto somewhere = [&](std::int64_t low) {
            return low +
                   2 * step * static_cast<std::int64_t>(random() % static_cast<unsigned>(units));
        };
        const SampleGrid grid{{somewhere(l.west()), somewhere(l.south())}, step, 33, 21};
        std::vector<double> z_a(grid.size()), z_b(grid.size());
        std::vector<float> v_a(grid.size()), v_b(grid.size()), c_a(32 * 20), c_b(32 * 20);
        std::vector<std::uint8_t> f_a(32 * 20), f_b(32 * 20);
        ASSERT_TRUE(a.sample(grid, z_a) && b.sample(grid, z_b));
        ASSERT_TRUE(a.vertex_bounds(grid, v_a) && b.vertex_bounds(grid, v_b));
        ASSERT_TRUE(a.cell_bounds(grid, c_a) && b.cell_bounds(grid, c_b));
        ASSERT_TRUE(a.cell_flags(grid, f_a) && b.cell_flags(grid, f_b));
        EXPECT_EQ(z_a, z_b) << "level " << level;
        EXPECT_EQ(v_a, v_b) << "level " << level;
        EXPECT_EQ(c_a, c_b) << "level " << level;
        EXPECT_EQ(f_a, f_b) << "level " << level;
    }
    for (int i = 0; i < 200; ++i) {
        const WorldRect& e = a.extent();
        const double x = e.west + random_unit(random) * (e.east - e.west);
        const double y = e.south + random_unit(random) * (e.north - e.south);
        EXPECT_EQ(a.height(x, y), b.height(x, y));
    }
    EXPECT_EQ(a.rise_bound(123.0), b.rise_bound(123.0));
    EXPECT_EQ(a.interval(a.extent()).high, b.interval(b.extent()).high);
}

TEST(DemWindowRead, AnswersAreThoseOfTheRasterInMemory) {
    RasterSpec spec;
    spec.columns = 700;
    spec.rows = 530;
    // Rough ground with a frame, voids, and a large one.
    spec.value = [](int column, int row) {
        if (column + row < 90 || (column * 7 + row * 13) % 1009 == 0) return std::nan("");
        if (std::abs(column - 400) < 60 && std::abs(row - 300) < 70) return std::nan("");
        return 300.0 + 40.0 * std::sin(column * 0.05) * std::cos(row * 0.07) +
               (column * 31 + row * 57) % 17;
    };
    for (const double cell_y : {10.0, 13.0}) {
        spec.transform[5] = -cell_y;
        // Floats are held as they are, doubles are packed: fills too.
        spec.type = cell_y == 10.0 ? GDT_Float32 : GDT_Float64;
        const TemporaryFolder folder;
        const std::string path = folder.file("window.tif");
        write_raster(path, spec);
        const auto in_memory = DemSource::create(path, 2.0, {});
        const auto by_window = DemSource::create(path, 2.0, kByWindow);
        ASSERT_TRUE(in_memory.has_value() && by_window.has_value());
        ASSERT_TRUE((*in_memory)->store().in_memory());
        ASSERT_FALSE((*by_window)->store().in_memory());
        expect_same(**in_memory, **by_window);
    }
}

TEST(DemWindowRead, ThreadsReadTheSameHeights) {
    RasterSpec spec;
    spec.columns = 900;
    spec.rows = 900;
    spec.value = [](int column, int row) { return (column * 37 + row * 91) % 251; };
    const TemporaryFolder folder;
    const std::string path = folder.file("threads.tif");
    write_raster(path, spec);
    const auto opened = DemSource::create(path, 0.0, kByWindow);
    ASSERT_TRUE(opened.has_value());
    const DemSource& source = **opened;
    std::array<int, 4> wrong{};
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 0; t < wrong.size(); ++t) {
            threads.emplace_back([&, t] {
                std::mt19937 random(static_cast<unsigned>(t));
                for (int i = 0; i < 2000; ++i) {
                    const int column = static_cast<int>(random() % 900u);
                    const int row = static_cast<int>(random() % 900u);
                    const double z = source.height(sample_x(source.info(), column),
                                                   sample_y(source.info(), row));
                    if (std::fabs(z - (column * 37 + row * 91) % 251) > 1e-6) ++wrong[t];
                }
            });
        }
    }
    for (const int count : wrong) EXPECT_EQ(count, 0);
}

}  // namespace window_read_test
}  // namespace terrane::test
