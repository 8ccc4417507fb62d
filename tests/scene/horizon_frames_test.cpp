// SPDX-License-Identifier: MIT
//
// The horizon map against frames of random worlds, with any chunks, fades and morphs: what it hides is met neither by
// rays over the triangles that are drawn nor by rays over the heights of the source.
#include "scene/random_scene.h"
#include "scene/scene_cases.h"
#include "support/random_world.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/ground.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

namespace terrane::test::horizon_frames {
namespace {

// A place of the world, and its true height.
WorldPos random_place(Random& random, const HeightSource& source) {
    const WorldRect& extent = source.extent();
    const double x = random.between(extent.west, extent.east);
    const double y = random.between(extent.south, extent.north);
    return {x, y, source.height(x, y)};
}

// A view from near the ground, in proportion to the size of the world.
View low_view(Random& random, const RandomWorld& world) {
    const double size = world.lattice().root_size();
    WorldPos eye = random_place(random, world.source());
    eye.z() += size * random_magnitude(random, 0.002, 0.2);
    const double turn = random.between(0.0, 6.28);
    const double roll = random.below(2) == 0 ? 0.0 : random.between(-1.0, 1.0);
    View view = view_along(eye, {std::cos(turn), std::sin(turn)}, random.between(-0.6, 0.3), roll);
    view.near_distance = 0.0005 * size;
    view.vertical_fov = random.between(0.3, 1.5);
    view.height_px = 100 + random.below(1000);
    return view;
}

// Balls that stand on the ground or partly in it.
BoundingSphere random_ball(Random& random, const RandomWorld& world) {
    const double radius = world.lattice().root_size() * random_magnitude(random, 1e-4, 0.03);
    WorldPos centre = random_place(random, world.source());
    centre.z() += radius * random.between(-0.5, 1.5);
    return {centre, radius};
}

// Whether a segment goes below the true surface, at one of many of its points. They are denser near its start, as
// what is nearer hides with less of its height.
bool goes_below(const HeightSource& source, const WorldPos& from, const WorldPos& to) {
    for (const int steps : {150, 30'000}) {
        for (int i = 0; i <= steps; ++i) {
            const WorldPos p = from + std::exp2(-12.0 * i / steps) * (to - from);
            if (source.height(p.x(), p.y()) >= p.z()) return true;
        }
    }
    return false;
}

struct Frame {
    RandomWorld world;
    std::shared_ptr<const ResidentSet> resident;
    View view;
    Triangulator triangulator;
    TerrainMesh mesh;
};

Frame random_frame(Random& random) {
    RandomWorld world(random, 12);
    RandomResidence residence(world);
    residence.jump(random);
    const TriangulatorSettings settings = {
        .triangle_budget =
            world.root_triangles() + static_cast<std::size_t>(random_magnitude(random, 10.0, 2e4)),
        .max_error_px = random_magnitude(random, 0.3, 8.0),
        .morph_ratio = random.below(4) == 0 ? 1.0 : random.between(1.0, 2.0)};
    const View view = low_view(random, world);
    Triangulator triangulator = Triangulator::create(world.source(), settings).value();
    const TerrainMesh mesh = triangulator.update(residence.resident(), view);
    return {std::move(world), residence.resident(), view, std::move(triangulator), mesh};
}

GroundError errors_of(const TerrainMesh& mesh) {
    return {.refinable_px = mesh.refinable_error_px, .finest_m = mesh.finest_error_m};
}

TEST(HorizonFrames, NothingHiddenIsInSightOverTheDrawnOrTheTrueSurface) {
    constexpr std::uint64_t kSeed = 11;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    constexpr int kStates = 150;
    int frames = 0, hidden = 0, rays = 0;
    // hidden where the finest ground has most of the error: by the error in two parts, as a whole
    int split = 0, whole = 0;
    for (int state = 0; state < kStates; ++state) {
        const Frame frame = random_frame(random);
        const HeightSource& source = frame.world.source();
        const View& view = frame.view;
        HorizonMap map, of_whole_error;
        map.build(frame.resident, view, errors_of(frame.mesh));
        of_whole_error.build(frame.resident, view, {.refinable_px = frame.mesh.error_px});
        if (!map.is_of(view) || !map.holds_for(frame.mesh)) continue;
        ++frames;
        const bool is_finest_worst = frame.mesh.error_px > 2.0 * frame.mesh.refinable_error_px;
        const MeshRays surface = drawn_surface(frame.mesh);
        const ViewVolume volume(view);
        for (int i = 0; i < 300; ++i) {
            const BoundingSphere ball = random_ball(random, frame.world);
            if (!volume.meets(ball)) continue;
            whole += is_finest_worst && of_whole_error.hides(ball) ? 1 : 0;
            const Eigen::Vector3d reach = Eigen::Vector3d::Constant(ball.radius);
            const bool is_hidden = map.hides(ball);
            ASSERT_LE(map.hides(Aabb{ball.centre - reach, ball.centre + reach}), is_hidden)
                << "a box hides no more than the ball inside";
            if (!is_hidden) continue;
            split += is_finest_worst ? 1 : 0;
            ++hidden;
            for (int k = 0; k < 6; ++k) {
                const std::optional<WorldPos> p = shown_point(random, view, ball);
                if (!p) continue;
                ++rays;
                SCOPED_TRACE(testing::Message()
                             << "state " << state << " (" << frame.world.describe() << "), ball "
                             << i << ", error " << frame.mesh.refinable_error_px << " px and "
                             << frame.mesh.finest_error_m << " m");
                ASSERT_TRUE(surface.ray(view.eye_world, *p)) << "over the drawn surface";
                ASSERT_TRUE(goes_below(source, view.eye_world, *p)) << "over the true surface";
            }
        }
    }
    std::printf(
        "%d frames, %d hidden balls, %d rays; over finest ground %d, by the whole error %d\n",
        frames, hidden, rays, split, whole);
    EXPECT_GT(frames, kStates / 4);
    EXPECT_GT(hidden, 100);
    EXPECT_GT(split, whole);
}

// The view from between the true surface and drawn ground above it; none where random places have no such ground.
std::optional<View> view_below_drawn_ground(Random& random, const Frame& frame,
                                            const MeshRays& surface) {
    for (int i = 0; i < 40; ++i) {
        const WorldPos place = random_place(random, frame.world.source());
        const Eigen::Vector3d up(0.0, 0.0, 4.0 * frame.world.lattice().root_size());
        const auto hit = surface.ray(place + up, place);
        if (!hit) continue;
        View view = frame.view;
        view.eye_world = place + 0.5 * (1.0 - hit->fraction) * up;
        if (view.eye_world.z() - place.z() > 4.0 * view.near_distance) return view;
    }
    return std::nullopt;
}

TEST(HorizonFrames, AMapHoldsForMeshesWithinItsErrorsThatAreBelowTheEye) {
    constexpr std::uint64_t kSeed = 12;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    int below = 0, above = 0, finest = 0;
    for (int state = 0; state < 60; ++state) {
        const Frame frame = random_frame(random);
        const GroundError errors = errors_of(frame.mesh);
        HorizonMap map;
        map.build(frame.resident, frame.view, errors);
        if (!map.is_of(frame.view)) continue;
        const MeshRays surface = drawn_surface(frame.mesh);
        const double size = frame.world.lattice().root_size();
        const Eigen::Vector3d down(0.0, 0.0, -4.0 * size);
        const WorldPos& eye = frame.view.eye_world;
        const bool is_above = surface.ray(eye, eye + down).has_value();
        ASSERT_EQ(map.holds_for(frame.mesh), is_above) << "state " << state;
        above += is_above ? 1 : 0;
        if (errors.refinable_px > 0.0) {
            map.build(frame.resident, frame.view, {0.99 * errors.refinable_px, errors.finest_m});
            EXPECT_FALSE(map.holds_for(frame.mesh));
        }
        if (errors.finest_m > 0.0) {
            map.build(frame.resident, frame.view, {errors.refinable_px, 0.99 * errors.finest_m});
            EXPECT_FALSE(map.holds_for(frame.mesh));
            ++finest;
        }
        map.clear();
        EXPECT_TRUE(map.holds_for(frame.mesh)) << "it hides nothing";
        const std::optional<View> low = view_below_drawn_ground(random, frame, surface);
        if (!low) continue;
        map.build(frame.resident, *low, errors);
        if (!map.is_of(*low)) continue;
        EXPECT_FALSE(map.holds_for(frame.mesh)) << "state " << state << ", below drawn ground";
        ++below;
    }
    std::printf("%d eyes above the drawn ground, %d below, %d with finest ground\n", above, below,
                finest);
    EXPECT_GT(above, 20);
    EXPECT_GT(below, 3);
    EXPECT_GT(finest, 2);
}

}  // namespace
}  // namespace terrane::test::horizon_frames

// Objects of a scene that the ground hides.

namespace terrane::test::occlusion {
namespace {

using Offset = std::array<float, 3>;

class ForestOnHills : public testing::Test {
protected:
    ForestOnHills() {
        const ModelId model = scene.add_model(tree_model()).value();
        Random random(6);
        trees = spread_objects(random, 3000, 1000.0);
        for (PlacedObject& tree : trees) {
            WorldPos& p = tree.position;
            p.z() = source->height(p.x(), p.y());
        }
        EXPECT_TRUE(add_instances(scene, model, trees).has_value());
    }

