// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"
#include "support/random.h"
#include "terrain/source/mesh_bounds.h"

#include <terrane/terrain/check_source.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>

namespace terrane::test {
namespace bounds_test {

using internal::cut_square;
using internal::diamond;
using internal::LatticeTriangle;

/// Brute force: largest deviation of the surface from two triangles, at `resolution` steps along each side.
double deviation(const HeightSource& source, const std::array<LatticeTriangle, 2>& triangles,
                 int resolution) {
    const Lattice& l = source.lattice();
    double largest = 0.0;
    for (const LatticeTriangle& t : triangles) {
        std::array<double, 3> x{}, y{}, z{};
        for (std::size_t i = 0; i < 3; ++i) {
            x[i] = l.x(t[i].x);
            y[i] = l.y(t[i].y);
            z[i] = source.height(x[i], y[i]);
        }
        for (int i = 0; i <= resolution; ++i) {
            for (int j = 0; i + j <= resolution; ++j) {
                const double a = static_cast<double>(i) / resolution;
                const double b = static_cast<double>(j) / resolution;
                const double c = 1.0 - a - b;
                const double on_triangle = a * z[0] + b * z[1] + c * z[2];
                const double truth =
                    source.height(a * x[0] + b * x[1] + c * x[2], a * y[0] + b * y[1] + c * y[2]);
                largest = std::max(largest, std::fabs(truth - on_triangle));
            }
        }
    }
    return largest;
}

bool is_even(std::int64_t index) { return !internal::is_odd(index); }

struct Grid {
    SampleGrid grid;
    std::vector<float> bounds;
    float at(LatticePoint p) const {
        const std::int64_t column = (p.x - grid.corner.x) / grid.step;
        const std::int64_t row = (p.y - grid.corner.y) / grid.step;
        return bounds[static_cast<std::size_t>(row * grid.columns + column)];
    }
};

Grid vertex_grid(const HeightSource& source, LatticePoint corner, std::int64_t step, int points) {
    Grid g{{{corner.x, corner.y}, step, points, points}, {}};
    g.bounds.resize(g.grid.size());
    EXPECT_TRUE(source.vertex_bounds(g.grid, g.bounds).has_value());
    return g;
}

bool is_vertex(LatticePoint p, std::int64_t step) {
    return !is_even(p.x / step) || !is_even(p.y / step);
}

/// Random corners, multiples of `multiple`, over the world and a little beyond it.
class Corners {
public:
    Corners(const HeightSource& source, unsigned seed)
        : lattice_(source.lattice()), random_(seed) {}
    LatticePoint next(std::int64_t multiple) {
        const auto along = [&](std::int64_t low, std::int64_t high) {
            const double t = static_cast<double>(random_() % 100001u) / 1e5 * 1.1 - 0.05;
            const double index = static_cast<double>(low) + t * static_cast<double>(high - low);
            return static_cast<std::int64_t>(std::floor(index / static_cast<double>(multiple))) *
                   multiple;
        };
        return {along(lattice_.west(), lattice_.east()), along(lattice_.south(), lattice_.north())};
    }

private:
    Lattice lattice_;
    std::mt19937 random_;
};

constexpr double kSumRounding = 1e-8;

std::shared_ptr<const HeightSource> open_raster(int columns, int rows, double cell_y,
                                                double spacing,
                                                std::function<double(int, int)> value) {
    RasterSpec spec{.columns = columns, .rows = rows};
    spec.transform[5] = -cell_y;
    spec.value = std::move(value);
    return open_dem(spec, {.finest_spacing = spacing, .detail_seed = {}}).source;
}

/// White noise is the worst case.
std::shared_ptr<const HeightSource> noise(int columns, int rows, double cell_y, double spacing) {
    std::mt19937 random(4);
    return open_raster(columns, rows, cell_y, spacing, [&random](int, int) {
        return static_cast<double>(random() % 10000u) / 100.0;
    });
}

/// Hills of many sizes, smooth from sample to sample.
std::shared_ptr<const HeightSource> hills(int columns, int rows, double cell_y) {
    return open_raster(columns, rows, cell_y, 0.0, [](int c, int r) {
        const double x = c, y = r;
        return 40.0 * std::sin(0.071 * x + 0.3) * std::cos(0.053 * y) +
               17.0 * std::sin(0.19 * x - 0.23 * y) + 9.0 * std::cos(0.31 * x + 0.11 * y);
    });
}

/// Counts the cells whose bound is more than 1.15 times what dense sampling finds.
void expect_cell_bounds_tight(const HeightSource& source, unsigned seed, std::int64_t step) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", step " + std::to_string(step));
    Corners corners(source, seed);
    int cells = 0, loose = 0;
    double bound_sum = 0.0, truth_sum = 0.0;
    for (int k = 0; k < 6; ++k) {
        const LatticePoint corner = corners.next(2 * step);
        const SampleGrid grid{{corner.x, corner.y}, step, 9, 9};
        std::vector<float> bounds(64);
        ASSERT_TRUE(source.cell_bounds(grid, bounds).has_value());
        for (int i = 0; i < 64; ++i) {
            const LatticePoint sw{corner.x + (i % 8) * step, corner.y + (i / 8) * step};
            const double truth = deviation(source, cut_square(sw, step), 16);
            const double bound = static_cast<double>(bounds[static_cast<std::size_t>(i)]);
            ASSERT_LE(truth, bound + kSumRounding) << sw.x << ", " << sw.y;
            if (truth < 1e-3) continue;
            ++cells;
            if (bound > 1.15 * truth) ++loose;
            bound_sum += bound;
            truth_sum += truth;
        }
    }
    EXPECT_GT(cells, 100);
    EXPECT_LE(loose, cells / 10) << "of " << cells;
    EXPECT_LE(bound_sum, 1.06 * truth_sum);
}

