// SPDX-License-Identifier: MIT
// Bits of scattered placements. They may change only with an entry in CHANGELOG.md; a failure prints the new hash.
// Built with both compilers at several optimisation levels, which must agree.
#include "support/hash.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/scatter.h>

#include <gtest/gtest.h>

#include <cstddef>

namespace terrane {
namespace golden_scatter_test {

TEST(GoldenScatter, IsTheSameWithEveryCompilerAtEveryLevel) {
    const std::shared_ptr<const HeightSource> source =
        FractalHeights::create({.seed = 5, .root_size_log2 = 13}).value();
    test::Hash hash;
    std::size_t count = 0;
    for (const double per_km2 : {40.0, 3000.0, 300'000.0}) {
        const Scatter scatter =
            Scatter::create(source, {.per_km2 = per_km2, .max_slope = 0.5, .seed = 9}).value();
        const ScatterSquare middle = scatter.square_at(0.0, 0.0);
        for (std::int32_t y = -1; y <= 1; ++y) {
            for (std::int32_t x = -1; x <= 1; ++x) {
                const std::vector<ScatterPoint> points =
                    scatter.objects_in({middle.x + x, middle.y + y}).value();
                for (const ScatterPoint& point : points) {
                    hash.add_all(std::span<const double>(point.position_world.data(), 3));
                    hash.add(point.scale);
                    hash.add(point.half_turn_cosine);
                    hash.add(point.half_turn_sine);
                    ++count;
                }
            }
        }
    }
    EXPECT_GT(count, 1000u);
    EXPECT_EQ(hash.value(), 0xed23ef7c26866cf6u) << std::hex << hash.value();
}

}  // namespace golden_scatter_test
}  // namespace terrane