    View low_view(double turn) const {
        const WorldPos eye(20.0, -30.0, source->height(20.0, -30.0) + 4.0);
        return view_along(eye, {std::cos(turn), std::sin(turn)}, -0.05, 0.0);
    }

    // Offsets of the objects that are drawn.
    std::set<Offset> drawn(const View& view, const HorizonMap* horizon) {
        scene.begin_frame(view, 1.0, {}, horizon);
        std::set<Offset> offsets;
        for (const ObjectInstance& instance : scene.end_frame(1.0).instances)
            offsets.insert(instance.offset_eye);
        return offsets;
    }

    std::shared_ptr<const HeightSource> source = FractalHeights::create({.seed = 4,
                                                                         .octave_count = 8,
                                                                         .amplitude = 150.0,
                                                                         .wavelength_log2 = 10,
                                                                         .finest_spacing_log2 = 2,
                                                                         .root_size_log2 = 10})
                                                     .value();
    std::shared_ptr<const ResidentSet> resident = resident_chunks(*source, 1);
    Scene scene = Scene::create({}).value();
    std::vector<PlacedObject> trees;
};

TEST_F(ForestOnHills, ObjectsThatAreLeftOutHaveNoPointInSight) {
    const Ground ground(resident, 1);
    HorizonMap horizon;
    std::size_t occluded = 0, in_view = 0;
    for (int i = 0; i < 12; ++i) {
        const View view = low_view(0.5 * i);
        horizon.build(resident, view, {.refinable_px = 1.0});
        const std::set<Offset> all = drawn(view, nullptr);
        EXPECT_EQ(scene.counts().occluded, 0u);
        const SceneCounts without = scene.counts();
        const std::set<Offset> in_sight = drawn(view, &horizon);
        const SceneCounts& counts = scene.counts();
        EXPECT_GE(counts.in_view + counts.occluded, without.in_view);
        EXPECT_LE(counts.in_view, without.in_view);
        occluded += without.drawn - counts.drawn;
        in_view += without.drawn;
        for (const Offset& offset : in_sight) ASSERT_TRUE(all.contains(offset)) << "it moved";
        for (const Offset& offset : all) {
            if (in_sight.contains(offset)) continue;
            const WorldPos foot =
                view.eye_world + Eigen::Vector3f(offset[0], offset[1], offset[2]).cast<double>();
            // the top of the smallest tree, up to the tallest one's
            for (const double height : {0.5, 3.0, 5.6}) {
                const WorldPos p = foot + Eigen::Vector3d(0.0, 0.0, height);
                const RayAnswer answer = ground.ray(view.eye_world, p);
                ASSERT_EQ(answer.status, QueryStatus::ok) << height << " m of a tree in view " << i;
            }
        }
    }
    EXPECT_GT(occluded, in_view / 4);
}

TEST_F(ForestOnHills, AMapOfAnotherViewHidesNothing) {
    HorizonMap horizon;
    horizon.build(resident, low_view(0.5), {.refinable_px = 1.0});
    const View view = low_view(0.6);
    EXPECT_EQ(drawn(view, &horizon), drawn(view, nullptr));
    EXPECT_EQ(scene.counts().occluded, 0u);
    horizon.clear();
    EXPECT_EQ(drawn(low_view(0.5), &horizon), drawn(low_view(0.5), nullptr));
}

TEST_F(ForestOnHills, NothingIsHiddenWhileShadowsAreDrawn) {
    const View view = low_view(0.5);
    HorizonMap horizon;
    horizon.build(resident, view, {.refinable_px = 1.0});
    EXPECT_LT(drawn(view, &horizon).size(), drawn(view, nullptr).size());
    const SunShadows shadows{.sun_direction = {1.0, 0.0, 0.5}, .distance = 500.0};
    scene.begin_frame(view, 1.0, shadows, nullptr);
    const std::size_t all = scene.counts().in_view;
    scene.begin_frame(view, 1.0, shadows, &horizon);
    EXPECT_EQ(scene.counts().in_view, all);
    EXPECT_EQ(scene.counts().occluded, 0u);
}

TEST_F(ForestOnHills, AFrameDependsOnItsMapAlone) {
    HorizonMap fresh, used;
    used.build(resident, low_view(2.0), {.refinable_px = 30.0});
    for (HorizonMap* horizon : {&fresh, &used})
        horizon->build(resident, low_view(0.5), {.refinable_px = 1.0});
    const std::set<Offset> first = drawn(low_view(0.5), &fresh);
    EXPECT_GT(scene.counts().occluded, 0u);
    drawn(low_view(3.0), nullptr);
    EXPECT_EQ(drawn(low_view(0.5), &used), first);
}

}  // namespace
}  // namespace terrane::test::occlusion
