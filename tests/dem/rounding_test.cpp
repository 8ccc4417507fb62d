// SPDX-License-Identifier: MIT
//
// Answers against the file's own numbers, in extended precision: errors are within the bounds for every band type.
#include "dem/raster_files.h"
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace terrane::test {
namespace rounding_test {

/// The content of a file: its band's numbers in their own type, scale and offset.
struct FileTruth {
    int columns = 0, rows = 0;
    long double cell_x = 1.0L, cell_y = 1.0L;
    std::vector<long double> heights;  ///< rows from the north

    long double at(int column, int row) const {
        return heights[static_cast<std::size_t>(std::clamp(row, 0, rows - 1)) *
                           static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(std::clamp(column, 0, columns - 1))];
    }
    /// The bilinear surface, which repeats the edge.
    long double height(double x, double y) const {
        const long double u = static_cast<long double>(x) / cell_x + 0.5L * columns - 0.5L;
        const long double v = 0.5L * rows - 0.5L - static_cast<long double>(y) / cell_y;
        const auto column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
        const long double fu = u - column, fv = v - row;
        const long double north = at(column, row) + fu * (at(column + 1, row) - at(column, row));
        const long double south =
            at(column, row + 1) + fu * (at(column + 1, row + 1) - at(column, row + 1));
        return north + fv * (south - north);
    }
};

template <typename Number>
FileTruth write_numbers(const std::string& path, const RasterSpec& spec,
                        const std::vector<Number>& numbers) {
    RasterSpec blank = spec;
    blank.value = [](int, int) { return 0.0; };
    write_raster(path, blank);
    GDALDataset* file = GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE);
    std::vector<Number> copy = numbers;
    const auto transfer = [&](GDALRWFlag direction) {
        ASSERT_EQ(
            file->GetRasterBand(1)->RasterIO(direction, 0, 0, spec.columns, spec.rows, copy.data(),
                                             spec.columns, spec.rows, spec.type, 0, 0, nullptr),
            CE_None);
    };
    transfer(GF_Write);
    std::fill(copy.begin(), copy.end(), Number{});
    transfer(GF_Read);
    GDALClose(GDALDataset::ToHandle(file));
    EXPECT_EQ(copy, numbers);
    FileTruth truth{
        spec.columns, spec.rows, std::fabs(spec.transform[1]), std::fabs(spec.transform[5]), {}};
    const long double unit = spec.unit == "ft" ? 0.3048L : 1.0L;
    for (const Number number : copy) {
        truth.heights.push_back((static_cast<long double>(number) * spec.scale + spec.offset) *
                                unit);
    }
    return truth;
}

/// The source, but for heights between the file's own numbers.
class TrueHeights final : public ForwardedHeights {
public:
    TrueHeights(std::shared_ptr<const HeightSource> source, const FileTruth& truth)
        : ForwardedHeights(std::move(source)), truth_(truth) {}
    double height(double x, double y) const override {
        return static_cast<double>(truth_.height(x, y));
    }

private:
    const FileTruth& truth_;
};

std::shared_ptr<const ResidentSet> everything(const HeightSource& source) {
    const Lattice& l = source.lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (int level = 0; level <= l.finest_level; ++level) {
        for (std::int32_t y = 0; y < l.root_count_y << level; ++y) {
            for (std::int32_t x = 0; x < l.root_count_x << level; ++x) {
                chunks.push_back(
                    make_chunk(source, {x, y, static_cast<std::uint8_t>(level)}).value());
            }
        }
    }
    return std::make_shared<const ResidentSet>(l, source.extent(), std::move(chunks), 1);
}

/// Checks all answers, and returns the largest error bound.
double check_answers(const std::string& path, const FileTruth& truth, std::mt19937& random) {
    DemSettings settings;
    settings.nodata = std::vector<double>();  // the limits of a type are heights here
    const auto [opened, info] = open_dem(path, settings);
    const HeightSource& source = *opened;
    const auto resident = everything(source);
    const Ground ground(resident, source.lattice().finest_level);
    const HeightInterval range = source.interval(source.extent());
    double largest_bound = 0.0, worst = 0.0;
    long answered = 0;
    const auto check_at = [&](double x, double y) {
        const HeightAnswer answer = ground.height(x, y);
        if (answer.status != QueryStatus::ok) return;
        ++answered;
        const long double wanted = truth.height(x, y);
        const auto off = static_cast<double>(std::fabs(answer.height - wanted));
        worst = std::max(worst, off / answer.error_m);
        largest_bound = std::max(largest_bound, answer.error_m);
        EXPECT_LE(off, answer.error_m) << "at " << x << ", " << y << ", height " << answer.height;
        EXPECT_LE(range.low, static_cast<double>(wanted));
        EXPECT_GE(range.high, static_cast<double>(wanted));
    };
    for (int row = 0; row < info.rows; ++row) {
        for (int column = 0; column < info.columns; ++column) {
            check_at(sample_x(info, column), sample_y(info, row));
        }
    }
    const WorldRect& e = source.extent();
    for (int i = 0; i < 400 && !testing::Test::HasFailure(); ++i) {
        check_at(e.west + random_unit(random) * (e.east - e.west),
                 e.south + random_unit(random) * (e.north - e.south));
    }
    EXPECT_GT(answered, info.rows * info.columns / 20);

    const TrueHeights truth_source(opened, truth);
    const double width = e.east - e.west, middle = 0.5 * (range.low + range.high);
    const View view = look_at({0.1 * width, -0.4 * width, range.high + 0.5 * width + 2.0},
                              {0, 0, middle}, 1.0, 640, 480)
                          .value();
    for (const std::size_t budget : {40u, 100'000u}) {
        const std::size_t roots = 2 * static_cast<std::size_t>(source.lattice().root_count_x) *
                                  static_cast<std::size_t>(source.lattice().root_count_y);
        Triangulator triangulator =
            Triangulator::create(source,
                                 {.triangle_budget = std::max(roots, budget), .max_error_px = 1e-3})
                .value();
        const TerrainMesh mesh = triangulator.update(resident, view);
        EXPECT_TRUE(std::isfinite(mesh.error_px));
        EXPECT_EQ(find_flaw(mesh), "");
        EXPECT_LE(measure_error_px(make_soup(mesh), truth_source, view, 3), mesh.error_px);
    }
    return largest_bound;
}

double log_uniform(std::mt19937& random, double low, double high) {
    return low * std::pow(high / low, random_unit(random));
}

/// Rasters of a type with random sizes, cells, ranges, places of the range, scales and offsets.
template <typename Number>
void check_type(GDALDataType type, unsigned seed) {
    std::mt19937 random(seed);
    const TemporaryFolder folder;
    for (int round = 0; round < few_or_many(2, 12) && !testing::Test::HasFailure(); ++round) {
        RasterSpec spec{.type = type};
        spec.columns = 2 + static_cast<int>(random() % 12);
        spec.rows = 2 + static_cast<int>(random() % 12);
        const double cell = std::ldexp(1.0, static_cast<int>(random() % 8) - 2);
        spec.transform = {1000.0, cell, 0.0, 5000.0, 0.0, random() % 3 == 0 ? -1.25 * cell : -cell};
        spec.scale = std::array{1.0, 1.0, 0.1, 0.25, 1e-3, -2.0}[random() % 6];
        spec.offset = std::array{0.0, 0.0, -30.0, 123456.7, 1e9}[random() % 5];
        if (random() % 4 == 0) spec.unit = "ft";

        // Numbers between two that the type holds, so that no height is beyond what is possible.
        using Limits = std::numeric_limits<Number>;
        const double most = std::min(static_cast<double>(Limits::max()), 0x1p37);
        const double least = std::max(static_cast<double>(Limits::lowest()), -0x1p37);
        const double middle =
            random() % 2 == 0 ? 0.5 * (least + most) + (random_unit(random) - 0.5) * (most - least)
                              : std::clamp(log_uniform(random, 1.0, 1e9), least, most);
        const double reach = log_uniform(random, 1e-3, 1e10);
        const double low = std::clamp(middle - reach, least, most);
        const double high = std::clamp(middle + reach, least, most);
        std::vector<Number> numbers;
        for (int i = 0; i < spec.columns * spec.rows; ++i) {
            const double number = low + random_unit(random) * (high - low);
            // The largest numbers of a type may have been rounded up to a double.
            numbers.push_back(number >= static_cast<double>(Limits::max())
                                  ? Limits::max()
                                  : static_cast<Number>(number));
        }
        SCOPED_TRACE(std::string(GDALGetDataTypeName(type)) + ", seed " + std::to_string(seed) +
                     ", round " + std::to_string(round) + ", scale " + std::to_string(spec.scale) +
                     ", offset " + std::to_string(spec.offset) + " " + spec.unit + ", numbers " +
                     std::to_string(low) + " to " + std::to_string(high));
        const std::string path = folder.file("numbers.tif");
        const FileTruth truth = write_numbers(path, spec, numbers);
        check_answers(path, truth, random);
    }
}

TEST(DemRounding, AnswersOfEveryBandTypeAreWithinTheirErrorOfTheFile) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    check_type<std::uint8_t>(GDT_Byte, seed);
    check_type<std::int16_t>(GDT_Int16, seed);
    check_type<std::uint16_t>(GDT_UInt16, seed);
    check_type<std::int32_t>(GDT_Int32, seed);
    check_type<std::uint32_t>(GDT_UInt32, seed);
    check_type<float>(GDT_Float32, seed);
    check_type<double>(GDT_Float64, seed);
#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 5, 0)
    check_type<std::int64_t>(GDT_Int64, seed);
    check_type<std::uint64_t>(GDT_UInt64, seed);
#endif
}

/// The error bound of a raster of one type; it holds.
template <typename Number>
double bound_of_numbers(GDALDataType type, const std::function<Number(int)>& number,
                        double scale = 1.0, double offset = 0.0) {
    RasterSpec spec{.type = type};
    spec.columns = spec.rows = 16;
    spec.scale = scale;
    spec.offset = offset;
    std::vector<Number> numbers;
    for (int i = 0; i < 256; ++i) numbers.push_back(number(i));
    const TemporaryFolder folder;
    const std::string path = folder.file("numbers.tif");
    const FileTruth truth = write_numbers(path, spec, numbers);
    std::mt19937 random(3);
    return check_answers(path, truth, random);
}

TEST(DemRounding, DoublesThatNoFloatHoldsKeepTheirDigits) {
    const double half_quantum = 0x1p-13;
    EXPECT_LE(bound_of_numbers<double>(GDT_Float64, [](int) { return 5000.00024; }),
              half_quantum + 1e-8);
    // Uneven ground: the bound holds what cells do between their corners, too.
    const double rough =
        bound_of_numbers<double>(GDT_Float64, [](int i) { return 0.5 * (i * 37 % 101) / 101.0; });
    EXPECT_LE(bound_of_numbers<double>(GDT_Float64,
                                       [](int i) { return 1e5 + 0.5 * (i * 37 % 101) / 101.0; }),
              rough + 1e-6);
}

TEST(DemRounding, GroundOfSmallCellsIsNotFlat) {
    for (const double cell : {1e-2, 1e-3, 1e-4, 1e-6}) {
        for (const double above_sea : {0.0, 2.0}) {
            SCOPED_TRACE(std::to_string(cell * 1e3) + " mm");
            RasterSpec spec{.type = GDT_Float64};
            spec.columns = spec.rows = 24;
            spec.transform = {0.0, cell, 0.0, 0.0, 0.0, -cell};
            // Hills without twist: nothing but the quantum is off. As high as a cell is wide.
            std::vector<double> numbers;
            for (int i = 0; i < 24 * 24; ++i) {
                const int row = i / 24, column = i % 24;
                numbers.push_back(above_sea +
                                  cell * (std::sin(row * 0.7) + std::cos(column * 0.9)));
            }
            const TemporaryFolder folder;
            const std::string path = folder.file("small.tif");
            const FileTruth truth = write_numbers(path, spec, numbers);
            std::mt19937 random(5);
            const double bound = check_answers(path, truth, random);
            EXPECT_LE(bound, cell == 1e-2 ? 0x1p-12 : cell / 500.0 + 3e-9);
        }
    }
}

TEST(DemRounding, TheQuantumFollowsTheSpacingOfDetail) {
    RasterSpec spec;
    spec.columns = spec.rows = 20;
    spec.transform = {0.0, 1.0, 0.0, 0.0, 0.0, -1.0};
    spec.value = [](int column, int row) { return 400.0 + (column * 7 + row * 13) % 11; };
    for (const double spacing : {1.0, 0.125, 0.01, 0.001}) {
        const OpenedDem dem = open_dem(spec, {.finest_spacing = spacing, .detail_seed = 3});
        const double quantum = dem.source->lattice().quantum;
        // Ordinary ground keeps its bits.
        EXPECT_EQ(quantum, spacing >= 0.01 ? 0x1p-12 : 0x1p-20) << spacing;
    }
}

TEST(DemRounding, WholeNumbersThatNoFloatHoldsKeepTheirDigits) {
    const double even = bound_of_numbers<std::int32_t>(GDT_Int32, [](int) { return 20'000'001; });
    EXPECT_LE(even, 0.04);
    bound_of_numbers<std::int32_t>(GDT_Int32, [](int i) { return 20'000'000 + i; });
    EXPECT_LE(bound_of_numbers<std::int32_t>(GDT_Int32, [](int) { return 2'147'483'583; }), 4.01);
    bound_of_numbers<std::int32_t>(GDT_Int32, [](int i) {
        return i % 2 == 0 ? std::numeric_limits<std::int32_t>::min()
                          : std::numeric_limits<std::int32_t>::max();
    });
    bound_of_numbers<std::uint32_t>(
        GDT_UInt32, [](int i) { return 4'294'967'295u - static_cast<std::uint32_t>(i); });
}

#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 5, 0)
TEST(DemRounding, CountsWhatDoublesLoseOfLongWholeNumbers) {
    // Nanometres: a double holds no odd number beyond 2^53.
    constexpr std::int64_t kFirst = (std::int64_t{1} << 53) + 1;
    bound_of_numbers<std::int64_t>(
        GDT_Int64, [](int i) { return kFirst + 2 * i; }, 1e-9);
    // The offset takes nearly all of it away: hundreds of metres are lost.
    bound_of_numbers<std::int64_t>(
        GDT_Int64, [](int i) { return std::numeric_limits<std::int64_t>::max() - i; }, 1.0,
        -0x1p63);
}
#endif

}  // namespace rounding_test
}  // namespace terrane::test
