// SPDX-License-Identifier: MIT
//
// Batches of heights against Ground::height() at each point.
#include "ground/height_kernels.h"
#include "ground/ray_walk.h"
#include "terrain/ground/batch_scene.h"

#include <terrane/terrain/ground_batch.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane::batch_heights_test {

using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Arrays {
    explicit Arrays(std::size_t count)
        : heights(count, -1.0),
          normals(3 * count, -1.0),
          errors_m(count, -1.0),
          statuses(count, QueryStatus::invalid),
          filled(count, 7) {}
    HeightArrays out() { return {heights, normals, errors_m, statuses, filled}; }

    std::vector<double> heights, normals, errors_m;
    std::vector<QueryStatus> statuses;
    std::vector<std::uint8_t> filled;
};

GroundBatch make_batch(int workers = 1) {
    return GroundBatch::create({.worker_count = workers}).value();
}

// Drops z from x y z x y z ...
std::vector<double> without_z(const std::vector<double>& points) {
    std::vector<double> flat;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        flat.push_back(points[i]);
        flat.push_back(points[i + 1]);
    }
    return flat;
}

void expect_answer(const Arrays& arrays, std::size_t i, const HeightAnswer& expected) {
    const bool is_ok = expected.status == QueryStatus::ok;
    ASSERT_EQ(arrays.statuses[i], expected.status);
    ASSERT_EQ(bits_of(arrays.heights[i]), bits_of(is_ok ? expected.height : kNaN));
    ASSERT_EQ(bits_of(arrays.errors_m[i]), bits_of(is_ok ? expected.error_m : kNaN));
    for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(bits_of(arrays.normals[3 * i + static_cast<std::size_t>(axis)]),
                  bits_of(is_ok ? expected.normal[axis] : kNaN));
    }
    ASSERT_EQ(arrays.filled[i], is_ok && expected.filled ? 1 : 0);
}

TEST(BatchHeights, HaveTheBitsOfSingleCallsInTheCallersOrderOnAnyNumberOfThreads) {
    constexpr std::size_t kCount = 30'000;
    for (const double spacing : {1.0, 1.1}) {
        const Ground ground = make_batch_ground(spacing);
        SeededRandom random(5);
        const std::vector<double> points = make_batch_points(random, kCount, spacing);
        for (int workers = 1; workers <= 4; ++workers) {
            SCOPED_TRACE(testing::Message() << "spacing " << spacing << ", workers " << workers);
            GroundBatch batch = make_batch(workers);
            std::array<int, 6> counts{};
            for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kCount}) {
                Arrays arrays(count);
                const std::span<const double> some = std::span(points).first(3 * count);
                ASSERT_TRUE(batch.heights(ground, PointArray::interleaved_xyz(some), arrays.out()));
                for (std::size_t i = 0; i < count; ++i) {
                    SCOPED_TRACE(testing::Message() << "point " << i);
                    expect_answer(arrays, i, ground.height(points[3 * i], points[3 * i + 1]));
                    if (HasFatalFailure()) return;
                    ++counts[static_cast<std::size_t>(arrays.statuses[i])];
                }
            }
            for (const QueryStatus status : {QueryStatus::ok, QueryStatus::outside,
                                             QueryStatus::not_resident, QueryStatus::invalid}) {
                EXPECT_GT(counts[static_cast<std::size_t>(status)], 100);
            }
        }
    }
}

TEST(BatchHeights, AreTheSameForEveryLayoutOfThePoints) {
    constexpr std::size_t kCount = 500;
    const Ground ground = make_batch_ground();
    Random random(6);
    const std::vector<double> points = make_batch_points(random, kCount);
    const std::vector<double> flat = without_z(points);
    std::vector<double> x, y;
    for (std::size_t i = 0; i < kCount; ++i) {
        x.push_back(points[3 * i]);
        y.push_back(points[3 * i + 1]);
    }
    GroundBatch batch = make_batch();
    for (const PointArray& layout :
         {PointArray::interleaved_xyz(points), PointArray::interleaved_xy(flat),
          PointArray::separate(x, y)}) {
        Arrays arrays(kCount);
        ASSERT_TRUE(batch.heights(ground, layout, arrays.out()));
        for (std::size_t i = 0; i < kCount; ++i)
            expect_answer(arrays, i, ground.height(x[i], y[i]));
    }
    const WorldPos point(100.25, 17.5, 0.0);
    Arrays arrays(kCount);
    ASSERT_TRUE(batch.heights(ground, PointArray::repeated(point, kCount), arrays.out()));
    for (std::size_t i = 0; i < kCount; ++i) expect_answer(arrays, i, ground.height(100.25, 17.5));
}

