// SPDX-License-Identifier: MIT
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground_window.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace terrane::ground_window_test {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Aabb box_at(double x, double y, double half = 0.5) {
    return {{x - half, y - half, 0.0}, {x + half, y + half, 1.0}};
}

// 4 x 4 chunks of 128 m in four variants: original, other heights inside, with nodata, with replaced triangles.
class Pool {
public:
    static constexpr int kRoots = 4, kVariants = 4;

    Pool() {
        source_ = FractalHeights::create({.seed = 5,
                                          .octave_count = 8,
                                          .amplitude = 40.0,
                                          .wavelength_log2 = 7,
                                          .root_size_log2 = 7,
                                          .first_root_x = -2,
                                          .first_root_y = -2,
                                          .root_count_x = kRoots,
                                          .root_count_y = kRoots})
                      .value();
        for (std::int32_t y = 0; y < kRoots; ++y) {
            for (std::int32_t x = 0; x < kRoots; ++x) {
                const auto chunk = make_chunk(*source_, {x - 2, y - 2, std::uint8_t{0}}).value();
                const auto variant = [&](auto change) {
                    auto copy = std::make_shared<Chunk>(*chunk);
                    change(*copy);
                    return std::shared_ptr<const Chunk>(std::move(copy));
                };
                chunks_.push_back(
                    {chunk, variant([](Chunk& c) { c.heights[sample_index(60, 70)] += 4096; }),
                     variant([](Chunk& c) {
                         c.cell_flags.assign(kChunkCells * kChunkCells, cell_ground);
                         for (std::size_t i = 0; i < c.cell_flags.size(); i += 3)
                             c.cell_flags[i] = cell_outside;
                         for (std::size_t i = 5000; i < 6000; ++i) c.cell_flags[i] = cell_outside;
                     }),
                     variant([](Chunk& c) {
                         SolidTriangles t;
                         for (std::uint16_t i = 0; i < 32000; i = static_cast<std::uint16_t>(i + 7))
                             t.replaced.push_back(i);
                         c.solid = std::make_shared<const SolidSurface>(std::move(t));
                     })});
            }
        }
    }

    // @param variants of each chunk; negative: absent
    Ground ground(const std::array<int, kRoots * kRoots>& variants) const {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        for (std::size_t i = 0; i < variants.size(); ++i) {
            if (variants[i] >= 0)
                chunks.push_back(chunks_[i][static_cast<std::size_t>(variants[i])]);
        }
        return Ground(std::make_shared<const ResidentSet>(source_->lattice(), source_->extent(),
                                                          std::move(chunks), 1),
                      0);
    }

private:
    std::shared_ptr<const HeightSource> source_;
    std::vector<std::array<std::shared_ptr<const Chunk>, kVariants>> chunks_;
};

const Pool& shared_pool() {
    static const Pool pool;
    return pool;
}

std::uint8_t bits_of(const Ground& ground, std::int64_t column, std::int64_t row) {
    const GroundCell cell = ground.cell(column, row);
    if (cell.status == QueryStatus::outside) return 0;
    if (cell.status == QueryStatus::not_resident) return window_absent;
    std::uint8_t bits = window_ground;
    if (const SolidSurface* const solid = ground.solid(column, row)) {
        const std::size_t index =
            cell_index(static_cast<int>(column & 127), static_cast<int>(row & 127));
        if (solid->is_replaced(index, false)) bits |= window_south_replaced;
        if (solid->is_replaced(index, true)) bits |= window_north_replaced;
    }
    return bits;
}

double height_of(const Ground& ground, std::int64_t column, std::int64_t row, double base,
                 double absent) {
    const double quantum = ground.lattice().quantum;
    if (const GroundCell c = ground.cell(column, row); c.status == QueryStatus::ok)
        return quantum * c.south_west - base;
    if (const GroundCell c = ground.cell(column - 1, row); c.status == QueryStatus::ok)
        return quantum * c.south_east - base;
    if (const GroundCell c = ground.cell(column, row - 1); c.status == QueryStatus::ok)
        return quantum * c.north_west - base;
    if (const GroundCell c = ground.cell(column - 1, row - 1); c.status == QueryStatus::ok)
        return quantum * c.north_east - base;
    return absent;
}

struct Held {
    std::map<std::pair<std::int64_t, std::int64_t>, double> heights;
    std::map<std::pair<std::int64_t, std::int64_t>, std::uint8_t> cells;
};

// Compares all contents of a window with the ground.
Held expect_equals(const GroundWindow& window, const Ground& ground) {
    Held held;
    const double base = window.settings().base, absent = window.settings().absent_height;
    const SampleRect samples = window.samples();
    for (std::int64_t row = samples.south; row <= samples.north; ++row) {
        for (std::int64_t column = samples.west; column <= samples.east; ++column) {
            const double expected = height_of(ground, column, row, base, absent);
            const std::size_t index = window.index_of(column, row);
            if (!window.doubles().empty()) {
                EXPECT_EQ(window.doubles()[index], expected);
            }
            if (!window.floats().empty()) {
                EXPECT_EQ(window.floats()[index], static_cast<float>(expected));
            }
            held.heights[{column, row}] = expected;
            if (!window.has_cell(column, row)) continue;
            EXPECT_EQ(window.cell_bits()[index], bits_of(ground, column, row));
            held.cells[{column, row}] = bits_of(ground, column, row);
        }
    }
    return held;
}

bool is_listed(std::span<const SampleRect> rects, std::int64_t column, std::int64_t row) {
    return std::any_of(rects.begin(), rects.end(), [&](const SampleRect& rect) {
        return column >= rect.west && column <= rect.east && row >= rect.south && row <= rect.north;
    });
}

void expect_lists_changes(const GroundWindow& window, const Held& before, const Held& now) {
    for (const auto& [place, height] : now.heights) {
        const auto old = before.heights.find(place);
        if (old != before.heights.end() && old->second == height) continue;
        EXPECT_TRUE(is_listed(window.changed(), place.first, place.second));
    }
    for (const auto& [place, bits] : now.cells) {
        const auto old = before.cells.find(place);
        if (old != before.cells.end() && old->second == bits) continue;
        const auto [x, y] = place;
        const auto changed = window.changed();
        EXPECT_TRUE(is_listed(changed, x, y) || is_listed(changed, x + 1, y) ||
                    is_listed(changed, x, y + 1) || is_listed(changed, x + 1, y + 1));
    }
    for (const SampleRect& rect : window.changed()) EXPECT_FALSE(rect.is_empty());
}

TEST(GroundWindow, HoldsTheGroundAfterRandomMotionsAndPaging) {
    const Pool& pool = shared_pool();
    long compared = 0, covered = 0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        SeededRandom random(seed);
        GroundWindowSettings settings{.columns = 1 + random.below(70),
                                      .rows = 1 + random.below(70)};
        settings.margin = random.below((std::min(settings.columns, settings.rows) - 1) / 2 + 1);
        settings.base = random.between(-50.0, 50.0);
        settings.absent_height = random.below(2) == 0 ? 0.0 : -7.0;
        settings.heights = static_cast<WindowHeights>(random.below(3));
        settings.move = static_cast<WindowMove>(random.below(2));
        GroundWindow window = GroundWindow::create(settings).value();
        std::array<int, 16> variants{};
        double x = 0.0, y = 0.0;
        Held before;
        for (int step = 0; step < 40 && !testing::Test::HasFailure(); ++step) {
            if (random.below(3) == 0) {
                for (int i = 0; i < 3; ++i)
                    variants[static_cast<std::size_t>(random.below(16))] = random.below(5) - 1;
            }
            if (random.below(12) == 0) {
                x = random.between(-400.0, 400.0), y = random.between(-400.0, 400.0);
            }
            x += random.between(-6.0, 6.0), y += random.between(-6.0, 6.0);
            std::vector<Aabb> boxes{box_at(x, y)};
            if (random.below(4) == 0)
                boxes.push_back(box_at(x + random.between(-30.0, 30.0), y, 2.0));
            if (random.below(5) == 0) boxes.insert(boxes.begin(), box_at(kNan, y));
            if (random.below(25) == 0) boxes.clear();
            if (random.below(25) == 0) {
                window.set_base(random.between(-50.0, 50.0));
                before = {};
            }
            const Ground ground = pool.ground(variants);
            const WindowUpdate update = window.update(ground, boxes);
            if (window.samples().is_empty()) continue;
            ++compared;
            const Held now = expect_equals(window, ground);
            expect_lists_changes(window, before, now);
            for (const Aabb& box : boxes) {
                if (!update.covers_boxes || !box.low.allFinite()) continue;
                ++covered;
                const WorldRect& e = ground.extent();
                EXPECT_TRUE(
                    window.has_cell(ground.column_at(std::clamp(box.low.x(), e.west, e.east)),
                                    ground.row_at(std::clamp(box.high.y(), e.south, e.north))));
            }
            before = now;
        }
    }
    EXPECT_GT(compared, 8);
    EXPECT_GT(covered, 8);
}

