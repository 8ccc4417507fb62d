// SPDX-License-Identifier: MIT
#include "level_set/sampled_shape.h"
#include "store/test_files.h"
#include "support/meshes.h"
#include "volume/volume_scenes.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

namespace terrane::shapes_test {

using namespace test;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Lattice wide_world() {
    Lattice lattice;
    lattice.first_root_x = lattice.first_root_y = -8;
    lattice.root_count_x = lattice.root_count_y = 16;
    return lattice;
}

std::vector<VolumeShape> random_shapes(Random& random) {
    VolumeTube tube{{}, random.between(1.0, 9.0)};
    for (int i = 1 + random.below(12); i > 0; --i)
        tube.path_shape.push_back(random.direction() * random.between(0.0, 60.0));
    return {VolumeSphere{random.between(1.0, 30.0)},
            VolumeCapsule{random.between(1.0, 9.0), random.between(0.0, 30.0)},
            VolumeBox{
                {random.between(1.0, 20.0), random.between(1.0, 20.0), random.between(1.0, 20.0)}},
            tube};
}

TEST(VolumeShapes, HaveTheDistancesOfTheOracle) {
    Random random(1);
    for (int scene = 0; scene < 200; ++scene) {
        for (const VolumeShape& shape : random_shapes(random)) {
            VolumeOperation operation{.shape = shape, .voxel = 1.0};
            operation.world_from_shape = {random.rotation(),
                                          random.direction() * random.between(0.0, 400.0)};
            const auto placed = PlacedVolume::create(wide_world(), 0, operation);
            ASSERT_TRUE(placed.has_value()) << placed.error().message;
            for (int i = 0; i < 50; ++i) {
                const Eigen::Vector3d p = operation.world_from_shape.translation +
                                          random.direction() * random.between(0.0, 90.0);
                EXPECT_NEAR(placed->signed_distance(p), AnalyticSolid::distance(operation, p),
                            1e-10);
            }
        }
    }
}

TEST(VolumeShapes, ATubeOfOnePointIsASphereAndEqualPointsAreHarmless) {
    VolumeOperation operation{.shape = VolumeTube{{{1, 2, 3}}, 4.0}, .voxel = 1.0};
    const auto sphere = PlacedVolume::create(wide_world(), 0, operation).value();
    operation.shape = VolumeTube{{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, 4.0};
    const auto tube = PlacedVolume::create(wide_world(), 0, operation).value();
    for (const Eigen::Vector3d& p :
         {Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(9, 2, 3), Eigen::Vector3d(0, 0, 0)}) {
        EXPECT_NEAR(sphere.signed_distance(p), (p - Eigen::Vector3d(1, 2, 3)).norm() - 4.0, 1e-12);
        EXPECT_EQ(sphere.signed_distance(p), tube.signed_distance(p));
    }
}

std::string refusal(const VolumeOperation& operation) {
    const auto placed = PlacedVolume::create(wide_world(), 0, operation);
    EXPECT_TRUE(placed.has_value() || placed.error().code == ErrorCode::invalid_argument);
    return placed.has_value() ? "" : placed.error().message;
}

TEST(VolumeShapes, LegsOfATubeFarBeyondTheWorldCostNothing) {
    VolumeTube tube{.radius = 1.0};
    for (int i = 0; i < 1'000; ++i) {
        const double side = i % 2 == 0 ? 1e5 : -1e5;
        tube.path_shape.emplace_back(side, side, 0.0);
    }
    const auto placed = PlacedVolume::create(wide_world(), 0, {.shape = tube, .voxel = 1.0});
    ASSERT_TRUE(placed) << placed.error().message;
    EXPECT_LT(placed->tiles().size(), 10'000u);
}

TEST(VolumeShapes, RefusesSizesAndNumbersThatMakeNoSense) {
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = 1.0}), "");
    EXPECT_EQ(refusal({.shape = VolumeSphere{0.0}}),
              "radius must be above 0 and at most 1e+05 m, got 0");
    EXPECT_EQ(refusal({.shape = VolumeSphere{-1.0}}),
              "radius must be above 0 and at most 1e+05 m, got -1");
    EXPECT_EQ(refusal({.shape = VolumeSphere{kNan}}),
              "radius must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{1e6}}),
              "radius must be above 0 and at most 1e+05 m, got 1e+06");
    EXPECT_EQ(refusal({.shape = VolumeCapsule{1.0, -0.1}}),
              "half_height must be 0 to 1e+05 m, got -0.1");
    EXPECT_EQ(refusal({.shape = VolumeBox{{1.0, kNan, 1.0}}}),
              "half_extents must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeTube{{}, 1.0}}), "path must have 1 to 1048576 points, got 0");
    EXPECT_EQ(refusal({.shape = VolumeTube{{{0, 0, 0}, {0, kNan, 0}}, 1.0}}),
              "path[1] must be within 1e+05 m of the origin, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = 0.0}),
              "voxel must be above 0 and at most 1e+05 m, got 0");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = -1.0}),
              "voxel must be above 0 and at most 1e+05 m, got -1");
    EXPECT_EQ(refusal({.shape = VolumeSphere{5.0}, .voxel = kNan}),
              "voxel must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(refusal({.shape = VolumeSphere{0.001}}),
              "the volume is 0.002 m thick, less than its voxel of 1 m");
    VolumeOperation placed{.shape = VolumeSphere{5.0}};
    placed.world_from_shape.translation.x() = kNan;
    EXPECT_EQ(refusal(placed), "position must be within 2^38 m, got nan");
    placed.world_from_shape.translation = {1e5, 0.0, 0.0};
    EXPECT_EQ(refusal(placed), "the volume at (100000, 0) is outside the world");
    placed.world_from_shape.translation = {0.0, 0.0, 1e9};
    EXPECT_EQ(refusal(placed), "the volume reaches from 1e+09 to 1e+09 m, beyond 2^28 voxels");
    placed.world_from_shape = {2.0 * Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    EXPECT_EQ(
        refusal(placed),
        "rotation must be orthonormal to 1e-6 with determinant 1, is off by 3 with determinant 8");
    placed.world_from_shape = {-Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
    EXPECT_NE(refusal(placed), "");
}

TEST(Volumes, NameTheOperationThatIsRefused) {
    const std::vector<VolumeOperation> operations = {{.shape = VolumeSphere{5.0}},
                                                     {.shape = VolumeSphere{kNan}}};
    const auto volumes = Volumes::create(wide_world(), operations);
    ASSERT_FALSE(volumes.has_value());
    EXPECT_EQ(volumes.error().message,
              "volume 1: radius must be above 0 and at most 1e+05 m, got nan");
    EXPECT_EQ(Volumes::create(wide_world(), {}).error().message, "the list of volumes is empty");
    Lattice broken = wide_world();
    broken.spacing = kNan;
    EXPECT_FALSE(Volumes::create(broken, {operations.data(), 1}).has_value());
}

TEST(Volumes, ChooseTheLevelWhoseSpacingIsNearest) {
    Lattice lattice = wide_world();
    lattice.spacing = 0.25;
    lattice.finest_level = 4;  // 4, 2, 1, 0.5 and 0.25 m
    EXPECT_EQ(pinned_level(lattice, 1.0), 2);
    EXPECT_EQ(pinned_level(lattice, 0.74), 2);
    EXPECT_EQ(pinned_level(lattice, 0.68), 3);
    EXPECT_EQ(pinned_level(lattice, 0.001), 4);
    EXPECT_EQ(pinned_level(lattice, 1000.0), 0);
    const std::vector<VolumeOperation> operations = {{.shape = VolumeSphere{5.0}, .voxel = 2.0},
                                                     {.shape = VolumeSphere{5.0}, .voxel = 0.5}};
    EXPECT_EQ(Volumes::create(lattice, operations)->spacing(), 0.5);
}

TEST(Volumes, TouchTilesAlongATunnelAndNotItsWholeBox) {
    VolumeOperation tunnel{.shape = VolumeTube{{{-900, -900, -20}, {900, 900, -20}}, 5.0},
                           .voxel = 1.0};
    const std::vector<VolumeOperation> operations = {tunnel,
                                                     {.shape = VolumeSphere{5.0}, .voxel = 1.0}};
    const Volumes volumes = Volumes::create(wide_world(), operations).value();
    EXPECT_GT(volumes.tiles().size(), 100u);  // of 57 * 57 in its box
    EXPECT_LT(volumes.tiles().size(), 260u);
    EXPECT_EQ(volumes.operations_at({20, -20}).size(), 0u);
    ASSERT_EQ(volumes.operations_at({0, 0}).size(), 2u);
    EXPECT_EQ(volumes.operations_at({0, 0})[0], 0u);
    EXPECT_EQ(volumes.operations_at({5, 5}).size(), 1u);
}

}  // namespace terrane::shapes_test

