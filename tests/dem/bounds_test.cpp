// SPDX-License-Identifier: MIT
#include "dem/raster_files.h"

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

struct Point {
    std::int64_t x, y;
};
using Triangle = std::array<Point, 3>;

/// Brute force: largest deviation of the surface from a triangle, at `resolution` steps along each side.
double deviation(const HeightSource& source, const Triangle& t, int resolution) {
    const Lattice& l = source.lattice();
    std::array<double, 3> x{}, y{}, z{};
    for (std::size_t i = 0; i < 3; ++i) {
        x[i] = l.x(t[i].x);
        y[i] = l.y(t[i].y);
        z[i] = source.height(x[i], y[i]);
    }
    double largest = 0.0;
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
    return largest;
}

bool is_even(std::int64_t index) { return (index & 1) == 0; }

/// The two triangles of the square of side `side` with a south-western corner.
std::array<Triangle, 2> square_triangles(Point sw, std::int64_t side) {
    const Point se{sw.x + side, sw.y}, nw{sw.x, sw.y + side}, ne{sw.x + side, sw.y + side};
    if (is_even(sw.x / side + sw.y / side)) return {{{sw, se, ne}, {sw, ne, nw}}};
    return {{{sw, se, nw}, {se, ne, nw}}};
}

/// The two triangles of the diamond of a vertex of spacing s.
std::array<Triangle, 2> diamond(Point v, std::int64_t s) {
    const bool odd_x = !is_even(v.x / s), odd_y = !is_even(v.y / s);
    const Point w{v.x - s, v.y}, e{v.x + s, v.y}, n{v.x, v.y + s}, d{v.x, v.y - s};
    if (odd_x && odd_y) return square_triangles({v.x - s, v.y - s}, 2 * s);
    if (odd_x) return {{{w, e, n}, {w, e, d}}};
    return {{{d, n, e}, {d, n, w}}};
}

struct Grid {
    SampleGrid grid;
    std::vector<float> bounds;
    float at(Point p) const {
        const std::int64_t column = (p.x - grid.corner.x) / grid.step;
        const std::int64_t row = (p.y - grid.corner.y) / grid.step;
        return bounds[static_cast<std::size_t>(row * grid.columns + column)];
    }
};

Grid vertex_grid(const HeightSource& source, Point corner, std::int64_t step, int points) {
    Grid g{{{corner.x, corner.y}, step, points, points}, {}};
    g.bounds.resize(g.grid.size());
    EXPECT_TRUE(source.vertex_bounds(g.grid, g.bounds).has_value());
    return g;
}

bool is_vertex(Point p, std::int64_t step) { return !is_even(p.x / step) || !is_even(p.y / step); }

