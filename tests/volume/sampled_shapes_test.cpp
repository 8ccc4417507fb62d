// SPDX-License-Identifier: MIT
// Meshes and .vdb files.
#include "support/random.h"
#include "volume/joined_mesh.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

namespace terrane {
namespace sampled_shapes_test {

using namespace test;

/// A sphere of radius 1: an octahedron, divided.
VolumeMesh ball(int divisions, double radius) {
    VolumeMesh mesh;
    mesh.points_shape = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int i = 0; i < divisions; ++i) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [found, is_new] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::uint32_t>(mesh.points_shape.size()));
            if (is_new)
                mesh.points_shape.push_back(
                    (mesh.points_shape[a] + mesh.points_shape[b]).normalized());
            return found->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = finer;
    }
    for (Eigen::Vector3d& p : mesh.points_shape) p *= radius;
    return mesh;
}

VolumeWorld flat_world() {
    return VolumeWorld::make(1, 1.0, [](int, int) { return 40.0; });
}

VolumeOperation place(VolumeShape shape, const Eigen::Vector3d& at) {
    VolumeOperation operation{.shape = std::move(shape), .voxel = 1.0};
    operation.world_from_shape.translation = at;
    return operation;
}

std::string refusal(const VolumeOperation& operation, const VolumeSettings& settings = {}) {
    const auto placed = PlacedVolume::create(flat_world().lattice, 0, operation, settings);
    return placed ? "" : placed.error().message;
}

TEST(MeshVolume, IsWatertightAndNearItsMeshWhereverItIsTurned) {
    const VolumeWorld world = flat_world();
    Random random(5);
    for (const double z : {20.0, 38.0}) {
        auto operation = place(ball(5, 15.0), {63.3, 64.4, z});
        operation.world_from_shape.rotation = random.rotation();
        const std::vector<VolumeOperation> list = {operation};
        const Volumes volumes = Volumes::create(world.lattice, list).value();
        const auto contours = contour_all(world, volumes);
        const JoinedMesh mesh = join(world, volumes, contours);
        EXPECT_EQ(find_leak(world, mesh), "");
        double worst = 0.0;
        for (const VolumeContour& contour : contours) {
            for (std::size_t i = 0; i < contour.keys.size(); ++i) {
                if (contour.keys[i].is_sample()) continue;
                const Eigen::Vector3d p =
                    contour.positions_world[i] - operation.world_from_shape.translation;
                worst = std::max(worst, std::abs(p.norm() - 15.0));
            }
        }
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
    missing.triangles[3][1] = 6;
    EXPECT_EQ(refusal(place(missing, at)), "triangle 3 of a mesh names point 6 of 6");
    EXPECT_NE(refusal(place(ball(3, 0.4), at)).find("less than its voxel"), std::string::npos);
    EXPECT_NE(
        refusal(place(ball(3, 30.0), at), {.memory_bytes = 10'000}).find("more than memory_bytes"),
        std::string::npos);
}

class VdbFile : public testing::Test {
protected:
    void SetUp() override {
        openvdb::initialize();
        std::random_device entropy;
        folder_ = std::filesystem::temp_directory_path() /
                  ("terrane_volume_" + std::to_string(entropy()));
        std::filesystem::create_directory(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::string write(const openvdb::GridPtrVec& grids, const std::string& name = "a.vdb") {
        const std::string path = (folder_ / name).string();
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

    std::filesystem::path folder_;
};

TEST_F(VdbFile, IsContouredNearItsSurface) {
    const VolumeWorld world = flat_world();
    for (const double voxel : {0.8, 1.0, 1.7}) {
        const std::string path = write({sphere(15.0, voxel)});
        const std::vector<VolumeOperation> list = {
            place(VolumeFile{path, "ball"}, {63.3, 64.4, 36.0})};
        const Volumes volumes = Volumes::create(world.lattice, list).value();
        const JoinedMesh mesh = join(world, volumes, contour_all(world, volumes));
        EXPECT_EQ(find_leak(world, mesh), "");
        double worst = 0.0;
        for (std::size_t i = 0; i < mesh.keys.size(); ++i) {
            if (mesh.keys[i].is_sample()) continue;
            worst = std::max(
                worst,
                std::abs((mesh.positions[i] - Eigen::Vector3d(63.3, 64.4, 36.0)).norm() - 15.0));
        }
        EXPECT_LT(worst, 0.06 * voxel * voxel);
    }
}

TEST_F(VdbFile, RefusesWhatIsNoLevelSetOfFloats) {
    EXPECT_EQ(refused(write({sphere(15.0, 1.0)})), "");
    EXPECT_NE(refused((folder_ / "none.vdb").string()).find("cannot read"), std::string::npos);
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

TEST_F(VdbFile, RefusesTruncatedAndForeignFiles) {
    const std::string path = write({sphere(15.0, 1.0)});
    std::ifstream in(path, std::ios::binary);
    const std::vector<char> bytes((std::istreambuf_iterator<char>(in)), {});
    for (std::size_t part = 0; part < 40; ++part) {
        const std::string cut = (folder_ / "cut.vdb").string();
        std::ofstream(cut, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size() * part / 40));
        EXPECT_NE(refused(cut), "") << part;
        EXPECT_EQ(refused(cut).find('\n'), std::string::npos);
    }
    const std::string foreign = (folder_ / "foreign.vdb").string();
    std::ofstream(foreign) << "# not a file of OpenVDB\n" << std::string(5000, 'x');
    EXPECT_NE(refused(foreign).find("cannot read"), std::string::npos);
    EXPECT_NE(refused(folder_.string()), "");
}

}  // namespace sampled_shapes_test
}  // namespace terrane