TEST(BatchHeights, WriteOnlyTheArraysThatAreGiven) {
    constexpr std::size_t kCount = 300;
    const Ground ground = make_batch_ground();
    Random random(7);
    const std::vector<double> points = make_batch_points(random, kCount);
    const PointArray places = PointArray::interleaved_xyz(points);
    GroundBatch batch = make_batch();
    Arrays all(kCount);
    ASSERT_TRUE(batch.heights(ground, places, all.out()));
    for (int left_out = 0; left_out < 32; ++left_out) {
        Arrays some(kCount);
        HeightArrays out = some.out();
        if ((left_out & 1) != 0) out.heights = {};
        if ((left_out & 2) != 0) out.normals = {};
        if ((left_out & 4) != 0) out.errors_m = {};
        if ((left_out & 8) != 0) out.statuses = {};
        if ((left_out & 16) != 0) out.filled = {};
        ASSERT_TRUE(batch.heights(ground, places, out));
        for (std::size_t i = 0; i < kCount; ++i) {
            ASSERT_EQ(bits_of(some.heights[i]),
                      bits_of(out.heights.empty() ? -1.0 : all.heights[i]));
            ASSERT_EQ(bits_of(some.normals[3 * i]),
                      bits_of(out.normals.empty() ? -1.0 : all.normals[3 * i]));
            ASSERT_EQ(bits_of(some.errors_m[i]),
                      bits_of(out.errors_m.empty() ? -1.0 : all.errors_m[i]));
            ASSERT_EQ(some.statuses[i],
                      out.statuses.empty() ? QueryStatus::invalid : all.statuses[i]);
            ASSERT_EQ(some.filled[i], out.filled.empty() ? 7 : all.filled[i]);
        }
    }
}

// One GroundBatch for changing grounds: it keeps no chunks of the previous call.
TEST(BatchHeights, AreThoseOfTheGroundOfThisCall) {
    GroundBatch batch = make_batch(2);
    Random random(8);
    const std::vector<double> points = make_batch_points(random, 2000);
    for (int repeat = 0; repeat < 4; ++repeat) {
        const Ground ground = test::make_test_ground(
            [repeat](double x, double y) { return 10.0 * repeat + 0.01 * x * y; }, 1.0, 3);
        Arrays arrays(2000);
        ASSERT_TRUE(batch.heights(ground, PointArray::interleaved_xyz(points), arrays.out()));
        for (std::size_t i = 0; i < 2000; ++i)
            expect_answer(arrays, i, ground.height(points[3 * i], points[3 * i + 1]));
    }
}

}  // namespace terrane::batch_heights_test

// Height kernels at every level of vector instructions, against the scalar code of single calls.

