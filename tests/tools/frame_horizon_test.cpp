// SPDX-License-Identifier: MIT
#include "frames/frame_maker.h"
#include "frames/verification.h"
#include "support/meshes.h"

#include <terrane/terrain/fractal_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace frame_horizon_test {

constexpr double kTreeHeight = 8.0;
constexpr std::size_t kPause = 32;  // frames without a map after one that did not pay

std::shared_ptr<const HeightSource> hills() {
    static const std::shared_ptr<const HeightSource> source =
        FractalHeights::create({.seed = 3,
                                .octave_count = 9,
                                .amplitude = 120.0,
                                .wavelength_log2 = 10,
                                .root_size_log2 = 10})
            .value();
    return source;
}

SceneObjects forest() {
    SceneObjects objects;
    objects.meshes = {test::make_tree(8)};
    objects.files = {"tree.obj"};
    objects.scatters = {{0, {.per_km2 = 1500.0, .seed = 1}}};
    return objects;
}

// Frame i of a flight over the ground, which turns on its way.
View view_at(int i, double altitude) {
    View view;
    const double turn = 0.7 + 0.05 * i;
    const double x = -700.0 + 9.0 * i, y = 100.0 + 2.0 * i;
    view.eye_world = {x, y, hills()->height(x, y) + altitude};
    view.forward = Eigen::Vector3d(std::cos(turn), std::sin(turn), -0.05).normalized();
    const Eigen::Vector3d right = view.forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    view.up = right.cross(view.forward);
    view.width_px = 640;
    view.height_px = 360;
    return view;
}

std::unique_ptr<ObjectField> make_field(const std::optional<SunShadows>& shadows = {}) {
    return std::make_unique<ObjectField>(ObjectField::create(hills(), forest(),
                                                             {.max_error_px = 1.0,
                                                              .picture = view_at(0, 2.0),
                                                              .has_thread = false,
                                                              .shadows = shadows},
                                                             nullptr)
                                             .value());
}

FrameMaker make_maker(std::size_t budget, int worker_count = 1) {
    FrameMakerSettings settings;
    settings.pager.worker_count = 0;
    settings.triangulator.triangle_budget = budget;
    settings.triangulator.worker_count = worker_count;
    return FrameMaker::create(hills(), settings).value();
}

using Offset = std::array<float, 3>;

std::set<Offset> offsets_of(const SceneDraws& draws) {
    std::set<Offset> offsets;
    for (const ObjectInstance& instance : draws.instances) offsets.insert(instance.offset_eye);
    return offsets;
}