TEST(GroundWindow, ReadsOnlyWhatEntersWhenItMoves) {
    const Pool& pool = shared_pool();
    const Ground ground = pool.ground({});
    GroundWindow window = GroundWindow::create({.columns = 100, .rows = 60, .margin = 4}).value();
    EXPECT_EQ(window.update(ground, box_at(0.5, 0.5, 0.25)).read_samples, 101 * 61);
    const CellRange before = window.cells();
    const auto column = static_cast<double>(before.east);
    // within the margin nothing is read; one cell beyond it, one column is
    EXPECT_EQ(window.update(ground, box_at(column - 3.5, 0.5, 0.25)).read_samples, 0);
    EXPECT_TRUE(window.changed().empty());
    const WindowUpdate moved = window.update(ground, box_at(column - 2.5, 0.5, 0.25));
    EXPECT_TRUE(moved.has_moved);
    EXPECT_EQ(moved.read_samples, 61);
    ASSERT_EQ(window.changed().size(), 1u);
    EXPECT_EQ(window.changed()[0],
              (SampleRect{before.east + 2, before.south, before.east + 2, before.north + 1}));
    expect_equals(window, ground);
}

TEST(GroundWindow, ReadsOnlyTheChunkThatArrives) {
    const Pool& pool = shared_pool();
    std::array<int, 16> variants{};
    variants[10] = -1;  // north-east of the origin
    const Ground without = pool.ground(variants);
    GroundWindow window = GroundWindow::create({.columns = 40, .rows = 40}).value();
    window.update(without, box_at(0.0, 0.0));
    EXPECT_EQ(window.cell_bits()[window.index_of(3, 3)], window_absent);
    EXPECT_EQ(window.update(without, box_at(0.0, 0.0)).read_samples, 0);
    // another set of the same chunks
    EXPECT_EQ(window.update(pool.ground(variants), box_at(0.0, 0.0)).read_samples, 0);
    const Ground with = pool.ground({});
    const WindowUpdate update = window.update(with, box_at(0.0, 0.0));
    const std::int64_t side = window.samples().east + 1;
    EXPECT_EQ(update.read_samples, side * side);
    EXPECT_EQ(window.cell_bits()[window.index_of(3, 3)], window_ground);
    expect_equals(window, with);
}