namespace terrane::height_kernels_test {

using namespace test;
using internal::AxisCells;
using internal::AxisLines;
using internal::HeightKernels;
using internal::kHeightBlock;
using internal::SimdLevel;

constexpr std::uint64_t kSeed = 11;
constexpr std::int64_t kCells = kChunkCells;

std::vector<SimdLevel> levels() {
    std::vector<SimdLevel> all;
    for (const SimdLevel level : {SimdLevel::baseline, SimdLevel::avx2, SimdLevel::avx512}) {
        if (level <= internal::best_simd_level()) all.push_back(level);
    }
    return all;
}

double line_at(const AxisLines& lines, std::int64_t index) {
    return lines.origin + lines.spacing * static_cast<double>(index);
}

// Index of the last lattice line not above p, by linear search from an estimate.
std::int64_t last_up_to(const AxisLines& lines, double p) {
    auto index = static_cast<std::int64_t>(std::floor((p - lines.origin) / lines.spacing));
    while (line_at(lines, index) > p) --index;
    while (line_at(lines, index + 1) <= p) ++index;
    return index;
}

TEST(HeightKernels, FindTheCellOfEveryPositionAtEveryLevel) {
    Random random(kSeed);
    for (int round = 0; round < 300; ++round) {
        AxisLines lines;
        lines.spacing = round % 3 == 0 ? 0.001 : random.between(0.1, 40.0);
        lines.inverse_spacing = 1.0 / lines.spacing;
        lines.origin = random.between(-1e6, 1e6) * (round % 2);
        lines.first = std::floor(random.between(-3e5, 0.0));
        lines.last = std::floor(random.between(0.0, 3e5));
        lines.low = line_at(lines, static_cast<std::int64_t>(lines.first)) + 0.3 * lines.spacing;
        lines.high = line_at(lines, static_cast<std::int64_t>(lines.last)) + 0.6 * lines.spacing;
        std::array<double, kHeightBlock> p{};
        for (double& at : p) {
            const auto index =
                static_cast<std::int64_t>(random.between(lines.first - 2.0, lines.last + 3.0));
            at = random.below(2) == 0 ? line_at(lines, index)
                                      : line_at(lines, index) + random.between(0.0, lines.spacing);
            if (random.below(4) == 0) at = std::nextafter(line_at(lines, index), -1e9);
        }
        p[3] = std::numeric_limits<double>::quiet_NaN();
        p[4] = std::numeric_limits<double>::infinity();
        p[5] = -1e300;
        p[6] = lines.low;
        p[7] = lines.high;
        for (const SimdLevel level : levels()) {
            AxisCells cells;
            internal::height_kernels(level).find_cells(lines, p.data(), cells);
            for (std::size_t k = 0; k < kHeightBlock; ++k) {
                SCOPED_TRACE(testing::Message()
                             << "seed " << kSeed << ", round " << round << ", level "
                             << static_cast<int>(level) << ", position " << p[k]);
                const bool is_inside = p[k] >= lines.low && p[k] <= lines.high;
                const std::int64_t index = is_inside ? last_up_to(lines, p[k]) : 0;
                if (!is_inside || index < static_cast<std::int64_t>(lines.first) ||
                    index > static_cast<std::int64_t>(lines.last)) {
                    ASSERT_EQ(cells.cell[k], -1);
                    continue;
                }
                ASSERT_EQ(cells.chunk[k] * kCells + cells.cell[k], index);
                ASSERT_GE(cells.cell[k], 0);
                ASSERT_LT(cells.cell[k], kCells);
                const double place = std::min(1.0, (p[k] - line_at(lines, index)) / lines.spacing);
                ASSERT_EQ(bits_of(cells.place[k]), bits_of(place));
            }
        }
    }
}

TEST(HeightKernels, GiveTheHeightsAndNormalsOfSingleCellsAtEveryLevel) {
    Random random(kSeed);
    for (int round = 0; round < 200; ++round) {
        const double quantum = std::ldexp(1.0, -random.below(20));
        const double spacing = random.between(0.01, 40.0);
        const double most = round % 2 == 0 ? 2e9 : 50.0;
        std::vector<std::int32_t> samples(kHeightBlock * (kChunkSamples + 2));
        for (std::int32_t& sample : samples)
            sample = static_cast<std::int32_t>(random.between(-most, most));
        std::array<const std::int32_t*, kHeightBlock> corners{};
        AxisCells x{}, y{};
        for (std::size_t k = 0; k < kHeightBlock; ++k) {
            corners[k] = &samples[k * (kChunkSamples + 2)];
            x.cell[k] = static_cast<std::int32_t>(random.below(kChunkCells));
            y.cell[k] = static_cast<std::int32_t>(random.below(kChunkCells));
            // the corners, both diagonals and the interior
            x.place[k] = k % 4 == 0 ? static_cast<double>(k / 4 % 2) : random.between(0.0, 1.0);
            y.place[k] = k % 4 == 1   ? x.place[k]
                         : k % 4 == 2 ? 1.0 - x.place[k]
                                      : random.between(0.0, 1.0);
        }
        for (const SimdLevel level : levels()) {
            const HeightKernels& kernels = internal::height_kernels(level);
            internal::BlockHeights heights;
            internal::BlockNormals normals;
            kernels.heights(corners.data(), x, y, quantum, heights);
            kernels.normals(heights, spacing, normals);
            for (std::size_t k = 0; k < kHeightBlock; ++k) {
                SCOPED_TRACE(testing::Message()
                             << "seed " << kSeed << ", round " << round << ", level "
                             << static_cast<int>(level) << ", point " << k);
                const internal::CellHeight expected =
                    internal::height_in_cell(corners[k], x.place[k], y.place[k],
                                             cut_to_north_east(x.cell[k], y.cell[k]), quantum);
                const Eigen::Vector3d normal = expected.normal(spacing);
                ASSERT_EQ(bits_of(heights.height[k]), bits_of(expected.height));
                ASSERT_EQ(bits_of(normals.x[k]), bits_of(normal.x()));
                ASSERT_EQ(bits_of(normals.y[k]), bits_of(normal.y()));
                ASSERT_EQ(bits_of(normals.z[k]), bits_of(normal.z()));
            }
        }
    }
}

}  // namespace terrane::height_kernels_test

