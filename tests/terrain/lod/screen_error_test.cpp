// SPDX-License-Identifier: MIT
#include "lod/screen_error.h"

#include "base/worker_team.h"
#include "lod/selection.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <vector>

namespace terrane::internal::screen_error_test {

constexpr std::uint64_t kSeed = 23;

std::shared_ptr<const HeightSource> hills() {
    return FractalHeights::create(
               {.seed = 3, .octave_count = 10, .amplitude = 120.0, .wavelength_log2 = 10})
        .value();
}

std::shared_ptr<const HeightSource> flat_ground() {
    return FractalHeights::create({.amplitude = 0.0}).value();
}

WorldPos anywhere(test::Random& random, double size) {
    return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}

Result<View> any_view(test::Random& random) {
    const WorldPos eye = anywhere(random, 50.0);
    return look_at(eye, eye + anywhere(random, 1.0), 0.8, 640, 480);
}

ScreenError::Triangle any_triangle(test::Random& random, const WorldPos& around) {
    return {around + anywhere(random, 30.0), around + anywhere(random, 30.0),
            around + anywhere(random, 30.0)};
}

// Screen error of a point displaced vertically by `deviation`; 0 if the displaced point is out of view.
double error_at(const WorldPos& point, double deviation, const View& view, const Frustum& frustum) {
    const Eigen::Vector3d from_eye = point + WorldPos(0.0, 0.0, deviation) - view.eye_world;
    for (const Eigen::Vector3d& normal : frustum.normals) {
        if (normal.dot(from_eye) < 0.0) return 0.0;
    }
    return std::abs(deviation) * view.pixels_per_radian() /
           std::max(view.near_distance, from_eye.norm());
}

TEST(ScreenError, OfATriangleIsAboveThatOfEveryPointInView) {
    test::Random random(kSeed);
    const auto source = flat_ground();
    int seen = 0;
    for (int i = 0; i < 2000; ++i) {
        const Result<View> view = any_view(random);
        if (!view) continue;
        const Frustum frustum = make_frustum(*view);
        const ScreenError::Triangle triangle = any_triangle(random, view->eye_world);
        const double bound = random.between(0.0, 8.0);
        double most = 0.0;
        for (int k = 0; k < 200; ++k) {
            double u = random.between(0.0, 1.0), v = random.between(0.0, 1.0);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            const WorldPos point =
                triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
            most = std::max(most, error_at(point, random.between(-bound, bound), *view, frustum));
        }
        const ScreenError screen(*view, *source, 0.0);
        ASSERT_GE(screen.error_in_view(triangle, bound), most)
            << "triangle " << i << ", seed " << kSeed;
        seen += most > 0.0 ? 1 : 0;
    }
    EXPECT_GT(seen, 100);
}

TEST(ScreenError, OfATriangleIsNotAboveThatOfTheBoxAroundIt) {
    test::Random random(kSeed);
    const auto source = flat_ground();
    int smaller = 0;
    for (int i = 0; i < 2000; ++i) {
        const Result<View> view = any_view(random);
        if (!view) continue;
        const ScreenError::Triangle triangle = any_triangle(random, view->eye_world);
        const double bound = random.between(0.0, 8.0);
        const ScreenError screen(*view, *source, 0.0);
        const WorldPos up(0.0, 0.0, bound);
        const ScreenError::WorldBox box{
            triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]) - up,
            triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]) + up};
        const double of_triangle = screen.error_in_view(triangle, bound);
        const double of_box = screen.error_in_view(box, bound);
        ASSERT_LE(of_triangle, of_box * (1.0 + 1e-6)) << i << ", seed " << kSeed;
        smaller += of_triangle < 0.9 * of_box ? 1 : 0;
    }
    EXPECT_GT(smaller, 100);
}

// Checks clearances at random eyes and returns how many of them are not small.
int check_clearances(const HeightSource& source, double most_over) {
    test::Random random(kSeed);
    int useful = 0;
    for (int i = 0; i < 50; ++i) {
        const double x = random.between(-500.0, 500.0), y = random.between(-500.0, 500.0);
        const WorldPos eye(x, y, source.height(x, y) + random.between(-5.0, most_over));
        const double clearance = clearance_of(source, eye);
        double distance = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 4000; ++k) {
            const double reach = std::ldexp(256.0, -random.below(10));
            const double to_x = x + random.between(-reach, reach);
            const double to_y = y + random.between(-reach, reach);
            const WorldPos ground(to_x, to_y, source.height(to_x, to_y));
            distance = std::min(distance, (ground - eye).norm());
        }
        EXPECT_LE(clearance, distance) << "eye " << i << ", seed " << kSeed;
        useful += clearance > 0.2 * distance ? 1 : 0;
    }
    return useful;
}