TEST(GroundWindow, CopiesRectanglesAcrossTheWrapOfItsArrays) {
    const Pool& pool = shared_pool();
    const Ground ground = pool.ground({});
    GroundWindow window =
        GroundWindow::create({.columns = 30, .rows = 30, .heights = WindowHeights::both}).value();
    for (const double x : {-70.0, -20.0, -1.0, 33.0}) {
        window.update(ground, box_at(x, -x));
        const SampleRect all = window.samples();
        std::vector<double> doubles(31 * 31);
        std::vector<float> floats(31 * 31);
        std::vector<std::uint8_t> bits(30 * 30);
        window.copy_heights(all, doubles);
        window.copy_heights(all, floats);
        window.copy_cells(window.cells(), bits);
        for (std::size_t row = 0; row < 31; ++row) {
            for (std::size_t column = 0; column < 31; ++column) {
                const std::int64_t c = all.west + static_cast<std::int64_t>(column);
                const std::int64_t r = all.south + static_cast<std::int64_t>(row);
                EXPECT_EQ(doubles[row * 31 + column], height_of(ground, c, r, 0.0, 0.0));
                EXPECT_EQ(floats[row * 31 + column],
                          static_cast<float>(height_of(ground, c, r, 0.0, 0.0)));
                if (row < 30 && column < 30) {
                    EXPECT_EQ(bits[row * 30 + column], window_ground);
                }
            }
        }
    }
}