// Whether a segment goes below the displayed surface, at one of many of its points, denser near its start.
bool goes_below(const TriangleHeap& surface, const WorldPos& from, const WorldPos& to) {
    for (const int steps : {100, 20'000}) {
        for (int i = 0; i <= steps; ++i) {
            const WorldPos p = from + std::exp2(-12.0 * i / steps) * (to - from);
            const std::optional<double> height = surface.height(p.x(), p.y());
            if (height && *height >= p.z()) return true;
        }
    }
    return false;
}

bool shows(const View& view, const WorldPos& p) {
    const Frustum frustum = make_frustum(view);
    return std::all_of(frustum.normals.begin(), frustum.normals.end(),
                       [&](const auto& normal) { return normal.dot(p - view.eye_world) >= 0.0; });
}

TEST(FrameHorizon, NoObjectThatAFrameLeavesOutIsInSightOverItsGround) {
    for (const std::size_t budget : {4000u, 60'000u}) {
        FrameMaker maker = make_maker(budget);
        maker.set_objects(make_field());
        const std::unique_ptr<ObjectField> all = make_field();  // the same squares, all objects
        maker.load_until_stable(view_at(0, 2.0), {}, 0.0);
        all->load_all(view_at(0, 2.0));
        std::size_t occluded = 0, left_out = 0;
        for (int i = 0; i < 40; ++i) {
            const View view = view_at(i, i < 30 ? 2.0 : 60.0);
            const MadeFrame frame = maker.make({.view = view}, {}, 0.1 * i);
            all->begin_frame(view);
            const SceneDraws draws = all->end_frame(frame.mesh.demand_threshold_px);
            occluded += frame.record.objects_occluded;
            const FrameRecord& record = frame.record;
            EXPECT_LE(record.triangles, budget);
            EXPECT_EQ(record.objects_drawn + record.objects_culled + record.objects_left_out +
                          record.objects_occluded,
                      all->counts().drawn + all->counts().culled + all->counts().left_out);
            if (i % 4 != 0) continue;
            const std::set<Offset> drawn = offsets_of(frame.draws);
            const TriangleHeap surface = TriangleHeap::from(frame.mesh);
            for (const ObjectInstance& instance : draws.instances) {
                if (drawn.contains(instance.offset_eye)) continue;
                ++left_out;
                const auto& [x, y, z] = instance.offset_eye;
                const double height = kTreeHeight * static_cast<double>(instance.scale);
                for (const double share : {0.2, 0.99}) {
                    const WorldPos p =
                        view.eye_world +
                        Eigen::Vector3d(x, y, static_cast<double>(z) + share * height);
                    ASSERT_TRUE(!shows(view, p) || goes_below(surface, view.eye_world, p))
                        << "frame " << i << ", budget " << budget << ", tree at " << p.transpose();
                }
            }
        }
        EXPECT_GT(occluded, 1000u);
        EXPECT_GT(left_out, 20u);
    }
}

TEST(FrameHorizon, FramesAreTheSameOnOneAndTwoThreadsAndAgain) {
    using Row = std::tuple<std::size_t, double, double, std::size_t, std::size_t, std::size_t,
                           std::size_t, std::set<Offset>>;
    std::vector<std::vector<Row>> flights;
    for (const int worker_count : {1, 2, 1, 2}) {
        FrameMaker maker = make_maker(10'000, worker_count);
        maker.set_objects(make_field());
        maker.load_until_stable(view_at(0, 2.0), {}, 0.0);
        std::vector<Row>& rows = flights.emplace_back();
        std::size_t occluded = 0, without = 0;
        for (int i = 0; i < 60; ++i) {
            const double altitude = i % 30 < 20 ? 2.0 : 600.0;
            const MadeFrame frame = maker.make({.view = view_at(i, altitude)}, {}, 0.1 * i);
            const FrameRecord& r = frame.record;
            rows.emplace_back(r.triangles, r.error_px, r.threshold_px, r.objects_drawn,
                              r.objects_culled, r.objects_left_out, r.objects_occluded,
                              offsets_of(frame.draws));
            occluded += r.objects_occluded;
            without += r.objects_occluded == 0 ? 1 : 0;
        }
        EXPECT_GT(occluded, 0u);
        EXPECT_GT(without, 0u);
        EXPECT_TRUE(rows == flights.front()) << worker_count << " threads";
    }
}

TEST(FrameHorizon, NothingIsHiddenUnderShadowsOrFromHighAbove) {
    for (const bool has_shadows : {true, false}) {
        FrameMaker maker = make_maker(10'000);
        maker.set_objects(has_shadows ? make_field(SunShadows{.sun_direction = {1.0, 0.0, 0.5},
                                                              .distance = 500.0})
                                      : make_field());
        const double altitude = has_shadows ? 2.0 : 600.0;
        maker.load_until_stable(view_at(0, altitude), {}, 0.0);
        for (int i = 0; i < 3; ++i) {
            const MadeFrame frame = maker.make({.view = view_at(i, altitude)}, {}, 0.1 * i);
            EXPECT_EQ(frame.record.objects_occluded, 0u);
            EXPECT_GT(frame.record.objects_drawn, 100u);
        }
    }
}

class FrameHorizonOfHills : public testing::Test {
protected:
    FrameHorizonOfHills() {
        const std::array cameras{CameraNeed{.view = view, .threshold_px = 1.0}};
        pager.update(cameras, {}, 0.0);
        pager.finish();
    }

    TerrainMesh mesh(std::size_t budget) {
        triangulator = Triangulator::create(*hills(), {.triangle_budget = budget}).value();
        return triangulator->update(pager.resident(), view);
    }

    bool has_map() { return horizon.begin(pager.resident(), view) != nullptr; }

    // Frames without a map before the next one with one.
    std::size_t count_pause() {
        std::size_t count = 0;
        while (count < 1000 && !has_map()) ++count;
        return count;
    }

    View view = view_at(0, 2.0);
    Pager pager = Pager::create(hills(), {.worker_count = 0}).value();
    std::optional<Triangulator> triangulator;
    FrameHorizon horizon;
};

TEST_F(FrameHorizonOfHills, PaysFromAQuarterOfTheObjectsOnAndInUseFromAFifthOn) {
    const auto pays = [&](std::size_t occluded, double share) {
        return horizon.pays({.occluded = occluded, .occluded_share = share});
    };
    ASSERT_TRUE(has_map()) << "the first frame tries";
    EXPECT_FALSE(pays(1000, 0.24));
    EXPECT_TRUE(pays(0, 0.0)) << "the frame has no map any more";
    EXPECT_EQ(count_pause(), kPause);
    EXPECT_FALSE(pays(299, 0.9)) << "too few objects";
    EXPECT_EQ(count_pause(), kPause);
    EXPECT_TRUE(pays(1000, 0.25));
    EXPECT_EQ(count_pause(), 0u);
    EXPECT_TRUE(pays(1000, 0.2));
    EXPECT_EQ(count_pause(), 0u);
    EXPECT_FALSE(pays(1000, 0.19));
    EXPECT_EQ(count_pause(), kPause);
    EXPECT_FALSE(pays(1000, 0.24)) << "it is not in use any more";
}

TEST_F(FrameHorizonOfHills, HasNoMapWhereAFrameHasTooFewObjectsToHide) {
    const TerrainMesh frame = mesh(20'000);
    horizon.end(frame, {.drawn = 200, .occluded = 99});
    EXPECT_EQ(count_pause(), 1000u);
    horizon.end(frame, {.drawn = 200, .occluded = 100});
    EXPECT_EQ(count_pause(), 0u);
}

TEST_F(FrameHorizonOfHills, IsLeftOutWhereAFrameHasLargerErrorsThanTheLastOne) {
    horizon.follow(mesh(20'000));
    ASSERT_TRUE(has_map());
    EXPECT_TRUE(horizon.holds_for(mesh(20'000)));
    EXPECT_TRUE(horizon.holds_for(mesh(19'000))) << "a little larger";
    EXPECT_FALSE(horizon.holds_for(mesh(500)));
    EXPECT_TRUE(horizon.holds_for(mesh(500))) << "the frame has no map any more";
    EXPECT_EQ(count_pause(), kPause);
}

}  // namespace frame_horizon_test
}  // namespace terrane::tools