// Arrays of different lengths are refused with a message that names them, and nothing is written.

namespace terrane::batch_arrays_test {

using namespace test;

std::string message_of(const Result<void>& result) {
    return result ? std::string() : result.error().message;
}

class BatchArrays : public testing::Test {
protected:
    std::string refusal(const PointArray& points, const HeightArrays& out) {
        return message_of(batch.heights(ground, points, out));
    }

    const Ground ground = make_batch_ground();
    GroundBatch batch = GroundBatch::create().value();
    std::vector<double> nine = std::vector<double>(9, 1.0);
    std::vector<double> ten = std::vector<double>(10, 1.0);
    std::vector<double> written = std::vector<double>(9, -1.0);
    std::vector<QueryStatus> statuses = std::vector<QueryStatus>(9);
};

TEST_F(BatchArrays, AreRefusedWhereAnOutputIsTooShortOrTooLong) {
    const PointArray points = PointArray::separate(ten, ten);
    EXPECT_EQ(refusal(points, {.heights = written}),
              "heights must be empty or have 1 entry for each of 10 items, has 9");
    EXPECT_EQ(refusal(points, {.normals = written}),
              "normals must be empty or have 3 entries for each of 10 items, has 9");
    EXPECT_EQ(refusal(PointArray::separate(nine, nine), {.normals = written}),
              "normals must be empty or have 3 entries for each of 9 items, has 9");
    EXPECT_EQ(refusal(points, {.statuses = statuses}),
              "statuses must be empty or have 1 entry for each of 10 items, has 9");
    EXPECT_EQ(refusal(PointArray{}, {.errors_m = written}),
              "errors_m must be empty or have 1 entry for each of 0 items, has 9");
    EXPECT_EQ(written, std::vector<double>(9, -1.0));
}

TEST_F(BatchArrays, AreRefusedWhereACoordinateIsTooShort) {
    EXPECT_EQ(refusal(PointArray::separate(ten, nine), {}),
              "points_world.y must have at least 10 numbers for 10 points with stride 1, has 9");
    EXPECT_EQ(refusal(PointArray::interleaved_xy(nine), {}),
              "points_world.y must have at least 9 numbers for 5 points with stride 2, has 8");
    EXPECT_EQ(
        refusal({.count = std::numeric_limits<std::size_t>::max(), .stride = 3, .x = ten}, {}),
        "points_world.x must have at least 18446744073709551615 numbers for "
        "18446744073709551615 points with stride 3, has 10");
    EXPECT_EQ(refusal({.count = 1, .stride = 0}, {}),
              "points_world.x must have at least 1 numbers for 1 points with stride 0, has 0");
    EXPECT_EQ(refusal(PointArray::interleaved_xy(ten), {}), "");
}

TEST_F(BatchArrays, AreRefusedWhereRaysHaveNoHeightsOrNoEnds) {
    const PointArray flat = PointArray::interleaved_xy(ten);
    const PointArray three = PointArray::interleaved_xyz(nine);
    const PointArray five = PointArray::separate(std::span(ten).first(5), ten, ten);
    EXPECT_EQ(message_of(batch.rays(ground, three, five, {})),
              "to_world must have as many points as from_world, 3, has 5");
    EXPECT_EQ(message_of(batch.rays(ground, flat, five, {})),
              "from_world.z must have at least 9 numbers for 5 points with stride 2, has 0");
    EXPECT_EQ(message_of(batch.rays(ground, five, flat, {})),
              "to_world.z must have at least 9 numbers for 5 points with stride 2, has 0");
    EXPECT_EQ(message_of(batch.rays(ground, PointArray::interleaved_xyz(ten), five, {})),
              "to_world must have as many points as from_world, 4, has 5");
    RayArrays out{.points_world = written};
    EXPECT_EQ(message_of(batch.rays(ground, five, five, out)),
              "points_world must be empty or have 3 entries for each of 5 items, has 9");
    EXPECT_EQ(written, std::vector<double>(9, -1.0));
}

TEST(GroundBatchSettings, AreRefusedWithoutAWorkerAndWithTooMany) {
    for (const int workers : {0, -1, 65}) {
        const auto batch = GroundBatch::create({.worker_count = workers});
        ASSERT_FALSE(batch);
        EXPECT_EQ(batch.error().message,
                  "worker_count must be 1 to 64, got " + std::to_string(workers));
    }
}

}  // namespace terrane::batch_arrays_test