TEST(GroundWindow, SurvivesBoxesThatAreNotFiniteOrEnormous) {
    const Pool& pool = shared_pool();
    const Ground ground = pool.ground({});
    GroundWindow window = GroundWindow::create({.columns = 20, .rows = 20, .margin = 2}).value();
    EXPECT_EQ(window.update(ground, box_at(kNan, 0.0)).refused_boxes, 1);
    EXPECT_TRUE(window.samples().is_empty());
    EXPECT_EQ(window.update(ground, std::span<const Aabb>()).read_samples, 0);
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(window.update(ground, box_at(0.0, 0.0, infinity)).refused_boxes, 1);
    EXPECT_EQ(window.update(ground, Aabb{{1.0, 0.0, 0.0}, {0.0, 1.0, 1.0}}).refused_boxes, 1);

    EXPECT_FALSE(window.update(ground, box_at(0.0, 0.0, 1e9)).covers_boxes);
    EXPECT_TRUE(window.has_cell(0, 0)) << "centred on the box";
    expect_equals(window, ground);
    for (const double far : {1e9, -1e9, 1e300}) {
        EXPECT_TRUE(window.update(ground, box_at(far, far)).covers_boxes);
        EXPECT_TRUE(window.has_cell(far > 0 ? 255 : -256, far > 0 ? 255 : -256));
        expect_equals(window, ground);
    }
}

TEST(GroundWindow, StartsAnewOnAnotherLatticeOrLevel) {
    const auto source = FractalHeights::create({.octave_count = 4, .root_size_log2 = 8}).value();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (std::int32_t y = -1; y <= 0; ++y) {
        for (std::int32_t x = -1; x <= 0; ++x)
            chunks.push_back(make_chunk(*source, {x, y, std::uint8_t{0}}).value());
    }
    const auto set =
        std::make_shared<const ResidentSet>(source->lattice(), source->extent(), chunks, 1);
    GroundWindow window = GroundWindow::create({.columns = 20, .rows = 20}).value();
    const Ground coarse(set, 0), fine(set, 1);
    window.update(coarse, box_at(5.0, 5.0));
    expect_equals(window, coarse);
    window.update(fine, box_at(5.0, 5.0));
    expect_equals(window, fine);
    EXPECT_EQ(window.cell_bits()[window.index_of(5, 5)], window_absent);
    const Ground other = test::make_test_ground([](double x, double) { return x; }, 0.5, 1);
    window.update(other, box_at(30.0, 30.0));
    expect_equals(window, other);
    EXPECT_TRUE(window.has_cell(60, 60));
}

TEST(GroundWindow, RefusesSettingsOutOfRangeInOneLine) {
    const auto message = [](const GroundWindowSettings& settings) {
        const auto window = GroundWindow::create(settings);
        return window ? std::string("accepted") : window.error().message;
    };
    EXPECT_EQ(message({.columns = 0}), "columns must be 1 to 8191, got 0");
    EXPECT_EQ(message({.rows = 1'000'000'000}), "rows must be 1 to 8191, got 1000000000");
    EXPECT_EQ(message({.columns = 10, .margin = 5}), "margin must be 0 to 4, got 5");
    EXPECT_EQ(message({.base = kNan}).substr(0, 12), "base must be");
    EXPECT_EQ(message({.absent_height = kNan}).substr(0, 13), "absent_height");
    EXPECT_EQ(message({.columns = 1, .rows = 1, .margin = 0}), "accepted");
}

}  // namespace terrane::ground_window_test
