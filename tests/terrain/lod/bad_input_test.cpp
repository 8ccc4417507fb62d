// SPDX-License-Identifier: MIT
//
// Invalid and extreme inputs have a defined result: an error, or a mesh that is watertight, within its budget and
// certified.
#include "support/grounds.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/pager.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace terrane::bad_input_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;
constexpr std::size_t kBudget = 3'000;

// 2 x 2 roots of three levels, all resident.
struct World {
    test::WaveHeights source{test::small_world(2, 2.0), 25.0, 300.0};
    std::shared_ptr<const ResidentSet> resident = std::make_shared<const ResidentSet>(
        source.lattice(), source.extent(), test::all_chunks(source), 1);
};

const World& world() {
    static const World made;
    return made;
}

View good_view() { return look_at({10, 20, 120}, {200, 300, 0}, 1.0, 640, 360).value(); }

struct BadSettings {
    const char* what;
    TriangulatorSettings settings;
    const char* message_part;
};

TEST(BadInput, IsRefusedInSettingsWithTheFieldAndTheValue) {
    const std::vector<BadSettings> rows{
        {"no triangles", {.triangle_budget = 0}, "triangle_budget"},
        {"fewer than two a root", {.triangle_budget = 7}, "got 7"},
        {"a budget beyond all memory", {.triangle_budget = 1'000'000'001}, "got 1000000001"},
        {"a negative budget", {.triangle_budget = static_cast<std::size_t>(-1)}, "triangle_budget"},
        {"no error", {.max_error_px = 0.0}, "max_error_px"},
        {"a negative error", {.max_error_px = -1.0}, "max_error_px"},
        {"an error that is no number", {.max_error_px = kNaN}, "max_error_px"},
        {"an infinite error", {.max_error_px = kInfinity}, "max_error_px"},
        {"a morph ratio below 1", {.morph_ratio = 0.99}, "morph_ratio"},
        {"a morph ratio that is no number", {.morph_ratio = kNaN}, "morph_ratio"},
        {"an infinite morph ratio", {.morph_ratio = kInfinity}, "morph_ratio"},
        {"a morph ratio beyond 16", {.morph_ratio = 16.5}, "morph_ratio"},
        {"no workers", {.worker_count = 0}, "worker_count"},
        {"more workers than 64", {.worker_count = 65}, "worker_count"},
    };
    for (const BadSettings& row : rows) {
        SCOPED_TRACE(row.what);
        const Result<Triangulator> made = Triangulator::create(world().source, row.settings);
        ASSERT_FALSE(made.has_value());
        EXPECT_EQ(made.error().code, ErrorCode::invalid_argument);
        EXPECT_NE(made.error().message.find(row.message_part), std::string::npos)
            << made.error().message;
    }
    EXPECT_TRUE(Triangulator::create(world().source, {.triangle_budget = 8}).has_value());
}

struct OddView {
    const char* what;
    std::function<void(View&)> spoil;
};

const std::vector<OddView>& refused_views() {
    static const std::vector<OddView> rows{
        {"field of view 0", [](View& v) { v.vertical_fov = 0.0; }},
        {"negative field of view", [](View& v) { v.vertical_fov = -1.0; }},
        {"field of view of 180 degrees", [](View& v) { v.vertical_fov = kPi; }},
        {"field of view beyond 180 degrees", [](View& v) { v.vertical_fov = 3.5; }},
        {"field of view that is no number", [](View& v) { v.vertical_fov = kNaN; }},
        {"no width", [](View& v) { v.width_px = 0; }},
        {"no height", [](View& v) { v.height_px = 0; }},
        {"negative size", [](View& v) { v.width_px = v.height_px = -100; }},
        {"eye that is no number", [](View& v) { v.eye_world.z() = kNaN; }},
        {"infinite eye", [](View& v) { v.eye_world.x() = -kInfinity; }},
        {"no direction", [](View& v) { v.forward.setZero(); }},
        {"direction that is no number", [](View& v) { v.forward.x() = kNaN; }},
        {"direction of length 2", [](View& v) { v.forward *= 2.0; }},
        {"up along the view", [](View& v) { v.up = v.forward; }},
        {"no near distance", [](View& v) { v.near_distance = 0.0; }},
        {"negative near distance", [](View& v) { v.near_distance = -1.0; }},
        {"infinite near distance", [](View& v) { v.near_distance = kInfinity; }},
    };
    return rows;
}

TEST(BadInput, IsRefusedInViewsAndTheLastMeshStays) {
    Triangulator triangulator =
        Triangulator::create(world().source, {.triangle_budget = kBudget}).value();
    Triangulator without_mesh = Triangulator::create(world().source, {}).value();
    Pager pager =
        Pager::create(std::make_shared<test::WaveHeights>(world().source.lattice(), 25.0, 300.0),
                      {.worker_count = 0})
            .value();
    const TerrainMesh before = triangulator.update(world().resident, good_view());
    ASSERT_GT(before.triangle_count, 100u);
    const std::vector<std::uint16_t> indices(before.indices.begin(), before.indices.end());
    std::uint64_t refused = 0;
    for (const OddView& row : refused_views()) {
        SCOPED_TRACE(row.what);
        ++refused;
        View view = good_view();
        row.spoil(view);
        const Result<void> good = view.validate();
        ASSERT_FALSE(good.has_value());
        EXPECT_FALSE(good.error().message.empty());
        const TerrainMesh mesh = triangulator.update(world().resident, view);
        EXPECT_EQ(mesh.status, MeshStatus::invalid_view);
        EXPECT_EQ(mesh.refused_views, refused);
        EXPECT_EQ(std::vector(mesh.indices.begin(), mesh.indices.end()), indices);
        EXPECT_EQ(test::find_flaw(mesh), "");
        EXPECT_LE(mesh.triangle_count, kBudget);
        const TerrainMesh none = without_mesh.update(world().resident, view);
        EXPECT_EQ(none.status, MeshStatus::invalid_view);
        EXPECT_EQ(none.triangle_count, 0u);
        EXPECT_TRUE(none.chunks.empty());
        pager.update({{.view = view}}, {}, 0.0);
        EXPECT_EQ(pager.stats().refused_needs, refused);
    }
    EXPECT_NE(triangulator.update(world().resident, good_view()).status, MeshStatus::invalid_view);
    EXPECT_TRUE(pager.resident()->has_roots());
}

TEST(BadInput, IsRefusedInLookAt) {
    const WorldPos eye(1, 2, 3);
    EXPECT_FALSE(look_at(eye, eye, 1.0, 640, 480));
    EXPECT_FALSE(look_at(eye, {kNaN, 0, 0}, 1.0, 640, 480));
    EXPECT_FALSE(look_at(eye, {0, 0, 0}, 0.0, 640, 480));
    EXPECT_FALSE(look_at(eye, {0, 0, 0}, kPi, 640, 480));
    EXPECT_FALSE(look_at(eye, {0, 0, 0}, 1.0, 0, 480));
    EXPECT_FALSE(look_at(eye, {0, 0, 0}, 1.0, 640, -1));
    EXPECT_TRUE(look_at(eye, {0, 0, 0}, 1.0, 640, 480));
}

TEST(OddView, GetsAWholeMeshWithinBudgetAndCertificate) {
    const Lattice& lattice = world().source.lattice();
    const auto height_at = [&](std::int64_t x, std::int64_t y) {
        const double z = world().source.height(lattice.x(x), lattice.y(y));
        return lattice.quantum * std::round(z / lattice.quantum);
    };
    const std::vector<std::pair<const char*, WorldPos>> eyes{
        {"over the ground", {10, 20, 120}},
        {"under the ground", {0, 0, -5000}},
        {"just under the ground", {30, 40, world().source.height(30, 40) - 0.01}},
        {"in a vertex", {lattice.x(3), lattice.y(5), height_at(3, 5)}},
        {"in a corner of roots", {lattice.x(0), lattice.y(0), height_at(0, 0)}},
        {"on the world's edge", {lattice.x(lattice.west()), lattice.y(lattice.north()), 40}},
        {"outside the world", {9000, -100, 50}},
        {"1e9 m away", {1e9, -1e9, 1e9}},
        {"1e9 m below", {0, 0, -1e9}},
        {"1e15 m away", {-1e15, 3e14, 1e12}},
    };
    const std::vector<std::pair<const char*, Eigen::Vector3d>> directions{
        {"down", {0, 0, -1}},
        {"up", {0, 0, 1}},
        {"level", {1, 0, 0}},
        {"ahead and down", {3, 4, -2}},
    };
    for (const auto& [where, eye] : eyes) {
        for (const auto& [whither, direction] : directions) {
            for (const double fov : {1e-3, 0.01, 1.0, 3.1, kPi - 1e-6}) {
                for (const std::size_t budget : {std::size_t{8}, kBudget}) {
                    SCOPED_TRACE(testing::Message()
                                 << where << ", looking " << whither << ", field of view " << fov
                                 << ", budget " << budget);
                    // far enough for a different position in double precision
                    const double reach = std::max(100.0, 1e-3 * eye.norm());
                    const View view = look_at(eye, eye + reach * direction, fov, 64, 48).value();
                    Triangulator triangulator =
                        Triangulator::create(world().source,
                                             {.triangle_budget = budget, .open_chunks = 4})
                            .value();
                    const TerrainMesh mesh = triangulator.update(world().resident, view);
                    ASSERT_NE(mesh.status, MeshStatus::invalid_view);
                    EXPECT_LE(mesh.triangle_count, budget);
                    EXPECT_EQ(test::find_flaw(mesh), "");
                    EXPECT_TRUE(std::isfinite(mesh.error_px));
                    const int each = std::max(1, 1000 / static_cast<int>(mesh.triangle_count));
                    EXPECT_LE(
                        test::measure_error_px(test::make_soup(mesh), world().source, view, each),
                        mesh.error_px);
                }
            }
        }
    }
}

TEST(OddView, OfASinglePixelIsAView) {
    View view = good_view();
    view.width_px = view.height_px = 1;
    Triangulator triangulator =
        Triangulator::create(world().source, {.triangle_budget = kBudget}).value();
    const TerrainMesh mesh = triangulator.update(world().resident, view);
    EXPECT_EQ(mesh.status, MeshStatus::error_met);
    EXPECT_EQ(test::find_flaw(mesh), "");
}

}  // namespace terrane::bad_input_test

// Sources with invalid answers: heights, bounds, intervals and rise bounds that are huge, infinite or NaN. Chunks that
// would break a mesh are refused and counted; meshes stay watertight and within their budget.

namespace terrane::absurd_heights_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBudget = 600;

// Waves with one kind of answer replaced over part of the world.
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
            // Valid for such heights: otherwise the chunk would be refused for its bounds.
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
    // Replaces values in a fixed rectangle of the lattice, the same in every grid.
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

TEST(AbsurdHeights, NeverSpoilAMesh) {
#if TERRANE_ASSERTS
    GTEST_SKIP() << "builds with asserts end at the first broken promise of a source";
#endif
    const View view = look_at({0, -40, 100}, {0, 0, 0}, 1.0, 640, 480).value();
    View pinhole = look_at({30, 40, 0}, {200, 300, 0}, 1.0, 640, 480).value();
    pinhole.near_distance = 1e-30;
    long compared = 0;
    constexpr std::pair<Answer, const char*> kAnswers[] = {
        {Answer::height, "height"},
        {Answer::vertex_bound, "bound of a vertex"},
        {Answer::cell_bound, "bound of a cell"},
        {Answer::interval, "interval"},
        {Answer::rise, "rise"},
    };
    for (const auto& [answer, name] : kAnswers) {
        for (const double value : {1e6, 1e11, 1e15, 1e19, 1e20, 1e28, 1e30, 1e33, 3.4e38, -1.0,
                                   -1e30, 1e300, kInfinity, -kInfinity, kNaN}) {
            SCOPED_TRACE(testing::Message() << name << " of " << value);
            // Coarse quanta, so that they do not limit the heights.
            Lattice lattice = test::small_world(1, 2.0);
            lattice.quantum = 0x1p10;
            const auto source = std::make_shared<AbsurdHeights>(lattice, answer, value);
            Pager pager = Pager::create(source, {.worker_count = 0}).value();
            Triangulator triangulator =
                Triangulator::create(*source, {.triangle_budget = kBudget}).value();
            const BodyNeed body{.centre_world = {30, 40, 10}, .velocity = {5, 0, -3}};
            for (int frame = 0; frame < 3; ++frame) {
                pager.update({{.view = view, .threshold_px = 0.1}}, {&body, 1}, 0.2 * frame);
                const TerrainMesh mesh = triangulator.update(pager.resident(), view);
                ASSERT_LE(mesh.triangle_count, kBudget);
                ASSERT_FALSE(std::isnan(mesh.error_px));
                if (mesh.status == MeshStatus::not_resident && mesh.chunks.empty()) continue;
                ++compared;
                ASSERT_EQ(test::find_flaw(mesh), "");
                ASSERT_TRUE(std::isfinite(mesh.error_px));
                // A view through a pinhole inside the ground, where squared distances underflow.
                const TerrainMesh close = triangulator.update(pager.resident(), pinhole);
                ASSERT_LE(close.triangle_count, kBudget);
                ASSERT_FALSE(std::isnan(close.error_px));
                ASSERT_EQ(test::find_flaw(close), "");
            }
            const bool is_of_chunks = answer != Answer::interval && answer != Answer::rise;
            const bool is_possible =
                value >= (answer == Answer::height ? -kMostHeight : 0.0) && value <= kMostHeight;
            if (is_of_chunks) {
                // Such chunks are refused and counted; absent chunks are not ground.
                EXPECT_EQ(pager.stats().failed == 0, is_possible);
            }
        }
    }
    EXPECT_GT(compared, 10);
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
        const auto checked = lattice.validate();
        ASSERT_FALSE(checked.has_value()) << quantum;
        EXPECT_NE(checked.error().message.find("quantum"), std::string::npos);
    }
    for (const double quantum : {0x1p-60, 0x1p-12, 0x1p20}) {
        lattice.quantum = quantum;
        EXPECT_TRUE(lattice.validate().has_value()) << quantum;
    }
}

}  // namespace terrane::absurd_heights_test