TEST(DemBoundsOffTheLattice, AreTheGreatestDeviationNotASumOfKinks) {
    // Cells of 10 m by 14 m under a lattice of 9.97 m: every cell holds lines between raster cells.
    const auto source = noise(150, 120, 14.0, 0.0);
    for (const std::int64_t step : {1, 2, 4, 8}) expect_cell_bounds_tight(*source, 41, step);
}

/// Bounds of the vertices and cells over the raster equal the densely sampled deviation, or a child's bound.
///
/// @param points  sampled along the sides of triangles for each spacing of the step
/// @param slack   error of dense sampling
void expect_coarse_bounds_tight(const HeightSource& source, std::int64_t step, int points,
                                double slack) {
    SCOPED_TRACE("step " + std::to_string(step));
    const Lattice& lattice = source.lattice();
    const int resolution = points * static_cast<int>(step);
    const auto is_ground = [&](LatticePoint sw, std::int64_t side) {
        return source.extent().contains(lattice.x(sw.x - step), lattice.y(sw.y - step)) &&
               source.extent().contains(lattice.x(sw.x + side + step),
                                        lattice.y(sw.y + side + step));
    };
    const auto expect_tight = [&](const std::array<LatticeTriangle, 2>& triangles, float certified,
                                  float of_children, LatticePoint at, const char* what) {
        const double truth = deviation(source, triangles, resolution);
        const double bound = static_cast<double>(certified);
        ASSERT_LE(truth, bound + kSumRounding) << what << " " << at.x << ", " << at.y;
        const double least = std::max(truth, static_cast<double>(of_children));
        ASSERT_LE(bound, slack * least + 1e-6) << what << " " << at.x << ", " << at.y;
    };
    const int count = static_cast<int>((lattice.east() - lattice.west()) / (2 * step)) * 2 + 1;
    const Grid g = vertex_grid(source, {lattice.west(), lattice.south()}, step, count);
    const Grid fine =
        vertex_grid(source, {lattice.west(), lattice.south()}, step / 2, 2 * count - 1);
    std::vector<float> cells(static_cast<std::size_t>((count - 1) * (count - 1)));
    ASSERT_TRUE(source.cell_bounds(g.grid, cells).has_value());
    int checked = 0;
    for (int row = 1; row + 1 < count; ++row) {
        for (int column = 1; column + 1 < count; ++column) {
            const LatticePoint v{lattice.west() + column * step, lattice.south() + row * step};
            if (!is_ground({v.x - step, v.y - step}, 2 * step)) continue;
            ++checked;
            const auto cell = static_cast<std::size_t>(row * (count - 1) + column);
            expect_tight(cut_square(v, step), cells[cell], 0.0f, v, "cell");
            if (testing::Test::HasFatalFailure()) return;
            if (!is_vertex(v, step)) continue;
            const bool is_centre = !is_even(row) && !is_even(column);
            const std::int64_t reach = is_centre ? step : step / 2;
            float of_children = 0.0f;
            for (const int k : {-1, 1}) {
                for (const int l : {-1, 1}) {
                    const LatticePoint child =
                        is_centre
                            ? LatticePoint{v.x + (k + l) / 2 * reach, v.y + (k - l) / 2 * reach}
                            : LatticePoint{v.x + k * reach, v.y + l * reach};
                    of_children = std::max(of_children, is_centre ? g.at(child) : fine.at(child));
                }
            }
            expect_tight(diamond(v, step), g.at(v), of_children, v, "vertex");
            if (testing::Test::HasFatalFailure()) return;
        }
    }
    EXPECT_GT(checked, 3);
}

