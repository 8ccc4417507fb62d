// SPDX-License-Identifier: MIT
// Keys of root squares' coarser vertices are computed only for strides that may have one below the floor. No stride
// that has one is passed over, by an oracle that computes the keys of all.
#include "base/worker_team.h"
#include "lod/screen_error.h"
#include "lod/selection.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace terrane::internal {
namespace coarse_keys_test {

constexpr std::uint64_t kSeed = 20261127;

// The root squares of a fractal, nothing finer.
class RootWorld {
public:
    explicit RootWorld(const FractalSettings& settings)
        : source_(FractalHeights::create(settings).value()),
          keys_(*source_, best_simd_level(), 1),
          team_(1),
          selection_(1) {
        const Lattice& lattice = source_->lattice();
        std::vector<std::shared_ptr<const Chunk>> chunks;
        for (int y = 0; y < lattice.root_count_y; ++y) {
            for (int x = 0; x < lattice.root_count_x; ++x) {
                chunks.push_back(
                    make_chunk(*source_, {lattice.first_root_x + x, lattice.first_root_y + y, 0})
                        .value());
            }
        }
        resident_ = std::make_unique<ResidentSet>(lattice, source_->extent(), std::move(chunks), 1);
    }

    const ResidentSet& resident() const { return *resident_; }
    const HeightSource& source() const { return *source_; }

    void compute(const ScreenError& screen, float floor) {
        selection_.begin(floor, 0.0f);
        keys_.compute(*resident_, screen, pins_, floor, selection_, team_);
    }

    // Calls use(root, stride, least own key of the stride) for all strides of all roots.
    template <class Use>
    void for_strides(const ScreenError& screen, const Use& use) const {
        constexpr int kSide = kChunkSquares;
        for (const OpenChunk* root : keys_.open()) {
            for (int stride = 1; stride < kSide; stride *= 2) {
                float least = std::numeric_limits<float>::infinity();
                for (int row = 0; row <= kSide; row += stride) {
                    for (int column = 0; column <= kSide; column += stride) {
                        const auto both = static_cast<unsigned>(column | row);
                        if (both == 0 || 1 << std::countr_zero(both) != stride) continue;
                        least = std::min(least, keys_.own_coarse_key(screen, *root, column, row));
                    }
                }
                use(*root, stride, least);
            }
        }
    }

private:
    std::shared_ptr<const HeightSource> source_;
    VertexKeys keys_;
    WorkerTeam team_;
    Selection selection_;
    SolidPins pins_;
    std::unique_ptr<ResidentSet> resident_;
};

// Eyes in, near and far from the squares, above and below them, of any field of view.
Result<View> random_view(test::Random& random, const WorldRect& extent) {
    const double side = extent.east - extent.west;
    const WorldPos eye(
        random.between(extent.west - side, extent.east + side),
        random.between(extent.south - side, extent.north + side),
        random.below(2) == 0 ? random.between(-3e3, 3e3) : side * random.between(-2.0, 2.0));
    return look_at(eye, eye + random.direction(), random.between(0.01, 2.5), 1280, 720);
}

TEST(CoarseKeys, NoStrideWithAKeyBelowTheFloorIsPassedOver) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed);
    test::Random random(kSeed);
    long tight = 0, passed_over = 0;
    for (const double amplitude : {3000.0, 30.0, 0.0}) {
        RootWorld world({.amplitude = amplitude,
                         .wavelength_log2 = 9,
                         .finest_spacing_log2 = 0,
                         .root_size_log2 = 9});
        for (int i = 0; i < 60; ++i) {
            const Result<View> view = random_view(random, world.source().extent());
            if (!view) continue;
            const ScreenError screen(*view, world.source(), 0.0);
            world.compute(screen, 1.0f);
            std::vector<float> least_keys;
            world.for_strides(screen, [&](const OpenChunk&, int, float least) {
                if (least < 1e30f) least_keys.push_back(least);
            });
            // Floors just above the least key of each stride: that stride must not be passed over.
            for (const float least : least_keys) {
                const float floor = std::nextafter(least, std::numeric_limits<float>::infinity());
                world.compute(screen, floor);
                world.for_strides(screen, [&](const OpenChunk& root, int stride, float own) {
                    const bool is_open = (root.open_strides & static_cast<unsigned>(stride)) != 0;
                    passed_over += !is_open;
                    if (!(own < floor)) return;
                    tight += own == least;
                    EXPECT_TRUE(is_open) << "stride " << stride << ", key " << own;
                });
                if (testing::Test::HasFailure()) return;
            }
        }
    }
    EXPECT_GT(tight, 1000);
    EXPECT_GT(passed_over, 1000);
}

}  // namespace coarse_keys_test
}  // namespace terrane::internal
