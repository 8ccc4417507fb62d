// SPDX-License-Identifier: MIT
// Invalid and extreme inputs: each has a defined result, an error or a mesh that is watertight, within its budget and
// certified.
#include "support/heights/wave_heights.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace terrane {
namespace bad_input_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;
constexpr std::size_t kBudget = 3'000;

// 2 x 2 roots of three levels, all of them resident.
struct World {
    World() : source(test::small_world(2, 2.0), 25.0, 300.0) {
        std::vector<std::shared_ptr<const Chunk>> chunks;
        const Lattice& lattice = source.lattice();
        for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
            const std::int32_t count = 2 << level;
            for (std::int32_t y = -count / 2; y < count / 2; ++y) {
                for (std::int32_t x = -count / 2; x < count / 2; ++x) {
                    chunks.push_back(make_chunk(source, {x, y, level}).value());
                }
            }
        }
        resident = std::make_shared<const ResidentSet>(lattice, source.extent(), chunks, 1);
    }

    test::WaveHeights source;
    std::shared_ptr<const ResidentSet> resident;
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
    const TerrainMesh before = triangulator.update(world().resident, good_view());
    ASSERT_GT(before.triangle_count, 100u);
    const std::vector<std::uint16_t> indices(before.indices.begin(), before.indices.end());
    std::uint64_t refused = 0;
    for (const OddView& row : refused_views()) {
        SCOPED_TRACE(row.what);
        View view = good_view();
        row.spoil(view);
        const Result<void> good = check(view);
        ASSERT_FALSE(good.has_value());
        EXPECT_FALSE(good.error().message.empty());
        const TerrainMesh mesh = triangulator.update(world().resident, view);
        EXPECT_EQ(mesh.status, MeshStatus::invalid_view);
        EXPECT_EQ(mesh.refused_views, ++refused);
        EXPECT_EQ(std::vector(mesh.indices.begin(), mesh.indices.end()), indices);
        EXPECT_EQ(test::find_flaw(mesh), "");
        EXPECT_LE(mesh.triangle_count, kBudget);
    }
    EXPECT_NE(triangulator.update(world().resident, good_view()).status, MeshStatus::invalid_view);
}

TEST(BadInput, IsRefusedInAVeryFirstView) {
    for (const OddView& row : refused_views()) {
        SCOPED_TRACE(row.what);
        View view = good_view();
        row.spoil(view);
        Triangulator triangulator = Triangulator::create(world().source, {}).value();
        const TerrainMesh mesh = triangulator.update(world().resident, view);
        EXPECT_EQ(mesh.status, MeshStatus::invalid_view);
        EXPECT_EQ(mesh.triangle_count, 0u);
        EXPECT_TRUE(mesh.chunks.empty());
    }
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

TEST(BadInput, DoesNotReachThePager) {
    const auto source = std::make_shared<test::WaveHeights>(test::small_world(2, 2.0), 25.0, 300.0);
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    std::uint64_t refused = 0;
    for (const OddView& row : refused_views()) {
        SCOPED_TRACE(row.what);
        CameraNeed camera{.view = good_view()};
        row.spoil(camera.view);
        pager.update({&camera, 1}, {}, 0.0);
        EXPECT_EQ(pager.stats().refused_needs, ++refused);
    }
    EXPECT_TRUE(pager.resident()->has_roots());
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
                for (const std::size_t budget : {std::size_t{8}, std::size_t{9}, kBudget}) {
                    SCOPED_TRACE(testing::Message()
                                 << where << ", looking " << whither << ", field of view " << fov
                                 << ", budget " << budget);
                    // far enough to be another position in double precision
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

}  // namespace bad_input_test
}  // namespace terrane
