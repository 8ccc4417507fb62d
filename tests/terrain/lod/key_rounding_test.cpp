// SPDX-License-Identifier: MIT
// The bound of the rounding of keys, and so of projected errors, that docs/numerics.md derives, against long double.
#include "lod/screen_error.h"
#include "lod/selection.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

namespace terrane::internal {
namespace key_rounding_test {

using Long = long double;

static_assert(std::numeric_limits<Long>::digits >= 64, "the oracle needs 11 bits more than double");

constexpr std::uint64_t kSeed = 20261128;
constexpr Long kLoss = 0x1p-7L;     // of cutting 1 / bound^2 to 16 bits
constexpr Long kAbove = 0x1p-23L;   // derived: a key is above the exact one by at most this share
constexpr Long kPixels = 0x1p-16L;  // what kRounding leaves for it, beside the nesting of reaches
constexpr int kSquares = static_cast<int>(AreaVertices::kSquares);

struct Extremes {
    Long least =
        std::numeric_limits<Long>::infinity();  // of key over exact key, from eyes far away
    Long most = 0;                              // from all eyes
    long count = 0;
};

// A chunk at the finest level, and the certified bounds of its vertices.
class KeyCase {
public:
    explicit KeyCase(const FractalSettings& settings)
        : source_(FractalHeights::create(settings).value()),
          chunk_(make_chunk(*source_, {5, 9, static_cast<std::uint8_t>(lattice().finest_level)})
                     .value()),
          keys_(*source_, best_simd_level(), 1),
          bounds_(std::size_t{kChunkSamples} * kChunkSamples) {
        const SampleGrid grid{chunk_->corner, chunk_->step, kChunkSamples, kChunkSamples};
        EXPECT_TRUE(source_->vertex_bounds(grid, bounds_));
    }

    const Lattice& lattice() const { return source_->lattice(); }

    // Keys of all vertices from an eye at a distance from a sample of the chunk, over the exact ones.
    void compare(test::Random& random, double distance, Extremes& extremes) const {
        const int column = random.below(kChunkSamples), row = random.below(kChunkSamples);
        const WorldPos sample(lattice().x(chunk_->corner.x + column * chunk_->step),
                              lattice().y(chunk_->corner.y + row * chunk_->step),
                              lattice().quantum * chunk_->heights[sample_index(column, row)]);
        const WorldPos eye = sample + distance * random.direction();
        const Result<View> view = look_at(eye, eye + random.direction(), 0.8, 1280, 720);
        if (!view) return;
        const ScreenError screen(*view, *source_, 0.0);
        OpenChunk open;
        open.chunk = chunk_.get();
        screen.fill_axes(*chunk_, open.axes);
        open.eye_heights = screen.eye_heights(*chunk_);
        std::array<float, AreaVertices::kSquares> found{};
        for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
            for (const auto kind :
                 {AreaVertices::centre, AreaVertices::along_x, AreaVertices::along_y}) {
                keys_.own_keys(open, area, kind, found.data());
                for (int square = 0; square < kSquares; ++square) {
                    const auto k = static_cast<std::size_t>(square);
                    const Long exact = exact_key(*view, area, kind, square);
                    if (exact > Long{0x1p100}) continue;  // of a bound near 0
                    const Long ratio = Long{found[k]} / exact;
                    extremes.most = std::max(extremes.most, ratio);
                    if (distance > 1e5) extremes.least = std::min(extremes.least, ratio);
                    ++extremes.count;
                }
            }
        }
    }

private:
    // From the bound of the source and the reach without the margins of its rounding: of heights at least one unit.
    Long exact_key(const View& view, int area, AreaVertices::Kind kind, int square) const {
        const int x = area % kChunkAreas * kAreaCells + square % kAreaSquares * 2;
        const int y = area / kChunkAreas * kAreaCells + square / kAreaSquares * 2;
        const int column = kind == AreaVertices::along_y ? x : x + 1;
        const int row = kind == AreaVertices::along_x ? y : y + 1;
        const ChunkVertices& vertices = *chunk_->vertices;
        const AreaVertices& of_area = vertices.areas[static_cast<std::size_t>(area)];
        const auto k = static_cast<std::size_t>(square);
        const Long reach = Long{lattice().level_spacing(chunk_->key.level)} *
                           (kind == AreaVertices::centre ? 3 : 2);
        const auto gap = [&](double at, double eye) {
            return std::max(std::abs(Long{at} - Long{eye}) - reach, Long{0});
        };
        const Long unit = vertices.reach_unit;
        const Long base = Long{vertices.reach_base} - Long{view.eye_world.z()};
        const Long low = base + unit * (of_area.low[kind][k] + 1);
        const Long high = base + unit * (of_area.high[kind][k] - 1);
        const Long gap_x =
            gap(lattice().x(chunk_->corner.x + column * chunk_->step), view.eye_world.x());
        const Long gap_y =
            gap(lattice().y(chunk_->corner.y + row * chunk_->step), view.eye_world.y());
        const Long gap_z = std::max({low, -high, Long{0}});
        const Long square_distance = std::max(gap_x * gap_x + gap_y * gap_y + gap_z * gap_z,
                                              Long{view.near_distance} * view.near_distance);
        const Long bound = Long{bounds_[static_cast<std::size_t>(row * kChunkSamples + column)]} +
                           0.5L * lattice().quantum;
        return square_distance / (bound * bound);
    }

    std::shared_ptr<const HeightSource> source_;
    std::shared_ptr<const Chunk> chunk_;
    VertexKeys keys_;
    std::vector<float> bounds_;
};

TEST(KeyRounding, IsWithinTheDerivedBound) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    struct Case {
        int spacing_log2;
        double origin, amplitude;
    };
    test::Random random(kSeed);
    for (const Case& each :
         {Case{-7, 0.0, 30.0}, Case{0, 0.0, 1e5}, Case{0, 0x1p30, 1e5}, Case{6, 0x1p37, 1e5}}) {
        const KeyCase keys({.amplitude = each.amplitude,
                            .wavelength_log2 = std::max(4, each.spacing_log2 + 3),
                            .finest_spacing_log2 = each.spacing_log2,
                            .root_size_log2 = each.spacing_log2 + 12,
                            .origin_x = each.origin,
                            .origin_y = -each.origin});
        Extremes extremes;
        for (int i = 0; i < 20; ++i) {
            keys.compare(random, std::pow(10.0, random.between(-2.0, 8.0)), extremes);
        }
        std::printf("spacing 2^%d m, %g m out: key over exact key %.7Lf to %.9Lf\n",
                    each.spacing_log2, each.origin, extremes.least, extremes.most);
        EXPECT_GT(extremes.count, 10'000);
        EXPECT_LE(extremes.most, 1 + kAbove);
        EXPECT_GT(extremes.most, 1 - 0x1p-12L);
        EXPECT_GT(extremes.least, 1 - kLoss - 0x1p-12L);
    }
}

TEST(KeyRounding, IsInsideTheFactorOfReportedErrors) {
    // A pixel is the inverse root of a key: nesting of reaches, rounding of keys, and of the root itself.
    const Long needed = std::sqrt(Long{kNestMargin} * (1 + kAbove)) * (1 + 4 * 0x1p-53L);
    EXPECT_LE(needed, Long{ScreenError::kRounding});
    EXPECT_GT(needed, Long{ScreenError::kRounding} - 2 * kPixels);
}

}  // namespace key_rounding_test
}  // namespace terrane::internal