TEST(DemBoundsOfCoarseSpacings, AreTheGreatestDeviationWhereSamplesAreLatticePoints) {
    const auto source = noise(520, 460, 10.0, 0.0);
    // Every sample is tested; only a bow on the longest side may be missed.
    for (const std::int64_t step : {8, 16, 32, 64}) {
        expect_coarse_bounds_tight(*source, step, 2, 1.005);
    }
}

TEST(DemBoundsOfCoarseSpacings, AreNearlyTheGreatestDeviationOffTheLattice) {
    const auto source = hills(300, 200, 14.0);
    for (const std::int64_t step : {8, 16, 32}) {
        expect_coarse_bounds_tight(*source, step, 6, 1.02);
    }
}

TEST(DemBoundsBelowTheRaster, AreNearTheGreatestDeviationOffTheLattice) {
    // Base spacing 8 m under cells of 10 m by 14 m. A sum for every kink nearby is 2 to 10 times as
    // much.
    const auto source = open_raster(90, 70, 14.0, 1.0, [](int c, int r) {
        return 20.0 * std::sin(0.9 * c) * std::cos(1.1 * r) + 0.01 * ((c * 31 + r * 17) % 97);
    });
    Corners corners(*source, 51);
    for (const std::int64_t step : {1, 2, 4, 8}) {
        SCOPED_TRACE("step " + std::to_string(step));
        double bound_sum = 0.0, truth_sum = 0.0;
        for (int k = 0; k < 12; ++k) {
            const LatticePoint corner = corners.next(2 * step);
            const Grid g = vertex_grid(*source, corner, step, 9);
            for (int i = 0; i < 81; ++i) {
                const LatticePoint v{corner.x + i % 9 * step, corner.y + i / 9 * step};
                if (!is_vertex(v, step)) continue;
                const double bound = static_cast<double>(g.at(v));
                const double truth = deviation(*source, diamond(v, step), 16);
                ASSERT_LE(truth, bound + kSumRounding) << v.x << ", " << v.y;
                truth_sum += truth;
                bound_sum += bound;
            }
        }
        EXPECT_LE(bound_sum, 1.5 * truth_sum) << bound_sum / truth_sum;
    }
}

TEST(DemBoundsOfCoarseSpacings, AreThereForSquaresLargerThanTheWorld) {
    const auto source = hills(100, 90, 10.0);
    const std::int64_t root = source->lattice().chunk_side(0);
    for (const std::int64_t step : {root, 2 * root, 8 * root}) {
        const Grid g = vertex_grid(*source, {0, 0}, step, 3);
        std::vector<float> cells(4);
        ASSERT_TRUE(source->cell_bounds(g.grid, cells).has_value());
        EXPECT_LE(deviation(*source, diamond({step, step}, step), 200),
                  static_cast<double>(g.at({step, step})));
        EXPECT_LE(deviation(*source, cut_square({0, 0}, step), 200),
                  static_cast<double>(cells.front()));
        EXPECT_EQ(g.at({0, 0}), 0.0f);
    }
}