/// Random corners, multiples of `multiple`, over the world and a little beyond it.
class Corners {
public:
    Corners(const HeightSource& source, unsigned seed)
        : lattice_(source.lattice()), random_(seed) {}
    Point next(std::int64_t multiple) {
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

/// All steps that chunks and roots use.
std::vector<std::int64_t> steps_of(const HeightSource& source) {
    std::vector<std::int64_t> steps;
    for (std::int64_t s = 1; s <= source.lattice().chunk_side(0) / 2; s *= 2) steps.push_back(s);
    return steps;
}

constexpr double kSumRounding = 1e-8;

void expect_bounds_hold(const HeightSource& source, unsigned seed, int grids) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Corners corners(source, seed);
    for (const std::int64_t step : steps_of(source)) {
        for (int k = 0; k < grids; ++k) {
            const Point corner = corners.next(2 * step);
            const Grid g = vertex_grid(source, corner, step, 7);
            std::vector<float> cells(36);
            ASSERT_TRUE(source.cell_bounds(g.grid, cells).has_value());
            for (int i = 0; i < 49; ++i) {
                const Point v{corner.x + (i % 7) * step, corner.y + (i / 7) * step};
                if (!is_vertex(v, step)) {
                    ASSERT_EQ(g.at(v), 0.0f);
                    continue;
                }
                for (const Triangle& t : diamond(v, step)) {
                    ASSERT_LE(deviation(source, t, 12), static_cast<double>(g.at(v)) + kSumRounding)
                        << "vertex " << v.x << ", " << v.y << " of spacing " << step;
                }
            }
            for (int i = 0; i < 36; ++i) {
                const Point sw{corner.x + (i % 6) * step, corner.y + (i / 6) * step};
                for (const Triangle& t : square_triangles(sw, step)) {
                    ASSERT_LE(
                        deviation(source, t, 12),
                        static_cast<double>(cells[static_cast<std::size_t>(i)]) + kSumRounding)
                        << "cell " << sw.x << ", " << sw.y << " of side " << step;
                }
            }
        }
    }
}

void expect_bounds_nested(const HeightSource& source, unsigned seed, int grids) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Corners corners(source, seed);
    for (const std::int64_t step : steps_of(source)) {
        for (int k = 0; k < grids; ++k) {
            const Point corner = corners.next(2 * step);
            const int points = 17;
            const Grid g = vertex_grid(source, corner, step, points);
            // Centres against the midpoints on their edges.
            for (int row = 1; row < points; row += 2) {
                for (int column = 1; column < points; column += 2) {
                    const Point v{corner.x + column * step, corner.y + row * step};
                    for (const Point child : {Point{v.x - step, v.y}, Point{v.x + step, v.y},
                                              Point{v.x, v.y - step}, Point{v.x, v.y + step}}) {
                        ASSERT_GE(g.at(v), g.at(child)) << v.x << ", " << v.y << " of " << step;
                    }
                }
            }
            if (step == 1) continue;
            // Midpoints against the centres of half the spacing around them.
            const std::int64_t half = step / 2;
            const Grid fine = vertex_grid(source, corner, half, 2 * points - 1);
            for (int row = 1; row + 1 < points; ++row) {
                for (int column = 1; column + 1 < points; ++column) {
                    if (is_even(row) == is_even(column)) continue;
                    const Point v{corner.x + column * step, corner.y + row * step};
                    for (const Point child :
                         {Point{v.x - half, v.y - half}, Point{v.x + half, v.y - half},
                          Point{v.x - half, v.y + half}, Point{v.x + half, v.y + half}}) {
                        ASSERT_GE(g.at(v), fine.at(child)) << v.x << ", " << v.y << " of " << step;
                    }
                }
            }
        }
    }
}

void expect_grids_agree(const HeightSource& source, unsigned seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Corners corners(source, seed);
    for (const std::int64_t step : steps_of(source)) {
        const Point corner = corners.next(2 * step);
        const Grid large = vertex_grid(source, corner, step, 21);
        const Point inner{corner.x + 6 * step, corner.y + 4 * step};
        const Grid small = vertex_grid(source, inner, step, 9);
        for (int i = 0; i < 81; ++i) {
            const Point v{inner.x + (i % 9) * step, inner.y + (i / 9) * step};
            ASSERT_EQ(large.at(v), small.at(v)) << v.x << ", " << v.y << " of " << step;
        }
        std::vector<double> heights(large.grid.size());
        ASSERT_TRUE(source.sample(large.grid, heights).has_value());
        for (std::size_t i = 0; i < heights.size(); i += 5) {
            const std::int64_t x = corner.x + static_cast<std::int64_t>(i % 21) * step;
            const std::int64_t y = corner.y + static_cast<std::int64_t>(i / 21) * step;
            ASSERT_NEAR(heights[i], source.height(source.lattice().x(x), source.lattice().y(y)),
                        1e-9);
            double alone = 0.0;
            ASSERT_TRUE(source.sample({{x, y}, 1, 1, 1}, {&alone, 1}).has_value());
            ASSERT_EQ(heights[i], alone);
        }
    }
}

struct Case {
    const char* name;
    double finest_spacing;
};

void PrintTo(const Case& tested, std::ostream* out) {
    *out << tested.name << " at " << tested.finest_spacing << " m";
}

class DemBounds : public testing::TestWithParam<Case> {
protected:
    void SetUp() override {
        const std::string path = real_data(GetParam().name);
        if (path.empty()) GTEST_SKIP() << GetParam().name << " is not here";
        DemSettings settings{.finest_spacing = GetParam().finest_spacing, .detail_seed = {}};
        const auto opened = DemHeights::open(path, settings);
        ASSERT_TRUE(opened.has_value()) << opened.error().message;
        source_ = *opened;
    }
    std::shared_ptr<const HeightSource> source_;
};