namespace terrane::mesh_volume_test {

using namespace test;

VolumeMesh ball(int divisions, double radius) {
    ShapeMesh sphere = make_sphere(radius, divisions);
    return {std::move(sphere.vertices), std::move(sphere.triangles)};
}

/// The largest distance of a vertex, but for the heightfield's, from a sphere.
double farthest_from_sphere(const JoinedMesh& mesh, const Eigen::Vector3d& centre, double radius) {
    double worst = 0.0;
    for (std::size_t i = 0; i < mesh.keys.size(); ++i) {
        if (mesh.keys[i].is_node()) continue;
        worst = std::max(worst, std::abs((mesh.positions[i] - centre).norm() - radius));
    }
    return worst;
}

TEST(MeshVolume, IsWatertightAndNearItsMeshWhereverItIsTurned) {
    const VolumeWorld world = flat_world();
    Random random(5);
    for (const double z : {20.0, 38.0}) {
        auto operation = place(ball(5, 15.0), {63.3, 64.4, z});
        operation.world_from_shape.rotation = random.rotation();
        const Volumes volumes = Volumes::create(world.lattice, {&operation, 1}).value();
        const JoinedMesh mesh = join(world, volumes, contour_all(world, volumes));
        EXPECT_EQ(find_leak(world, mesh), "");
        const double worst = farthest_from_sphere(mesh, {63.3, 64.4, z}, 15.0);
        EXPECT_GT(worst, 0.0);
        EXPECT_LT(worst, 0.06);
    }
}

TEST(MeshVolume, HasTheSameBitsWithAnyNumberOfOpenVdbsThreads) {
    std::vector<double> first;
    for (const std::size_t threads : {1u, 3u, 8u}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        const auto placed =
            PlacedVolume::create(flat_world().lattice, 0, place(ball(4, 20.0), {63.3, 64.4, 30.0}))
                .value();
        std::vector<double> values;
        Random random(9);
        for (int i = 0; i < 20000; ++i) {
            values.push_back(
                placed.signed_distance(Eigen::Vector3d(63.3, 64.4, 30.0) +
                                       random.direction() * random.between(14.0, 26.0)));
        }
        if (first.empty()) first = values;
        EXPECT_EQ(values, first) << threads;
    }
}

/// Adds a mesh, moved, and inside out if its triangles are to face inwards.
void add_shell(VolumeMesh& mesh, VolumeMesh shell, const Eigen::Vector3d& at, bool faces_inwards) {
    const auto offset = static_cast<std::uint32_t>(mesh.points_shape.size());
    for (const Eigen::Vector3d& p : shell.points_shape) mesh.points_shape.push_back(p + at);
    for (auto& t : shell.triangles) {
        if (faces_inwards) std::swap(t[1], t[2]);
        mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    }
}

TEST(MeshVolume, KeepsCavitiesAndWhatIsSolidInThem) {
    VolumeMesh mesh;
    const Eigen::Vector3d aside(40.0, 0.0, 0.0), none(0.0, 0.0, 0.0);
    add_shell(mesh, ball(4, 5.0), none, false);  // in the cavity
    add_shell(mesh, ball(4, 12.0), none, true);  // the cavity
    add_shell(mesh, ball(4, 17.0), none, false);
    add_shell(mesh, ball(4, 12.0), aside, false);  // beside it, with two cavities
    add_shell(mesh, ball(3, 3.0), aside + Eigen::Vector3d(-4.0, 0.0, 1.0), true);
    add_shell(mesh, ball(3, 3.0), aside + Eigen::Vector3d(4.0, 0.0, 1.0), true);
    VolumeOperation operation = place(mesh, {63.3, 64.4, 30.0});
    operation.voxel = 1.0;
    Random random(11);
    operation.world_from_shape.rotation = random.rotation();
    const auto placed = PlacedVolume::create(shapes_test::wide_world(), 0, operation);
    ASSERT_TRUE(placed) << placed.error().message;
    const auto distance_to_ball = [](const Eigen::Vector3d& p, const Eigen::Vector3d& centre,
                                     double radius) { return (p - centre).norm() - radius; };
    int compared = 0;
    for (int i = 0; i < 3000; ++i) {
        const Eigen::Vector3d p(random.between(-20.0, 55.0), random.between(-20.0, 20.0),
                                random.between(-20.0, 20.0));
        const double onion =
            std::min(std::max(distance_to_ball(p, none, 17.0), -distance_to_ball(p, none, 12.0)),
                     distance_to_ball(p, none, 5.0));
        double other = distance_to_ball(p, aside, 12.0);
        for (const double x : {-4.0, 4.0}) {
            other =
                std::max(other, -distance_to_ball(p, aside + Eigen::Vector3d(x, 0.0, 1.0), 3.0));
        }
        const double expected = std::min(onion, other);
        if (std::abs(expected) < 0.1) continue;  // within the error of the balls' facets
        const double measured = placed->signed_distance(operation.world_from_shape * p);
        EXPECT_EQ(measured < 0.0, expected < 0.0) << p.transpose();
        if (std::abs(expected) < 1.5) {
            EXPECT_NEAR(measured, expected, 0.15) << p.transpose();
        }
        ++compared;
    }
    EXPECT_GT(compared, 2500);
}

TEST(MeshVolume, RefusesShellsWhoseTrianglesFaceTheWrongWay) {
    const Eigen::Vector3d at(64.0, 64.0, 30.0), none(0.0, 0.0, 0.0);
    VolumeMesh twice;
    add_shell(twice, ball(3, 15.0), none, false);
    add_shell(twice, ball(3, 8.0), none, false);
    EXPECT_NE(refusal(place(twice, at)).find("is inside the solid, but its triangles do not face"),
              std::string::npos)
        << refusal(place(twice, at));
    VolumeMesh beside;
    add_shell(beside, ball(3, 15.0), none, false);
    add_shell(beside, ball(3, 8.0), {30.0, 0.0, 0.0}, true);
    EXPECT_NE(refusal(place(beside, at)).find("is inside out: its triangles do not face outwards"),
              std::string::npos)
        << refusal(place(beside, at));
    // blocks that touch along a face bound two solids
    VolumeMesh block{{{-5, -5, -5},
                      {5, -5, -5},
                      {-5, 5, -5},
                      {5, 5, -5},
                      {-5, -5, 5},
                      {5, -5, 5},
                      {-5, 5, 5},
                      {5, 5, 5}},
                     {{0, 2, 1},
                      {1, 2, 3},
                      {4, 5, 6},
                      {5, 7, 6},
                      {0, 1, 4},
                      {1, 5, 4},
                      {2, 6, 3},
                      {3, 6, 7},
                      {0, 4, 2},
                      {2, 4, 6},
                      {1, 3, 5},
                      {3, 7, 5}}};
    for (const Eigen::Vector3d& offset :
         {Eigen::Vector3d(0, 0, 10), Eigen::Vector3d(10, 0, 0), Eigen::Vector3d(0, 10, 0)}) {
        VolumeMesh stack;
        add_shell(stack, block, none, false);
        add_shell(stack, block, offset, false);
        EXPECT_EQ(refusal(place(stack, at)), "") << offset.transpose();
    }
}

TEST(MeshVolume, RefusesMeshesThatBoundNoSolid) {
    const Eigen::Vector3d at(64.0, 64.0, 30.0);
    EXPECT_EQ(refusal(place(ball(3, 10.0), at)), "");
    VolumeMesh open = ball(2, 10.0);
    open.triangles.pop_back();
    EXPECT_NE(refusal(place(open, at)).find("the mesh is not closed: its edge from point"),
              std::string::npos);
    VolumeMesh inside_out = ball(2, 10.0);
    for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
    EXPECT_NE(refusal(place(inside_out, at)).find("the mesh is inside out"), std::string::npos);
    VolumeMesh crossing = ball(2, 10.0);
    const VolumeMesh other = ball(2, 10.0);
    const auto offset = static_cast<std::uint32_t>(crossing.points_shape.size());
    for (const Eigen::Vector3d& p : other.points_shape)
        crossing.points_shape.push_back(p + Eigen::Vector3d(7.1, 1.3, 0.4));
    for (const auto& t : other.triangles)
        crossing.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    EXPECT_NE(refusal(place(crossing, at)).find("the mesh crosses itself"), std::string::npos);
    EXPECT_EQ(refusal(place(VolumeMesh{}, at)), "a mesh must have 1 to 4194304 triangles, got 0");
    VolumeMesh missing = ball(0, 10.0);
    missing.triangles[3][1] = 12;
    EXPECT_EQ(refusal(place(missing, at)), "triangle 3 of a mesh names point 12 of 12");
    EXPECT_NE(refusal(place(ball(3, 0.4), at)).find("less than its voxel"), std::string::npos);
    EXPECT_NE(
        refusal(place(ball(3, 30.0), at), {.memory_bytes = 10'000}).find("more than memory_bytes"),
        std::string::npos);
    // A needle has little area, and its level set is around its edges.
    const VolumeMesh needle{{{-50, 0, 0}, {50, 0, 0}, {0, 1.2, 0}, {0, 0, 1.2}},
                            {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    EXPECT_EQ(refusal(place(needle, at)), "");
    EXPECT_NE(refusal(place(needle, at), {.memory_bytes = 100'000}).find("more than memory_bytes"),
              std::string::npos);
}

}  // namespace terrane::mesh_volume_test

// OpenVDB's reader leaks the nodes that it has read when it throws.
// NOLINTNEXTLINE(readability-identifier-naming): the sanitizer's name
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
    return "leak:readTopology\nleak:readBuffers\n";
}

namespace terrane::vdb_file_test {

using namespace test;

class VdbFile : public testing::Test {
protected:
    void SetUp() override { openvdb::initialize(); }

    std::string write(const openvdb::GridPtrVec& grids, const std::string& name = "a.vdb") {
        const std::string path = folder_.file(name);
        openvdb::io::File file(path);
        file.write(grids);
        file.close();
        return path;
    }
    static openvdb::FloatGrid::Ptr sphere(double radius, double voxel, double half_width = 3.0) {
        auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
            static_cast<float>(radius), openvdb::Vec3f(0.0f), static_cast<float>(voxel),
            static_cast<float>(half_width));
        grid->setName("ball");
        return grid;
    }
    static std::string refused(const std::string& path, const std::string& grid = {},
                               const VolumeSettings& settings = {}) {
        return refusal(place(VolumeFile{path, grid}, {64.0, 64.0, 30.0}), settings);
    }

    TemporaryFolder folder_;
};

TEST_F(VdbFile, IsContouredNearItsSurface) {
    const VolumeWorld world = flat_world();
    for (const double voxel : {0.8, 1.0, 1.7}) {
        const std::string path = write({sphere(15.0, voxel)});
        const auto operation = place(VolumeFile{path, "ball"}, {63.3, 64.4, 36.0});
        const Volumes volumes = Volumes::create(world.lattice, {&operation, 1}).value();
        const JoinedMesh mesh = join(world, volumes, contour_all(world, volumes));
        EXPECT_EQ(find_leak(world, mesh), "");
        EXPECT_LT(mesh_volume_test::farthest_from_sphere(mesh, {63.3, 64.4, 36.0}, 15.0),
                  0.06 * voxel * voxel);
    }
}

TEST_F(VdbFile, RefusesWhatIsNoLevelSetOfFloats) {
    EXPECT_EQ(refused(write({sphere(15.0, 1.0)})), "");
    EXPECT_NE(refused(folder_.file("none.vdb")).find("cannot read"), std::string::npos);
    EXPECT_NE(refused(write({sphere(15.0, 1.0)}), "other").find("none is called \"other\""),
              std::string::npos);
    EXPECT_NE(refused(write({sphere(15.0, 1.0), sphere(9.0, 1.0)})).find("has 2 grids"),
              std::string::npos);
    EXPECT_NE(refused(write({})).find("has 0 grids"), std::string::npos);
    auto fog = sphere(15.0, 1.0);
    fog->setGridClass(openvdb::GRID_FOG_VOLUME);
    EXPECT_NE(refused(write({fog})).find("is no level set of floats"), std::string::npos);
    auto other = openvdb::DoubleGrid::create(3.0);
    other->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_NE(refused(write({other})).find("is no level set of floats"), std::string::npos);
    auto empty = openvdb::FloatGrid::create(3.0f);
    empty->setGridClass(openvdb::GRID_LEVEL_SET);
    EXPECT_NE(refused(write({empty})).find("has no active voxels"), std::string::npos);
    EXPECT_NE(refused(write({sphere(15.0, 1.0, 1.5)})).find("less than two spacings"),
              std::string::npos);
    EXPECT_NE(refused(write({sphere(15.0, 1.0)}), "", {.memory_bytes = 1000})
                  .find("more than memory_bytes"),
              std::string::npos);
    auto tiled = sphere(15.0, 1.0);
    tiled->tree().addTile(3, openvdb::Coord(8192, 0, 0), tiled->background(), true);
    EXPECT_NE(refused(write({tiled})).find("more than memory_bytes"), std::string::npos);
    auto stretched = sphere(15.0, 1.0);
    stretched->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::math::Mat4d(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)));
    EXPECT_NE(refused(write({stretched})).find("not cubes"), std::string::npos);
}

TEST_F(VdbFile, RefusesValuesThatAreNoDistances) {
    auto steep = sphere(15.0, 1.0);
    steep->setTransform(openvdb::math::Transform::createLinearTransform(0.4));
    EXPECT_NE(refused(write({steep})).find("does not hold signed distances"), std::string::npos);
    auto broken = sphere(15.0, 1.0);
    broken->tree().setValue(openvdb::Coord(15, 0, 0), std::numeric_limits<float>::quiet_NaN());
    EXPECT_NE(refused(write({broken})).find("does not hold signed distances"), std::string::npos);
    auto turned = sphere(40.0, 1.0);
    turned->tree().addTile(1, openvdb::Coord(0, 0, 0), turned->background(), false);
    EXPECT_NE(refused(write({turned})).find("does not hold signed distances"), std::string::npos);
    auto open = sphere(15.0, 1.0);
    for (auto leaf = open->tree().beginLeaf(); leaf; ++leaf) {
        if (leaf->origin().z() < 8) continue;
        for (auto value = leaf->beginValueAll(); value; ++value) value.setValue(open->background());
    }
    EXPECT_NE(refused(write({open})).find("does not hold signed distances"), std::string::npos);
}

TEST_F(VdbFile, RefusesVoxelsAtTheEndsOfTheRangeOfIndices) {
    const int last = std::numeric_limits<int>::max();
    for (const int end : {last, -last - 1}) {
        auto tiled = sphere(15.0, 1.0);
        tiled->tree().addTile(3, openvdb::Coord(0, end, 0), -tiled->background(), false);
        EXPECT_NE(refused(write({tiled})).find("indices beyond 2^30"), std::string::npos);
        auto voxel = sphere(15.0, 1.0);
        voxel->tree().setValue(openvdb::Coord(end, 0, end), voxel->background());
        EXPECT_NE(refused(write({voxel})).find("indices beyond 2^30"), std::string::npos);
    }
}

TEST_F(VdbFile, RefusesTruncatedAndForeignFiles) {
    const std::string path = write({sphere(15.0, 1.0)});
    const std::vector<char> bytes = read_file(path);
    for (std::size_t part = 0; part < 40; ++part) {
        const std::string cut = folder_.file("cut.vdb");
        write_file(cut, {bytes.begin(),
                         bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * part / 40)});
        EXPECT_NE(refused(cut), "") << part;
        EXPECT_EQ(refused(cut).find('\n'), std::string::npos);
    }
    const std::string foreign = folder_.file("foreign.vdb");
    std::ofstream(foreign) << "# not a file of OpenVDB\n" << std::string(5000, 'x');
    EXPECT_NE(refused(foreign).find("cannot read"), std::string::npos);
    EXPECT_NE(refused(folder_.path()), "");
}

std::optional<internal::VdbOffsets> check_lengths(const std::string& bytes) {
    std::istringstream in(bytes, std::ios::binary);
    return internal::check_vdb_lengths(in, bytes.size());
}

// OpenVDB would allocate and clear as many bytes as a length says.
TEST_F(VdbFile, RefusesLengthsThatDoNotFitInTheFile) {
    auto ball = sphere(15.0, 1.0);
    ball->insertMeta("author", openvdb::StringMetadata("somebody"));
    std::ostringstream of_stream(std::ios::binary);
    openvdb::io::Stream(of_stream).write(openvdb::GridCPtrVec{ball});
    const std::vector<char> written = read_file(write({ball, sphere(9.0, 1.0)}));
    const std::string of_file(written.begin(), written.end());
    EXPECT_EQ(check_lengths(of_stream.str()), internal::VdbOffsets::absent);
    EXPECT_EQ(check_lengths(of_file), internal::VdbOffsets::present);
    for (const std::string& bytes : {of_stream.str(), of_file}) {
        int lengths = 0;
        for (const std::string text : {"ball", "Tree_float_5_4_3", "author", "string", "somebody",
                                       "class", "level set", "file_mem_bytes", "UniformScaleMap"}) {
            const std::string counted =
                std::string{static_cast<char>(text.size()), '\0', '\0', '\0'} + text;
            for (std::size_t at = bytes.find(counted); at != std::string::npos;
                 at = bytes.find(counted, at + 1)) {
                std::string longer = bytes;
                longer[at + 3] = '\x7f';
                EXPECT_FALSE(check_lengths(longer)) << text;
                ++lengths;
            }
        }
        EXPECT_GT(lengths, 8);
        const std::string path = folder_.file("longer.vdb");
        std::string longer = bytes;
        longer[bytes.find("somebody") - 1] = '\x7f';
        std::ofstream(path, std::ios::binary) << longer;
        EXPECT_EQ(refused(path), "cannot read \"" + path + "\": it is damaged");
        // Every end before the first voxels.
        for (std::size_t size = 0; size < bytes.find("UniformScaleMap"); ++size) {
            EXPECT_TRUE(size < 12 || !check_lengths(bytes.substr(0, size))) << size;
        }
    }
    // Descriptors that go back in the file: it would never end.
    std::string back = of_file;
    const std::size_t descriptor = back.find("Tree_float_5_4_3");
    const std::size_t end = back.find('\0', descriptor) + 4 + 16;
    for (std::size_t i = 0; i < 8; ++i) back[end + i] = '\0';
    EXPECT_FALSE(check_lengths(back));
}

TEST_F(VdbFile, ReadsWhatAStreamWrote) {
    const std::string path = folder_.file("stream.vdb");
    std::ofstream out(path, std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{sphere(15.0, 1.0)});
    out.close();
    EXPECT_EQ(refused(path, "ball"), "");
    EXPECT_NE(refused(path, "other").find("none is called \"other\""), std::string::npos);
    EXPECT_NE(refused(path, "ball", {.memory_bytes = 400'000}).find("more than memory_bytes"),
              std::string::npos);
}

}  // namespace terrane::vdb_file_test