TEST(Clearance, IsBelowTheDistanceToEveryPointOfTheGround) {
    EXPECT_GT(check_clearances(*hills(), 200.0), 25);
    // walls beside the eye are nearer than the ground below it
    const auto walls = FractalHeights::create(
                           {.seed = 4, .octave_count = 4, .amplitude = 300.0, .wavelength_log2 = 6})
                           .value();
    check_clearances(*walls, 100.0);
}

TEST(Clearance, IsZeroBelowTheGround) {
    const auto source = hills();
    EXPECT_EQ(clearance_of(*source, {10.0, 20.0, source->height(10.0, 20.0)}), 0.0);
    EXPECT_GE(clearance_of(*source, {10.0, 20.0, -1e7}), 0.0);
}

}  // namespace terrane::internal::screen_error_test

// Keys of the coarser vertices of root squares are computed only for strides that may contain a key below the floor. An
// oracle computes all keys and checks that no such stride is skipped.

namespace terrane::internal::coarse_keys_test {

constexpr std::uint64_t kSeed = 20261127;

// The root squares of a fractal, without finer levels.
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

// Eyes inside, near and far from the squares, above and below them, with any field of view.
Result<View> random_view(test::Random& random, const WorldRect& extent) {
    const double side = extent.east - extent.west;
    const WorldPos eye(
        random.between(extent.west - side, extent.east + side),
        random.between(extent.south - side, extent.north + side),
        random.below(2) == 0 ? random.between(-3e3, 3e3) : side * random.between(-2.0, 2.0));
    return look_at(eye, eye + random.direction(), random.between(0.01, 2.5), 1280, 720);
}

TEST(CoarseKeys, NoStrideWithAKeyBelowTheFloorIsPassedOver) {
    test::SeededRandom random(kSeed);
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
            // A floor just above the least key of a stride: the stride must not be skipped.
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

}  // namespace terrane::internal::coarse_keys_test

// The bound of docs/numerics.md for the rounding of keys, and hence of projected errors, against long double.

namespace terrane::internal::key_rounding_test {

using Long = long double;

static_assert(std::numeric_limits<Long>::digits >= 64, "the oracle needs 11 bits more than double");

constexpr std::uint64_t kSeed = 20261128;
constexpr Long kLoss = 0x1p-7L;     // loss of rounding 1 / bound^2 to 16 bits
constexpr Long kAbove = 0x1p-23L;   // derived: a key exceeds the exact one by at most this factor
constexpr Long kPixels = 0x1p-16L;  // what kRounding leaves for it beside the nesting of reaches
constexpr int kSquares = static_cast<int>(AreaVertices::kSquares);

struct Extremes {
    Long least = std::numeric_limits<Long>::infinity();  // key over exact key, for distant eyes
    Long most = 0;                                       // the same for all eyes
    long count = 0;
};

// A chunk of the finest level with the certified bounds of its vertices.
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

    // Compares the keys of all vertices, seen from a given distance from a sample of the chunk, with exact ones.
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
                    if (exact > Long{0x1p100}) continue;  // a bound near 0
                    const Long ratio = Long{found[k]} / exact;
                    extremes.most = std::max(extremes.most, ratio);
                    if (distance > 1e5) extremes.least = std::min(extremes.least, ratio);
                    ++extremes.count;
                }
            }
        }
    }

private:
    // The exact key from the source's bound and from the reach without rounding margins; reaches are at least one
    // quantum.
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
    struct Case {
        int spacing_log2;
        double origin, amplitude;
    };
    test::SeededRandom random(kSeed);
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
    // A pixel error is the inverse square root of a key. The factor covers the nesting of reaches and the rounding of
    // keys and of the root.
    const Long needed = std::sqrt(Long{kNestMargin} * (1 + kAbove)) * (1 + 4 * 0x1p-53L);
    EXPECT_LE(needed, Long{ScreenError::kRounding});
    EXPECT_GT(needed, Long{ScreenError::kRounding} - 2 * kPixels);
}

}  // namespace terrane::internal::key_rounding_test
