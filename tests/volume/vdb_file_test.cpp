// SPDX-License-Identifier: MIT
#include "level_set/sampled_shape.h"
#include "volume/flat_world.h"
#include "volume/joined_mesh.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>

// OpenVDB's reader leaks the nodes that it has read when it throws.
// NOLINTNEXTLINE(readability-identifier-naming): the sanitizer's name
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
    return "leak:readTopology\nleak:readBuffers\n";
}

namespace terrane {
namespace vdb_file_test {

using namespace test;

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
            if (mesh.keys[i].is_node()) continue;
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
    std::ifstream in(write({ball, sphere(9.0, 1.0)}), std::ios::binary);
    const std::string of_file((std::istreambuf_iterator<char>(in)), {});
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
        const std::string path = (folder_ / "longer.vdb").string();
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
    const std::string path = (folder_ / "stream.vdb").string();
    std::ofstream out(path, std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{sphere(15.0, 1.0)});
    out.close();
    EXPECT_EQ(refused(path, "ball"), "");
    EXPECT_NE(refused(path, "other").find("none is called \"other\""), std::string::npos);
    EXPECT_NE(refused(path, "ball", {.memory_bytes = 400'000}).find("more than memory_bytes"),
              std::string::npos);
}

}  // namespace vdb_file_test
}  // namespace terrane
