// SPDX-License-Identifier: MIT
// Tightness of certificates: error_px against the error measured at 4 x 4 points of every cell in view, with all chunks
// resident and with half of them withheld.
#include "support/mesh_checks.h"
#include "support/random.h"

#include <terrane/dem/dem_heights.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>

namespace terrane {
namespace tightness_test {

using test::Random;

constexpr std::uint64_t kSeed = 71;
constexpr int kViews = TERRANE_VIEW_FACTOR;
constexpr double kLeast_px = 0.5;  // smaller errors are not compared

struct Ground {
    const char* name;
    std::function<std::shared_ptr<const HeightSource>()> open;
    double largest_ratio;   // published limit of certified over measured: of the first view
    double largest_of_ten;  // ... and of ten views
};

void PrintTo(const Ground& ground, std::ostream* out) { *out << ground.name; }

std::shared_ptr<const HeightSource> open_fractal(FractalKind kind) {
    return FractalHeights::create({.seed = 23,
                                   .kind = kind,
                                   .octave_count = 10,
                                   .amplitude = 60.0,
                                   .wavelength_log2 = 8,
                                   .root_size_log2 = 9,
                                   .first_root_x = 0,
                                   .first_root_y = 0,
                                   .root_count_x = 1,
                                   .root_count_y = 1})
        .value();
}

std::shared_ptr<const HeightSource> open_jacksboro() {
    return DemHeights::open(TERRANE_SOURCE_DIR "/tools/data/jacksboro.tif", {}).value();
}

// All chunks of a world, parents first.
std::vector<std::shared_ptr<const Chunk>> make_all(const HeightSource& source) {
    std::vector<std::shared_ptr<const Chunk>> chunks;
    const Lattice& lattice = source.lattice();
    for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
        const std::int32_t count_x = lattice.root_count_x << level;
        const std::int32_t count_y = lattice.root_count_y << level;
        for (std::int32_t y = 0; y < count_y; ++y) {
            for (std::int32_t x = 0; x < count_x; ++x) {
                const ChunkKey key{(lattice.first_root_x << level) + x,
                                   (lattice.first_root_y << level) + y, level};
                chunks.push_back(make_chunk(source, key).value());
            }
        }
    }
    return chunks;
}

// Without about half of the chunks: those drawn, and what lies below them.
std::vector<std::shared_ptr<const Chunk>> withhold_half(
    Random& random, const std::vector<std::shared_ptr<const Chunk>>& all) {
    std::vector<std::shared_ptr<const Chunk>> kept;
    for (const auto& chunk : all) {
        const ChunkKey& key = chunk->key;
        const bool has_parent =
            key.level == 0 || std::any_of(kept.begin(), kept.end(), [&](const auto& other) {
                return other->key == key.parent();
            });
        const bool is_drawn = key.level > 0 && random.between(0.0, 1.0) < 0.4;
        if (has_parent && !is_drawn) kept.push_back(chunk);
    }
    return kept;
}

// Certified over measured error, over random views and budgets.
struct Ratios {
    double sum = 0.0, largest = 0.0;
    int count = 0;
    int uncertified_frames = 0;
};

Ratios measure_ratios(const Ground& ground, double morph_ratio, bool is_half_withheld) {
    const auto source = ground.open();
    const auto all = make_all(*source);
    const WorldRect& extent = source->extent();
    const WorldPos middle(0.5 * (extent.west + extent.east), 0.5 * (extent.south + extent.north),
                          0.0);
    const double size = std::min(extent.east - extent.west, extent.north - extent.south);
    Random random(kSeed);
    Ratios ratios;
    for (int i = 0; i < kViews; ++i) {
        const double x = middle.x() + random.between(-0.35, 0.35) * (extent.east - extent.west);
        const double y = middle.y() + random.between(-0.35, 0.35) * (extent.north - extent.south);
        const double z = source->height(x, y);
        const View view = look_at({x, y, z + size * random.between(0.08, 0.3)},
                                  middle + WorldPos(1.0, 2.0, z), 0.9, 1280, 720)
                              .value();
        const auto set = std::make_shared<const ResidentSet>(
            source->lattice(), extent, is_half_withheld ? withhold_half(random, all) : all, 1);
        for (const std::size_t budget : {1'500u, 15'000u, 150'000u}) {
            Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = budget,
                                                                       .max_error_px = 0.6,
                                                                       .morph_ratio = morph_ratio})
                                            .value();
            const TerrainMesh mesh = triangulator.update(set, view);
            const double measured =
                test::measure_error_px_everywhere(test::make_soup(mesh), *source, view, 4);
            ratios.uncertified_frames += measured <= mesh.error_px ? 0 : 1;
            if (mesh.error_px < kLeast_px) continue;
            const double ratio = mesh.error_px / measured;
            ratios.sum += ratio;
            ratios.largest = std::max(ratios.largest, ratio);
            ++ratios.count;
        }
    }
    std::printf(
        "%s, morph ratio %g, %s resident: certified over measured %.3f on average, %.3f at most in "
        "%d frames (seed %llu)\n",
        ground.name, morph_ratio, is_half_withheld ? "half" : "all", ratios.sum / ratios.count,
        ratios.largest, ratios.count, static_cast<unsigned long long>(kSeed));
    return ratios;
}

class Certificate : public testing::TestWithParam<Ground> {};

TEST_P(Certificate, HoldsAtSixteenPointsOfEveryCell) {
    for (const bool is_half_withheld : {false, true}) {
        const Ratios ratios =
            measure_ratios(GetParam(), TriangulatorSettings{}.morph_ratio, is_half_withheld);
        EXPECT_EQ(ratios.uncertified_frames, 0);
        EXPECT_GE(ratios.count, 2 * kViews);
    }
}

class TightCertificate : public testing::TestWithParam<Ground> {};

TEST_P(TightCertificate, IsAsTightAsPublished) {
    for (const double morph_ratio : {TriangulatorSettings{}.morph_ratio, 1.0}) {
        for (const bool is_half_withheld : {false, true}) {
            EXPECT_LE(measure_ratios(GetParam(), morph_ratio, is_half_withheld).largest,
                      kViews == 1 ? GetParam().largest_ratio : GetParam().largest_of_ten);
        }
    }
}

// The ratios are published in docs/triangulation.md. For the last three 2.5 is the aim: octaves that are weighted by
// the octaves before them, and noise at warped positions, have looser a-priori bounds than a plain sum.
std::vector<Ground> grounds() {
    return {{"jacksboro", open_jacksboro, 1.4, 1.4},
            {"fbm", [] { return open_fractal(FractalKind::fbm); }, 2.5, 3.0},
            {"ridged", [] { return open_fractal(FractalKind::ridged); }, 3.0, 4.5},
            {"hybrid", [] { return open_fractal(FractalKind::hybrid); }, 3.0, 4.5},
            {"warped", [] { return open_fractal(FractalKind::warped); }, 3.0, 4.5}};
}

constexpr auto kName = [](const auto& made) { return std::string(made.param.name); };
INSTANTIATE_TEST_SUITE_P(All, Certificate, testing::ValuesIn(grounds()), kName);
INSTANTIATE_TEST_SUITE_P(All, TightCertificate, testing::ValuesIn(grounds()), kName);

}  // namespace tightness_test
}  // namespace terrane