TEST(DemBoundsOfMeshes, AreThoseOfVerticesAndOfCellsInAnyPartOfAGrid) {
    long compared = 0;
    for (const double cell_y : {10.0, 12.5}) {
        for (const double finest_spacing : {0.0, 2.5}) {
            std::mt19937 random(5);
            RasterSpec spec{.columns = 90, .rows = 70};
            spec.transform[5] = -cell_y;
            spec.value = [&](int, int) { return 30.0 * random_unit(random); };
            DemSettings settings;
            settings.finest_spacing = finest_spacing;
            const auto source = open_dem(spec, settings).source;
            for (std::int64_t step = 1; step <= 16; step *= 2) {
                const SampleGrid grid{{2 * step, 4 * step}, step, 39, 71};
                std::vector<float> vertices(grid.size()), cells(std::size_t{38} * 70);
                ASSERT_TRUE(source->mesh_bounds(grid, vertices, cells).has_value());
                // Of a part that begins and ends elsewhere.
                const int west = 6, south = 34, columns = 9, rows = 35;
                const SampleGrid part{{grid.corner.x + west * step, grid.corner.y + south * step},
                                      step,
                                      columns,
                                      rows};
                std::vector<float> of_vertices(part.size()), of_cells(std::size_t{8} * 34);
                ASSERT_TRUE(source->vertex_bounds(part, of_vertices).has_value());
                ASSERT_TRUE(source->cell_bounds(part, of_cells).has_value());
                for (int row = 0; row + 1 < rows; ++row) {
                    for (int column = 0; column + 1 < columns; ++column, ++compared) {
                        const auto in = [&](int width, int from_west, int from_south) {
                            return static_cast<std::size_t>((row + from_south) * width + column +
                                                            from_west);
                        };
                        EXPECT_EQ(of_vertices[in(columns, 0, 0)], vertices[in(39, west, south)]);
                        EXPECT_EQ(of_cells[in(columns - 1, 0, 0)], cells[in(38, west, south)]);
                    }
                }
            }
        }
    }
    EXPECT_EQ(compared, 4 * 5 * 34 * 8);
}

TEST(DemBoundsOfPlanes, AreNothing) {
    RasterSpec spec{.columns = 100, .rows = 70, .value = [](int, int) { return 42.5; }};
    const auto source = open_dem(spec).source;
    for (std::int64_t step = 1; step <= source->lattice().chunk_side(0) / 2; step *= 2) {
        const Grid g = vertex_grid(*source, {0, 0}, step, 9);
        EXPECT_EQ(*std::max_element(g.bounds.begin(), g.bounds.end()), 0.0f);
    }
}

}  // namespace bounds_test

namespace check_source_test {

void expect_clean(const HeightSource& source, bool has_detail) {
    const SourceCheckSettings settings{
        .seed = 9, .places = 8, .nesting_slack = has_detail ? 1.5 : 1.0};
    const auto report = check_source(source, settings);
    ASSERT_TRUE(report.has_value()) << report.error().message;
    EXPECT_TRUE(report->is_clean()) << to_text(*report);
    EXPECT_GT(report->tightest, has_detail ? 0.1 : 0.5);
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
    expect_clean(*open_dem(path).source, false);
    expect_clean(*open_dem(path, {.finest_spacing = 2.0, .detail_seed = 4}).source, true);
    if (few_or_many(0, 1) == 0) return;
    expect_clean(*open_dem(path, {.finest_spacing = 2.0, .detail_seed = {}}).source, false);
}

/// White noise is the worst case.
TEST(CheckDem, FindsNothingWrongWithNoiseOnAnyShapeOfCells) {
    struct Shape {
        int columns, rows;
        double cell_y, spacing;
        std::optional<std::uint64_t> detail_seed = {};
    };
    for (const Shape& shape :
         {Shape{150, 90, 10.0, 0.0}, Shape{150, 90, 10.0, 1.3}, Shape{80, 200, 14.0, 0.0},
          Shape{80, 200, 14.0, 2.0}, Shape{90, 90, 3.7, 0.9}, Shape{2, 2, 10.0, 0.1},
          Shape{3, 40, 11.0, 0.5}, Shape{96, 64, 10.0, 0.5, 5}}) {
        SCOPED_TRACE(testing::Message()
                     << shape.columns << " x " << shape.rows << " at " << shape.spacing << " m");
        std::mt19937 random(5);
        RasterSpec spec{.columns = shape.columns, .rows = shape.rows};
        spec.transform[5] = -shape.cell_y;
        spec.value = [&random](int, int) { return static_cast<double>(random() % 10000u) / 100.0; };
        const DemSettings settings{.finest_spacing = shape.spacing,
                                   .detail_seed = shape.detail_seed};
        expect_clean(*open_dem(spec, settings).source, shape.detail_seed.has_value());
    }
}

}  // namespace check_source_test
}  // namespace terrane::test
