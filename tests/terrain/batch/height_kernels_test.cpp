// SPDX-License-Identifier: MIT
//
// The kernels of heights at every level of vector instructions, against the scalar code of single calls.
#include "ground/height_kernels.h"

#include "ground/ray_walk.h"
#include "support/random.h"
#include "terrain/batch/batch_scene.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane {
namespace height_kernels_test {

using internal::AxisCells;
using internal::AxisLines;
using internal::HeightKernels;
using internal::kHeightBlock;
using internal::SimdLevel;
using test::bits_of;
using test::Random;

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

// By search from a guess: the last line that is not above p.
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
            // the corners, both diagonals and the inside
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

}  // namespace height_kernels_test
}  // namespace terrane