TEST_P(DemBounds, HoldAgainstDenseSampling) { expect_bounds_hold(*source_, 21, 6); }
TEST_P(DemBounds, AreNestedFromLevelToLevel) { expect_bounds_nested(*source_, 22, 6); }
TEST_P(DemBounds, AreTheSameInEveryGrid) { expect_grids_agree(*source_, 23); }

INSTANTIATE_TEST_SUITE_P(RealRasters, DemBounds,
                         testing::Values(Case{"sthelens_10m.vrt", 0.0},
                                         Case{"sthelens_10m.vrt", 1.0},
                                         Case{"tyrol_avaWog_5m_nodata.tif", 2.0},
                                         Case{"srtm3_N41E012_rome_1201.tif", 0.0},
                                         Case{"srtm3_N41E012_rome_1201.tif", 5.0},
                                         Case{"usgs3dep_maroon_38m.tif", 0.0}));

std::shared_ptr<const HeightSource> open_raster(int columns, int rows, double cell_y,
                                                double spacing,
                                                std::function<double(int, int)> value) {
    RasterSpec spec{.columns = columns, .rows = rows};
    spec.transform[5] = -cell_y;
    spec.value = std::move(value);
    const TemporaryFolder folder;
    const std::string path = folder.file("raster.tif");
    write_raster(path, spec);
    const auto source =
        DemHeights::open(path, DemSettings{.finest_spacing = spacing, .detail_seed = {}});
    EXPECT_TRUE(source.has_value());
    return source ? *source : nullptr;
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

TEST(DemBoundsOfNoise, HoldAndAreNestedForAnyShapeOfCells) {
    struct Shape {
        int columns, rows;
        double cell_y, spacing;
    };
    for (const Shape& shape :
         {Shape{150, 90, 10.0, 0.0}, Shape{150, 90, 10.0, 1.3}, Shape{80, 200, 14.0, 0.0},
          Shape{80, 200, 14.0, 2.0}, Shape{90, 90, 3.7, 0.9}, Shape{2, 2, 10.0, 0.1},
          Shape{3, 40, 11.0, 0.5}}) {
        const auto source = noise(shape.columns, shape.rows, shape.cell_y, shape.spacing);
        ASSERT_NE(source, nullptr);
        SCOPED_TRACE(std::to_string(shape.columns) + " x " + std::to_string(shape.rows));
        expect_bounds_hold(*source, 31, 8);
        expect_bounds_nested(*source, 32, 8);
        expect_grids_agree(*source, 33);
    }
}

/// Counts the cells whose bound is more than 1.15 times what dense sampling finds.
void expect_cell_bounds_tight(const HeightSource& source, unsigned seed, std::int64_t step) {
    SCOPED_TRACE("seed " + std::to_string(seed) + ", step " + std::to_string(step));
    Corners corners(source, seed);
    int cells = 0, loose = 0;
    double bound_sum = 0.0, truth_sum = 0.0;
    for (int k = 0; k < 6; ++k) {
        const Point corner = corners.next(2 * step);
        const SampleGrid grid{{corner.x, corner.y}, step, 9, 9};
        std::vector<float> bounds(64);
        ASSERT_TRUE(source.cell_bounds(grid, bounds).has_value());
        for (int i = 0; i < 64; ++i) {
            const Point sw{corner.x + (i % 8) * step, corner.y + (i / 8) * step};
            const auto triangles = square_triangles(sw, step);
            const double truth =
                std::max(deviation(source, triangles[0], 16), deviation(source, triangles[1], 16));
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
    ASSERT_NE(source, nullptr);
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
    const auto is_ground = [&](Point sw, std::int64_t side) {
        return source.extent().contains(lattice.x(sw.x - step), lattice.y(sw.y - step)) &&
               source.extent().contains(lattice.x(sw.x + side + step),
                                        lattice.y(sw.y + side + step));
    };
    const auto expect_tight = [&](const std::array<Triangle, 2>& triangles, float certified,
                                  float of_children, Point at, const char* what) {
        const double truth = std::max(deviation(source, triangles[0], resolution),
                                      deviation(source, triangles[1], resolution));
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
            const Point v{lattice.west() + column * step, lattice.south() + row * step};
            if (!is_ground({v.x - step, v.y - step}, 2 * step)) continue;
            ++checked;
            const auto cell = static_cast<std::size_t>(row * (count - 1) + column);
            expect_tight(square_triangles(v, step), cells[cell], 0.0f, v, "cell");
            if (testing::Test::HasFatalFailure()) return;
            if (!is_vertex(v, step)) continue;
            const bool is_centre = !is_even(row) && !is_even(column);
            const std::int64_t reach = is_centre ? step : step / 2;
            float of_children = 0.0f;
            for (const int k : {-1, 1}) {
                for (const int l : {-1, 1}) {
                    const Point child =
                        is_centre ? Point{v.x + (k + l) / 2 * reach, v.y + (k - l) / 2 * reach}
                                  : Point{v.x + k * reach, v.y + l * reach};
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
    ASSERT_NE(source, nullptr);
    // Every sample is tested; only a bow on the longest side may be missed.
    for (const std::int64_t step : {8, 16, 32, 64}) {
        expect_coarse_bounds_tight(*source, step, 2, 1.005);
    }
}

TEST(DemBoundsOfCoarseSpacings, AreNearlyTheGreatestDeviationOffTheLattice) {
    const auto source = hills(300, 200, 14.0);
    ASSERT_NE(source, nullptr);
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
    ASSERT_NE(source, nullptr);
    Corners corners(*source, 51);
    for (const std::int64_t step : {1, 2, 4, 8}) {
        SCOPED_TRACE("step " + std::to_string(step));
        double bound_sum = 0.0, truth_sum = 0.0;
        for (int k = 0; k < 12; ++k) {
            const Point corner = corners.next(2 * step);
            const Grid g = vertex_grid(*source, corner, step, 9);
            for (int i = 0; i < 81; ++i) {
                const Point v{corner.x + i % 9 * step, corner.y + i / 9 * step};
                if (!is_vertex(v, step)) continue;
                const double bound = static_cast<double>(g.at(v));
                const auto halves = diamond(v, step);
                const double truth =
                    std::max(deviation(*source, halves[0], 16), deviation(*source, halves[1], 16));
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
    ASSERT_NE(source, nullptr);
    const std::int64_t root = source->lattice().chunk_side(0);
    for (const std::int64_t step : {root, 2 * root, 8 * root}) {
        const Grid g = vertex_grid(*source, {0, 0}, step, 3);
        std::vector<float> cells(4);
        ASSERT_TRUE(source->cell_bounds(g.grid, cells).has_value());
        for (const Triangle& t : diamond({step, step}, step)) {
            EXPECT_LE(deviation(*source, t, 200), static_cast<double>(g.at({step, step})));
        }
        for (const Triangle& t : square_triangles({0, 0}, step)) {
            EXPECT_LE(deviation(*source, t, 200), static_cast<double>(cells.front()));
        }
        EXPECT_EQ(g.at({0, 0}), 0.0f);
    }
}

TEST(DemBoundsOfPlanes, AreNothing) {
    RasterSpec spec{.columns = 100, .rows = 70, .value = [](int, int) { return 42.5; }};
    const TemporaryFolder folder;
    const std::string path = folder.file("flat.tif");
    write_raster(path, spec);
    const auto source = DemHeights::open(path, {});
    ASSERT_TRUE(source.has_value());
    for (const std::int64_t step : steps_of(**source)) {
        const Grid g = vertex_grid(**source, {0, 0}, step, 9);
        EXPECT_EQ(*std::max_element(g.bounds.begin(), g.bounds.end()), 0.0f);
    }
}

}  // namespace bounds_test

namespace check_source_test {

void expect_clean(const std::string& path, double finest_spacing,
                  std::optional<std::uint64_t> detail_seed) {
    DemSettings settings{.finest_spacing = finest_spacing, .detail_seed = detail_seed};
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
        RasterSpec spec{.columns = 90, .rows = 70};
        spec.transform[5] = -cell_y;
        spec.value = [&random](int, int) { return static_cast<double>(random() % 10000u) / 100.0; };
        const TemporaryFolder folder;
        write_raster(folder.file("noise.tif"), spec);
        expect_clean(folder.file("noise.tif"), 1.3, std::nullopt);
    }
}

}  // namespace check_source_test
}  // namespace terrane::test
