// SPDX-License-Identifier: MIT
// Sources with invalid answers: heights, bounds, intervals and rise bounds that are huge, infinite or NaN. Chunks that
// would break a mesh are refused and counted; meshes are always watertight and within their budget.
#include "support/heights/wave_heights.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane {
namespace absurd_heights_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBudget = 600;

// Waves with some wrong answers.
class AbsurdHeights final : public HeightSource {
public:
    enum class Answer { height, vertex_bound, cell_bound, interval, rise };

    AbsurdHeights(const Lattice& lattice, Answer answer, double value)
        : HeightSource(lattice, test::whole_extent(lattice)),
          waves_(lattice, 25.0, 300.0),
          answer_(answer),
          value_(value) {}

    double height(double x, double y) const override { return waves_.height(x, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> out) const override {
        auto done = waves_.sample(grid, out);
        spoil(Answer::height, grid, grid.columns, out);
        return done;
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> out) const override {
        auto done = waves_.vertex_bounds(grid, out);
        if (answer_ == Answer::height) {
            // Right for such heights, or the chunk is refused for its bounds.
            for (float& bound : out) {
                if (bound > 0.0f) bound += static_cast<float>(2.0 * std::abs(value_) + 100.0);
            }
        }
        spoil(Answer::vertex_bound, grid, grid.columns, out);
        return done;
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> out) const override {
        auto done = waves_.cell_bounds(grid, out);
        spoil(Answer::cell_bound, grid, grid.columns - 1, out);
        return done;
    }
    HeightInterval interval(const WorldRect& rect) const override {
        if (answer_ != Answer::interval) return waves_.interval(rect);
        return {-value_, value_};
    }
    double rise_bound(double distance) const override {
        return answer_ == Answer::rise ? value_ : waves_.rise_bound(distance);
    }

private:
    // A rectangle of the lattice, the same in every grid.
    template <typename Number>
    void spoil(Answer answer, const SampleGrid& grid, int columns, std::span<Number> out) const {
        if (answer != answer_) return;
        for (std::size_t i = 0; i < out.size(); ++i) {
            const auto at = static_cast<std::int64_t>(i);
            const std::int64_t x = grid.corner.x + at % columns * grid.step;
            const std::int64_t y = grid.corner.y + at / columns * grid.step;
            if (x > 10 && x < 90 && y > 20 && y < 60) out[i] = static_cast<Number>(value_);
        }
    }

    test::WaveHeights waves_;
    Answer answer_;
    double value_;
};

using Answer = AbsurdHeights::Answer;

const char* name_of(Answer answer) {
    switch (answer) {
        case Answer::height:
            return "height";
        case Answer::vertex_bound:
            return "bound of a vertex";
        case Answer::cell_bound:
            return "bound of a cell";
        case Answer::interval:
            return "interval";
        case Answer::rise:
            return "rise";
    }
    return "";
}

TEST(AbsurdHeights, NeverSpoilAMesh) {
#if TERRANE_ASSERTS
    GTEST_SKIP() << "builds with asserts end at the first broken promise of a source";
#endif
    const View view = look_at({0, -40, 100}, {0, 0, 0}, 1.0, 640, 480).value();
    View pinhole = look_at({30, 40, 0}, {200, 300, 0}, 1.0, 640, 480).value();
    pinhole.near_distance = 1e-30;
    for (const Answer answer : {Answer::height, Answer::vertex_bound, Answer::cell_bound,
                                Answer::interval, Answer::rise}) {
        for (const double value : {1e6, 1e11, 1e15, 1e19, 1e20, 1e28, 1e30, 1e33, 3.4e38, -1.0,
                                   -1e30, 1e300, kInfinity, -kInfinity, kNaN}) {
            SCOPED_TRACE(std::string(name_of(answer)) + " of " + std::to_string(value));
            // Coarse quanta, so that they do not limit heights.
            Lattice lattice = test::small_world(1, 2.0);
            lattice.quantum = 0x1p10;
            const auto source = std::make_shared<AbsurdHeights>(lattice, answer, value);
            Pager pager = Pager::create(source, {.worker_count = 0}).value();
            Triangulator triangulator =
                Triangulator::create(*source, {.triangle_budget = kBudget}).value();
            const CameraNeed camera{.view = view, .threshold_px = 0.1};
            const BodyNeed body{.centre_world = {30, 40, 10}, .velocity = {5, 0, -3}};
            for (int frame = 0; frame < 3; ++frame) {
                pager.update({&camera, 1}, {&body, 1}, 0.2 * frame);
                const TerrainMesh mesh = triangulator.update(pager.resident(), view);
                ASSERT_LE(mesh.triangle_count, kBudget);
                ASSERT_FALSE(std::isnan(mesh.error_px));
                if (mesh.status == MeshStatus::not_resident && mesh.chunks.empty()) continue;
                ASSERT_EQ(test::find_flaw(mesh), "");
                ASSERT_TRUE(std::isfinite(mesh.error_px));
                // Through a pinhole in the ground, where squares of distances vanish.
                const TerrainMesh close = triangulator.update(pager.resident(), pinhole);
                ASSERT_LE(close.triangle_count, kBudget);
                ASSERT_FALSE(std::isnan(close.error_px));
                ASSERT_EQ(test::find_flaw(close), "");
            }
            const bool is_of_chunks = answer != Answer::interval && answer != Answer::rise;
            const bool is_possible =
                value >= (answer == Answer::height ? -kMostHeight : 0.0) && value <= kMostHeight;
            if (is_of_chunks) {
                // Refused and counted, and absent chunks are no ground.
                EXPECT_EQ(pager.stats().failed == 0, is_possible);
            }
        }
    }
}

TEST(AbsurdHeights, AreRefusedWithTheirValueAndPlace) {
    const Lattice lattice = test::small_world(0, 2.0);
    const auto message_of = [&](Answer answer, double value) {
        const AbsurdHeights source(lattice, answer, value);
        const auto made = make_chunk(source, {0, 0, 0});
        EXPECT_FALSE(made.has_value());
        if (made) return std::string();
        EXPECT_EQ(made.error().code, ErrorCode::bad_data);
        return made.error().message;
    };
    const std::string height = message_of(Answer::height, 1e30);
    EXPECT_NE(height.find("1e+30 m at x 22 m, y 42 m"), std::string::npos) << height;
    const std::string bound = message_of(Answer::vertex_bound, 1e30);
    EXPECT_NE(bound.find("bound of 1e+30 m"), std::string::npos) << bound;
    EXPECT_NE(message_of(Answer::cell_bound, kNaN).find("nan"), std::string::npos);
}

TEST(AbsurdHeights, AQuantumOutOfRangeIsRefused) {
    Lattice lattice = test::small_world(0, 2.0);
    for (const double quantum :
         {0x1p-61, 0x1p-1000, 0x1p21, 0x1p1000, 0.3, -1.0, 0.0, kNaN, kInfinity}) {
        lattice.quantum = quantum;
        const auto checked = check(lattice);
        ASSERT_FALSE(checked.has_value()) << quantum;
        EXPECT_NE(checked.error().message.find("quantum"), std::string::npos);
    }
    for (const double quantum : {0x1p-60, 0x1p-12, 0x1p20}) {
        lattice.quantum = quantum;
        EXPECT_TRUE(check(lattice).has_value()) << quantum;
    }
}

}  // namespace absurd_heights_test
}  // namespace terrane
