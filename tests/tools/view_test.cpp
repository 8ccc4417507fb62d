// SPDX-License-Identifier: MIT
#include "flight/flight_options.h"
#include "frames/frame_maker.h"
#include "support/grounds.h"
#include "support/random.h"
#include "view/free_camera.h"
#include "view/live_history.h"
#include "view/live_world.h"
#include "view/map_panel.h"
#include "view/marks.h"
#include "view/overlay.h"
#include "view/timeline.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/function_heights.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace terrane::tools {
namespace view_test {

constexpr double kDt = 1.0 / 60.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

WorldPos nowhere(const WorldPos&, const WorldPos& to) { return to; }

TEST(Timeline, TimeAdvancesByTheRateAndStopsAtTheEnd) {
    Timeline timeline(10.0);
    EXPECT_EQ(timeline.advance(1.0), 0.0);
    timeline.play();
    timeline.set_rate(4.0);
    EXPECT_EQ(timeline.advance(1.0), 4.0);
    EXPECT_EQ(timeline.time(), 4.0);
    EXPECT_EQ(timeline.advance(5.0), 6.0);
    EXPECT_EQ(timeline.time(), 10.0);
    EXPECT_FALSE(timeline.is_playing());
    timeline.play();
    EXPECT_EQ(timeline.time(), 0.0);
    timeline.set_loops(true);
    EXPECT_EQ(timeline.advance(3.0), 12.0);
    EXPECT_EQ(timeline.time(), 2.0);
    EXPECT_TRUE(timeline.is_playing());
    timeline.step(-5.0);
    EXPECT_EQ(timeline.time(), 0.0);
    EXPECT_FALSE(timeline.is_playing());
}

TEST(Timeline, ExtremesAreLimited) {
    Timeline timeline(5.0);
    for (const double rate : {0.0, -1.0, 1e300, kInfinity, std::nan("")}) {
        timeline.set_rate(rate);
        EXPECT_GE(timeline.rate(), Timeline::kLeastRate);
        EXPECT_LE(timeline.rate(), Timeline::kMostRate);
    }
    for (const double time : {-1.0, 1e300, kInfinity, std::nan("")}) {
        timeline.seek(time);
        EXPECT_GE(timeline.time(), 0.0);
        EXPECT_LE(timeline.time(), 5.0);
    }
    timeline.play();
    EXPECT_EQ(timeline.advance(std::nan("")), 0.0);
    Timeline endless(kInfinity);
    endless.play();
    EXPECT_EQ(endless.advance(1e9), 1e9);
    EXPECT_TRUE(endless.is_playing());
    Timeline empty(0.0);
    empty.set_loops(true);
    empty.play();
    EXPECT_EQ(empty.advance(1.0), 0.0);
    EXPECT_EQ(empty.time(), 0.0);
}

CameraPose level_pose() {
    CameraPose pose;
    pose.eye_world = {100.0, 200.0, 50.0};
    return pose;
}

void fly(FreeCamera& camera, const CameraControls& controls, double seconds,
         const FreeCamera::Stopper& stop = nowhere) {
    for (double t = 0.0; t < seconds; t += kDt) camera.move(controls, kDt, 50.0, stop);
}

TEST(FreeCamera, FliesWhereItLooksAndFasterHighUp) {
    FreeCamera camera(level_pose());
    fly(camera, {.move = {0.0, 1.0, 0.0}}, 2.0);
    const Eigen::Vector3d moved = camera.pose().eye_world - level_pose().eye_world;
    EXPECT_NEAR(moved.x(), 0.0, 1e-9);
    EXPECT_NEAR(moved.y(), 100.0, 10.0);  // at 50 m a second, less its start
    EXPECT_NEAR(moved.z(), 0.0, 1e-9);
    fly(camera, {}, 1.0);
    EXPECT_EQ(camera.pose().velocity.norm(), 0.0);
    FreeCamera low(level_pose());
    for (int i = 0; i < 60; ++i) low.move({.move = {1.0, 0.0, 0.0}}, kDt, 2.0, nowhere);
    EXPECT_NEAR(low.pose().eye_world.x() - 100.0, 8.0, 1.0);
}

TEST(FreeCamera, PosesAreOrthonormalAndWithoutRollWhateverIsDone) {
    const std::uint64_t seed = 20261130;
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    FreeCamera camera(level_pose());
    for (int i = 0; i < 5000; ++i) {
        if (i % 500 == 100) camera.orbit({random.between(-500, 500), 300.0, 20.0});
        if (i % 500 == 200) camera.fly_to({random.between(-500, 500), 100.0, 5.0}, 10.0);
        if (i % 500 == 300) camera.look_along(random.between(-10, 10));
        CameraControls controls;
        for (double& part : controls.move) part = random.between(-1.0, 1.0);
        controls.turn = random.between(-1.0, 1.0);
        controls.lift = random.between(-1.0, 1.0);
        controls.wheel = random.between(-3.0, 3.0);
        controls.is_fast = i % 7 == 0;
        const double dts[] = {0.0, 1e-4, kDt, 0.25};
        camera.move(controls, dts[i % 4], i % 11 == 0 ? std::nullopt : std::optional(30.0),
                    nowhere);
        const CameraPose pose = camera.pose();
        View view;
        view.eye_world = pose.eye_world;
        view.forward = pose.forward;
        view.up = pose.up;
        ASSERT_TRUE(view.validate()) << i << ": " << view.validate().error().message;
        ASSERT_NEAR(view.right().z(), 0.0, 1e-12) << i;
    }
}

TEST(FreeCamera, OrbitsKeepTheirDistanceAndFlightsEndBeforeTheirTarget) {
    FreeCamera camera(level_pose());
    const WorldPos centre(160.0, 280.0, 50.0);
    camera.orbit(centre);
    fly(camera, {.move = {1.0, 0.0, 0.0}}, 3.0);
    EXPECT_NEAR((camera.pose().eye_world - centre).norm(), 100.0, 1e-6);
    EXPECT_NEAR(camera.pose().forward.dot((centre - camera.pose().eye_world).normalized()), 1.0,
                1e-9);
    EXPECT_GT((camera.pose().eye_world - level_pose().eye_world).norm(), 50.0);
    camera.move({.wheel = 3.0}, kDt, {}, nowhere);
    EXPECT_NEAR((camera.pose().eye_world - centre).norm(), 100.0 / std::pow(1.25, 3), 1e-6);

    const WorldPos target(-300.0, 0.0, 20.0);
    camera.fly_to(target, 25.0);
    EXPECT_FALSE(camera.is_orbiting());
    fly(camera, {}, FreeCamera::kFlightTime + 0.1);
    EXPECT_NEAR((camera.pose().eye_world - target).norm(), 25.0, 1e-6);
    EXPECT_NEAR(camera.pose().forward.dot((target - camera.pose().eye_world).normalized()), 1.0,
                1e-9);
}

TEST(FreeCamera, WhatStopsTheEyeTakesItsSpeed) {
    FreeCamera camera(level_pose());
    const FreeCamera::Stopper wall = [](const WorldPos&, WorldPos to) {
        to.y() = std::min(to.y(), 210.0);
        return to;
    };
    fly(camera, {.move = {0.0, 1.0, 0.0}}, 2.0, wall);
    EXPECT_EQ(camera.pose().eye_world.y(), 210.0);
    EXPECT_LT(camera.pose().velocity.y(), 1e-9);
}

// A frame over fractal hills with everything resident that it can use.
struct HillFrame {
    std::shared_ptr<const HeightSource> source = test::fractal_hills();
    FrameMaker maker;
    View view = look_at({10.0, 20.0, 60.0}, {400.0, 500.0, 0.0}, 1.0, 320, 200).value();
    MadeFrame made;

    explicit HillFrame(std::size_t budget)
        : maker(FrameMaker::create(source, {.pager = {.worker_count = 0},
                                            .triangulator = {.triangle_budget = budget}})
                    .value()) {
        maker.load_until_stable(view, {}, 0.0);
        made = maker.make({.view = view}, {}, 0.0);
    }
};

TEST(GroundMarks, TheErrorOfAChunkBoundsWhatBruteForceMeasuresInIt) {
    const HillFrame frame(1500);
    const Lattice& lattice = frame.source->lattice();
    const Frustum frustum = make_frustum(frame.view);
    double largest_ratio = 0.0;
    std::size_t points = 0;
    for (const MeshChunk& drawn : frame.made.mesh.chunks) {
        const double bound = chunk_error_px(frame.made.mesh, drawn, frame.view, kDefaultMorphRatio);
        const double step = lattice.spacing * static_cast<double>(drawn.chunk->step);
        const auto corner = [&](std::uint16_t sample) {
            const int column = sample % kChunkSamples, row = sample / kChunkSamples;
            return WorldPos(lattice.x(drawn.chunk->corner.x) + step * column,
                            lattice.y(drawn.chunk->corner.y) + step * row,
                            drawn.displayed_height(sample, lattice.quantum));
        };
        for (std::uint32_t i = 0; i < drawn.index_count; i += 3) {
            const auto* const t = &frame.made.mesh.indices[drawn.first_index + i];
            const WorldPos a = corner(t[0]), b = corner(t[1]), c = corner(t[2]);
            for (const auto& [u, v] : {std::pair(1.0 / 3.0, 1.0 / 3.0), std::pair(0.2, 0.6),
                                       std::pair(0.6, 0.2), std::pair(0.1, 0.1)}) {
                const WorldPos p = a + u * (b - a) + v * (c - a);
                const WorldPos truth(p.x(), p.y(), frame.source->height(p.x(), p.y()));
                const Eigen::Vector3d way = truth - frame.view.eye_world;
                const bool is_seen = std::ranges::all_of(
                    frustum.normals, [&](const Eigen::Vector3d& n) { return n.dot(way) >= 0.0; });
                if (!is_seen) continue;
                const double error = frame.view.pixels_per_radian() * std::abs(p.z() - truth.z()) /
                                     std::max(frame.view.near_distance, way.norm());
                ASSERT_LE(error, bound) << "level " << int{drawn.chunk->key.level};
                largest_ratio = std::max(largest_ratio, error / bound);
                ++points;
            }
        }
    }
    EXPECT_GT(points, 1000u);
    // the bound is one of the same size as the error
    EXPECT_GT(largest_ratio, 0.2);
}

TEST(GroundMarks, LevelsDifferInColourAndNothingIsLateOnceAllHasArrived) {
    const HillFrame frame(20'000);
    const auto marks_of = [&](GroundColours colours) {
        return ground_marks(colours, frame.made.mesh, frame.view, 1.0, kDefaultMorphRatio);
    };
    EXPECT_EQ(marks_of(GroundColours::none), nullptr);
    std::map<int, std::array<float, 3>> colours;
    for (const MeshChunk& chunk : frame.made.mesh.chunks) {
        const Colour colour = marks_of(GroundColours::levels)(chunk).colour;
        const std::array<float, 3> rgb{colour.red, colour.green, colour.blue};
        const auto [entry, is_new] = colours.emplace(chunk.chunk->key.level, rgb);
        EXPECT_EQ(entry->second, rgb);
        EXPECT_EQ(marks_of(GroundColours::late)(chunk).opacity, 0.0f);
    }
    ASSERT_GT(colours.size(), 2u);
    for (auto a = colours.begin(); a != colours.end(); ++a)
        for (auto b = std::next(a); b != colours.end(); ++b) EXPECT_NE(a->second, b->second);
}

TEST(GroundMarks, ChunksWithoutTheirFinerOnesAreLate) {
    const std::shared_ptr<const HeightSource> source = test::fractal_hills();
    FrameMaker maker =
        FrameMaker::create(source,
                           {.pager = {.memory_bytes = 6 * Chunk::max_bytes(), .worker_count = 0},
                            .triangulator = {.triangle_budget = 20'000}})
            .value();
    const View view = look_at({10.0, 20.0, 60.0}, {400.0, 500.0, 0.0}, 1.0, 320, 200).value();
    const MadeFrame made = maker.make({.view = view}, {}, 0.0);
    const auto mark_of =
        ground_marks(GroundColours::late, made.mesh, view, 1.0, kDefaultMorphRatio);
    const auto late = std::ranges::count_if(
        made.mesh.chunks, [&](const MeshChunk& chunk) { return mark_of(chunk).opacity > 0.0f; });
    EXPECT_GT(late, 0);
}

TEST(MeshRay, MeetsTheSurfaceThatIsDrawn) {
    const HillFrame frame(20'000);
    const double allowed = frame.made.mesh.error_px / frame.view.pixels_per_radian();
    std::size_t hits = 0;
    for (double x = 5.0; x < 320.0; x += 31.0) {
        for (double y = 5.0; y < 200.0; y += 17.0) {
            const Eigen::Vector3d along = direction_through(frame.view, x, y);
            const auto hit = first_on_mesh(frame.made.mesh, frame.view.eye_world, along, 1e5);
            if (!hit) continue;
            ++hits;
            const WorldPos& at = hit->point_world;
            const double distance = (at - frame.view.eye_world).norm();
            const double height = frame.source->height(at.x(), at.y());
            EXPECT_NEAR(at.z(), height, allowed * std::max(1.0, distance) + 1e-9);
            // the chunk that draws it has it inside, up to the ends of the ray's rounding
            ASSERT_NE(hit->ground, nullptr);
            const Chunk& chunk = *hit->chunk;
            EXPECT_EQ(hit->ground->chunk, hit->chunk);
            const Lattice& lattice = frame.source->lattice();
            const std::int64_t side = kChunkCells * chunk.step;
            EXPECT_GT(at.x(), lattice.x(chunk.corner.x) - 1e-6);
            EXPECT_LT(at.x(), lattice.x(chunk.corner.x + side) + 1e-6);
            EXPECT_GT(at.y(), lattice.y(chunk.corner.y) - 1e-6);
            EXPECT_LT(at.y(), lattice.y(chunk.corner.y + side) + 1e-6);
            // nothing is in front of it
            for (double share = 0.02; share < 0.98; share += 0.04) {
                const WorldPos p = frame.view.eye_world + share * distance * along;
                EXPECT_GT(p.z(), frame.source->height(p.x(), p.y()) - allowed * distance - 1e-9);
            }
        }
    }
    EXPECT_GT(hits, 50u);
    EXPECT_FALSE(first_on_mesh(frame.made.mesh, frame.view.eye_world, {0.0, 0.0, 1.0}, 1e5));
    EXPECT_FALSE(first_on_mesh(frame.made.mesh, frame.view.eye_world, {0.0, 0.0, -1.0}, 1.0));
    EXPECT_FALSE(first_on_mesh(TerrainMesh{}, frame.view.eye_world, {0.0, 0.0, -1.0}, 1e5));
}

TEST(MapPicture, ShowsTheFinestResidentHeights) {
    const HillFrame frame(20'000);
    const std::shared_ptr<const ResidentSet> resident = frame.maker.pager().resident();
    const Lattice& lattice = resident->lattice();
    test::Random random(3);
    std::set<int> levels;
    for (int i = 0; i < 300; ++i) {
        const WorldVec2 place(random.between(-3000, 3000), random.between(-3000, 3000));
        const Chunk* slow = nullptr;  // the last one that contains the place
        for (const std::shared_ptr<const Chunk>& chunk : resident->chunks()) {
            const std::int64_t side = kChunkCells * chunk->step;
            const bool is_inside = place.x() >= lattice.x(chunk->corner.x) &&
                                   place.x() < lattice.x(chunk->corner.x + side) &&
                                   place.y() >= lattice.y(chunk->corner.y) &&
                                   place.y() < lattice.y(chunk->corner.y + side);
            if (is_inside) slow = chunk.get();
        }
        ASSERT_EQ(finest_chunk_at(*resident, place), slow) << place.transpose();
        levels.insert(slow == nullptr ? -1 : slow->key.level);
    }
    EXPECT_GT(levels.size(), 2u);
    EXPECT_EQ(finest_chunk_at(*resident, {1e18, 0.0}), nullptr);

    const MapPicture picture = make_map_picture(*resident, {10.0, 20.0}, 100.0);
    double low = kInfinity, high = -kInfinity;
    for (int row = 0; row < MapPicture::kTexels; ++row) {
        for (int column = 0; column < MapPicture::kTexels; ++column) {
            constexpr double kTexel = 100.0 / MapPicture::kTexels;
            const double height =
                frame.source->height(-40.0 + kTexel * (column + 0.5), -30.0 + kTexel * (row + 0.5));
            low = std::min(low, height);
            high = std::max(high, height);
        }
    }
    EXPECT_NEAR(picture.low, low, 0.5);
    EXPECT_NEAR(picture.high, high, 0.5);
    const auto opacity = [](const std::array<std::uint8_t, 4>& texel) { return int{texel[3]}; };
    EXPECT_EQ(std::ranges::count(picture.texels, 255, opacity), std::ssize(picture.texels));
    const MapPicture nowhere = make_map_picture(*resident, {1e9, 0.0}, 100.0);
    EXPECT_EQ(std::ranges::count(nowhere.texels, 0, opacity), std::ssize(nowhere.texels));
}

TEST(MapPicture, IsLitFromTheNorthWestAndEndsWithTheExtent) {
    // a ridge along y with light from the left, and a valley along x with light from above
    for (const bool is_along_y : {true, false}) {
        SCOPED_TRACE(is_along_y);
        const auto slopes = heights_from_function(
            [is_along_y](double x, double y) {
                return is_along_y ? -0.5 * std::abs(x) : 0.5 * std::abs(y);
            },
            {.extent = {-100.0, -100.0, 100.0, 100.0}, .slope = 0.5});
        Pager pager = Pager::create(slopes.value(), {.worker_count = 0}).value();
        pager.update({}, {}, 0.0);
        const MapPicture picture = make_map_picture(*pager.resident(), {0.0, 0.0}, 240.0);
        const auto texel = [&](int column, int row) {
            return picture.texels[static_cast<std::size_t>(row * MapPicture::kTexels + column)];
        };
        constexpr int kLow = MapPicture::kTexels / 4, kHigh = 3 * MapPicture::kTexels / 4;
        if (is_along_y) {
            EXPECT_GT(texel(kLow, kLow)[1], 1.3 * texel(kHigh, kLow)[1]);
        } else {
            EXPECT_LT(1.3 * texel(kLow, kLow)[1], texel(kLow, kHigh)[1]);
        }
        EXPECT_EQ(texel(0, kLow)[3], 0);
        EXPECT_EQ(texel(kLow, MapPicture::kTexels - 1)[3], 0);
    }
}

TEST(LineProjector, ProjectsWhatDirectionThroughInverts) {
    const View view = look_at({5.0, -3.0, 20.0}, {100.0, 50.0, -7.0}, 0.9, 640, 480).value();
    const LineProjector projector(view);
    for (const auto& [x, y] :
         {std::pair(10.0, 20.0), std::pair(320.0, 240.0), std::pair(639.5, 1.0)}) {
        const WorldPos p = view.eye_world + 37.0 * direction_through(view, x, y);
        const auto place = projector.place_of(p);
        ASSERT_TRUE(place);
        EXPECT_NEAR((*place)[0], x, 1e-9);
        EXPECT_NEAR((*place)[1], y, 1e-9);
    }
    EXPECT_FALSE(projector.place_of(view.eye_world - view.forward));
    std::vector<PictureLine> lines;
    projector.add(view.eye_world - view.forward, view.eye_world - 2.0 * view.forward, {}, lines);
    EXPECT_TRUE(lines.empty());
    projector.add(view.eye_world - view.forward + view.up, view.eye_world + 5.0 * view.forward, {},
                  lines);
    EXPECT_EQ(lines.size(), 1u);
}

// Bodies over fractal hills whose ground is always resident.
class LiveWorldTest : public testing::Test {
protected:
    LiveWorldTest()
        : terrain_{.source = test::fractal_hills(), .dem = {}, .name = "hills"},
          pager_(Pager::create(terrain_.source, {.worker_count = 0}).value()),
          live_(LiveWorld::create(terrain_).value()) {}

    void simulate(double seconds) {
        for (double t = 0.0; t < seconds; t += LiveWorld::kStep) {
            pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
            ASSERT_TRUE(live_.step(pager_.ground()));
        }
    }
    void expect_nobody_fell() const { EXPECT_EQ(live_.totals().fell_through, 0u); }

    Terrain terrain_;
    Pager pager_;
    LiveWorld live_;
    double time_ = 0.0;
};

TEST_F(LiveWorldTest, AVehicleEntersWhenItsGroundIsThereAndDrivesWhereItIsSteered) {
    for (const VehicleKind kind :
         {VehicleKind::truck, VehicleKind::tracked, VehicleKind::six_wheeler}) {
        live_.drive(kind, {50.0, 80.0}, 1e3, {1.0, 0.0});
        EXPECT_TRUE(live_.is_waiting());
        simulate(1.0);
        ASSERT_FALSE(live_.is_waiting());
        const WorldPos start = live_.pose().translation;
        live_.steer(VehicleControls{.throttle = 0.6});
        simulate(3.0);
        EXPECT_GT(live_.pose().translation.x() - start.x(), 3.0);
        live_.leave();
        EXPECT_EQ(live_.being(), Being::camera);
        EXPECT_FALSE(live_.body().is_valid());
    }
    expect_nobody_fell();
}

TEST_F(LiveWorldTest, AWalkerWalksTurnsAndJumps) {
    live_.walk({-30.0, 40.0}, 1e3, {0.0, 2.0});
    simulate(1.0);
    ASSERT_EQ(live_.being(), Being::walker);
    ASSERT_FALSE(live_.is_waiting());
    EXPECT_NEAR(live_.pose().rotation(1, 0), 1.0, 1e-12);
    const WorldPos start = live_.pose().translation;
    live_.steer(WorldVec2(0.0, 2.0), false);
    simulate(2.0);
    EXPECT_NEAR(live_.pose().translation.y() - start.y(), 4.0, 1.5);
    live_.steer(WorldVec2(0.0, 0.0), true);
    simulate(0.3);
    EXPECT_GT(live_.pose().translation.z(), terrain_.source->height(-30.0, start.y()) + 0.5);
    live_.turn(0.5 * std::numbers::pi);
    EXPECT_NEAR(live_.pose().rotation(0, 0), -1.0, 1e-12);
    expect_nobody_fell();
}

TEST_F(LiveWorldTest, CratesFlyAreReplacedAtTheLimitAndHangFromTheHand) {
    const double ground = terrain_.source->height(0.0, 0.0);
    const BodyId first = live_.throw_crate({0.0, 0.0, ground + 5.0}, {0.0, 0.0, 0.0}).value();
    simulate(2.0);
    EXPECT_LT(live_.world().state(first).pose.translation.z(), ground + 2.5);
    live_.grab(first, live_.world().state(first).pose.translation);
    ASSERT_EQ(live_.grabbed(), first);
    live_.pull_to({0.0, 0.0, ground + 8.0});
    simulate(3.0);
    EXPECT_NEAR(live_.world().state(first).pose.translation.z(), ground + 8.0, 0.5);
    live_.let_go();
    simulate(2.0);
    EXPECT_LT(live_.world().state(first).pose.translation.z(), ground + 4.0);
    for (std::size_t i = 1; i < LiveWorld::kMostThrown; ++i) {
        ASSERT_TRUE(
            live_.throw_crate({static_cast<double>(i % 40) * 3.0,
                               3.0 * std::floor(static_cast<double>(i) / 40.0), ground + 60.0},
                              Eigen::Vector3d::Zero()));
    }
    const BodyId again = live_.throw_crate({0.0, 0.0, ground + 90.0}, {1.0, 2.0, 3.0}).value();
    EXPECT_EQ(again, first);
    EXPECT_EQ(live_.world().states().size(), LiveWorld::kMostThrown);
    EXPECT_FALSE(live_.throw_crate({std::nan(""), 0.0, 0.0}, Eigen::Vector3d::Zero()));
    simulate(1.0);
    expect_nobody_fell();
}

TEST_F(LiveWorldTest, ItsSettingsActAtOnceOnAllBodies) {
    const double height = terrain_.source->height(0.0, 0.0);
    const auto throw_one = [&](double x) {
        return *live_.throw_crate({x, 0.0, height + 3.0}, Eigen::Vector3d::Zero());
    };
    const BodyId before = throw_one(0.0);
    const auto tolerance = [this](BodyId body) {
        return live_.world().settings(body).contact_tolerance;
    };
    EXPECT_EQ(tolerance(before), LiveSettings().contact_tolerance);
    ASSERT_TRUE(live_.set({.contact_tolerance = 1e-3}));
    EXPECT_EQ(tolerance(before), 1e-3);
    EXPECT_EQ(tolerance(throw_one(3.0)), 1e-3);
    // a tenth of the half side of a crate
    ASSERT_TRUE(live_.set({.contact_tolerance = 1.0}));
    EXPECT_DOUBLE_EQ(tolerance(before), 0.04);
    for (const int refused : {0, LiveSettings::kMostSubsteps + 1})
        EXPECT_FALSE(live_.set({.substeps = refused})) << refused;
    EXPECT_FALSE(live_.set({.contact_tolerance = -1.0}));
    EXPECT_EQ(live_.settings(), LiveSettings{.contact_tolerance = 1.0});
    simulate(2.0);
    expect_nobody_fell();
}

TEST_F(LiveWorldTest, WhatIsSteeredAndStaticBodiesCannotBeGrabbed) {
    live_.walk({0.0, 0.0}, 1e3, {0.0, 1.0});
    simulate(0.5);
    live_.grab(live_.body(), live_.pose().translation);
    EXPECT_FALSE(live_.grabbed().is_valid());
    live_.grab(BodyId{}, WorldPos::Zero());
    EXPECT_FALSE(live_.grabbed().is_valid());
}

TEST_F(LiveWorldTest, EveryStateOfThePastHasTheBitsOfTheRun) {
    const std::uint64_t seed = 1130;
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::Random random(seed);
    LiveHistory history(std::size_t{64} << 20);
    std::vector<std::uint64_t> hashes{live_.world().state_hash()};
    std::vector<WorldPos> eyes{WorldPos::Zero()};
    const LiveHistory::GroundOf ground_of = [this](std::span<const GroundEdit>) {
        pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
        return pager_.ground();
    };
    const double height = terrain_.source->height(0.0, 0.0);
    for (std::size_t i = 0; i < 900; ++i) {
        bool is_changed = i % 150 == 0;
        if (i == 0) live_.drive(VehicleKind::truck, {5.0, 0.0}, 1e3, {1.0, 0.0});
        if (i == 450) live_.walk({0.0, 10.0}, 1e3, {1.0, 0.0});
        if (i % 150 == 75) {
            is_changed = true;
            ASSERT_TRUE(
                live_.throw_crate({random.between(0, 20), random.between(-9, 9), height + 9.0},
                                  Eigen::Vector3d::Zero()));
        }
        if (i == 250 || i == 400) {
            is_changed = true;
            ASSERT_TRUE(live_.set(i == 250 ? LiveSettings{.substeps = 5, .contact_tolerance = 1e-3}
                                           : LiveSettings()));
        }
        if (i == 200)
            live_.grab(live_.world().id(1),
                       live_.world().state(live_.world().id(1)).pose.translation);
        if (i > 200 && i < 300) live_.pull_to({10.0, 0.0, height + 6.0});
        if (i == 300) live_.let_go();
        live_.steer(
            VehicleControls{.throttle = random.between(-1, 1), .steer = random.between(-1, 1)});
        live_.steer(WorldVec2(random.between(-3, 3), random.between(-3, 3)), i % 40 == 0);
        live_.turn_camera(random.between(-0.1, 0.1));
        if (is_changed) history.change(live_);
        ASSERT_TRUE(history.step(live_, ground_of({}).value()));
        hashes.push_back(live_.world().state_hash());
        eyes.push_back(live_.view(View{}).eye_world);
    }
    ASSERT_EQ(history.step_now(), 900u);
    EXPECT_GT(std::set<std::uint64_t>(hashes.begin(), hashes.end()).size(), 800u);
    for (int i = 0; i < 40; ++i) {
        const auto step = static_cast<std::size_t>(random.below(901));
        ASSERT_TRUE(history.seek(step, live_, ground_of));
        ASSERT_EQ(history.step_now(), step);
        ASSERT_EQ(live_.world().state_hash(), hashes[step]) << step;
        EXPECT_EQ(live_.settings().substeps, step >= 250 && step < 400 ? 5 : 2) << step;
        if (step > 60 && live_.body().is_valid()) {
            ASSERT_EQ(live_.view(View{}).eye_world, eyes[step]) << step;
        }
    }
    // a step from the past forgets what followed
    ASSERT_TRUE(history.seek(500, live_, ground_of));
    EXPECT_TRUE(history.is_in_past());
    history.change(live_);
    ASSERT_TRUE(history.step(live_, ground_of({}).value()));
    EXPECT_EQ(history.step_count(), 501u);
    EXPECT_FALSE(history.is_in_past());
    ASSERT_TRUE(history.seek(100, live_, ground_of));
    EXPECT_EQ(live_.world().state_hash(), hashes[100]);
    expect_nobody_fell();
}

TEST_F(LiveWorldTest, BodiesThatChangedGroundCoversArePlacedAndHaveNotFallen) {
    const double height = terrain_.source->height(0.0, 0.0);
    for (const bool is_told : {true, false}) {
        LiveWorld live = LiveWorld::create(terrain_).value();
        ASSERT_TRUE(live.throw_crate({0.0, 0.0, height + 3.0}, Eigen::Vector3d::Zero()));
        for (int i = 0; i < 30; ++i) {
            pager_.update({}, live.needs(), time_ += LiveWorld::kStep);
            ASSERT_TRUE(live.step(pager_.ground()));
        }
        // the ground now lies above the crate
        const auto plain =
            heights_from_function([height](double, double) { return height + 4.0; },
                                  {.extent = {-100.0, -100.0, 100.0, 100.0}, .slope = 0.0});
        Pager filled = Pager::create(plain.value(), {.worker_count = 0}).value();
        filled.update({}, live.needs(), 0.0);
        if (is_told) live.change_ground({{-9.0, -9.0, -1e3}, {9.0, 9.0, 1e3}});
        ASSERT_TRUE(live.step(filled.ground()));
        EXPECT_EQ(live.last().placed_deep, is_told ? 1u : 0u);
        EXPECT_EQ(live.totals().fell_through, is_told ? 0u : 1u);
    }
}

TEST_F(LiveWorldTest, ThePastIsForgottenFromItsBeginningWhereMemoryEnds) {
    ASSERT_TRUE(live_.throw_crate({0.0, 0.0, 100.0}, Eigen::Vector3d::Zero()));
    constexpr std::size_t kBytes = 100'000;
    LiveHistory history(kBytes);
    const LiveHistory::GroundOf ground_of = [this](std::span<const GroundEdit>) {
        pager_.update({}, live_.needs(), time_ += LiveWorld::kStep);
        return pager_.ground();
    };
    for (int i = 0; i < 1200; ++i) ASSERT_TRUE(history.step(live_, ground_of({}).value()));
    EXPECT_GT(history.first_step(), 0u);
    EXPECT_LT(history.first_step(), 1200u);
    EXPECT_LE(history.bytes(), kBytes);
    ASSERT_TRUE(history.seek(0, live_, ground_of));
    EXPECT_EQ(history.step_now(), history.first_step());
}

TEST(KeyHelps, TenKeysComeFirst) {
    const auto helps = key_helps();
    const auto firsts =
        std::ranges::count_if(helps, [](const KeyHelp& help) { return help.is_first; });
    EXPECT_EQ(firsts, 10);
    for (std::size_t i = 0; i < 10; ++i) EXPECT_TRUE(helps[i].is_first) << helps[i].keys;
}

TEST(FlightOptionsTest, ShadowsAreOnWithTheFullLookUnlessSaidOtherwise) {
    FlightOptions options;
    EXPECT_EQ(options.shadow_distance(), 0.0);
    options.look = Look::full;
    EXPECT_EQ(options.shadow_distance(), 1000.0);
    options.shadows = 0.0;
    EXPECT_EQ(options.shadow_distance(), 0.0);
    options.look = Look::plain;
    options.shadows = 250.0;
    EXPECT_EQ(options.shadow_distance(), 250.0);
}

}  // namespace view_test
}  // namespace terrane::tools
