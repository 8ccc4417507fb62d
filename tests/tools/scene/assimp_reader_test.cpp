// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"

#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <assimp/Importer.hpp>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

namespace terrane::tools {
namespace {

const std::string kStlText =
    "solid s\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 3\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 2 3\nvertex 0 2 3\nendloop\nendfacet\n"
    "endsolid s\n";

std::string glb_of(const IndexedMesh& mesh) {
    const std::string path =
        (std::filesystem::path(testing::TempDir()) / "terrane_assimp_reader.glb").string();
    EXPECT_TRUE(write_mesh(mesh, MeshFormat::glb, path));
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    std::filesystem::remove(path);
    return bytes;
}

std::string glb_of_two_triangles() {
    IndexedMesh mesh;
    mesh.vertices_world = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 2.0, 3.0}, {1.0, 2.0, 3.0}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
    return glb_of(mesh);
}

TEST(AssimpReader, GlbHasZUpAndTheTranslationOfItsNode) {
    const Result<TriangleMesh> mesh = parse_with_assimp(glb_of_two_triangles(), "glb");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 2u);
    const std::array<Eigen::Vector3d, 3> expected{
        {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 2.0, 3.0}}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(mesh->positions[mesh->triangles[0][i]], expected[i]);
    }
}

TEST(AssimpReader, ReadsAFrameThatWasWrittenAsGlb) {
    const auto source = FractalHeights::create({.seed = 3}).value();
    Pager pager = Pager::create(source, {.worker_count = 0}).value();
    const View view = look_at({0.0, 0.0, 900.0}, {4000.0, 3000.0, 0.0}, 1.0, 640, 480).value();
    const CameraNeed camera{.view = view, .threshold_px = 8.0};
    pager.update({&camera, 1}, {}, 0.0);
    Triangulator triangulator = Triangulator::create(*source, {.triangle_budget = 5000}).value();
    const IndexedMesh frame = weld(triangulator.update(pager.resident(), view), Normals::with);
    ASSERT_GT(frame.triangles.size(), 1000u);
    ASSERT_EQ(frame.normals.size(), frame.vertices_world.size());
    const std::string bytes = glb_of(frame);
    const Result<TriangleMesh> mesh = parse_with_assimp(bytes, "glb");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), frame.triangles.size());
    // the reader keeps no normals: assimp's own scene has them, in glTF's axes
    Assimp::Importer importer;
    const aiScene* const scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, "glb");
    ASSERT_NE(scene, nullptr) << importer.GetErrorString();
    const aiMesh& read_mesh = *scene->mMeshes[0];
    ASSERT_EQ(read_mesh.mNumFaces, frame.triangles.size());
    ASSERT_TRUE(read_mesh.HasNormals());
    // the world is 131 km wide: rounding of float, and of the reader's matrices
    for (std::size_t i = 0; i < frame.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t read = mesh->triangles[i][k], written = frame.triangles[i][k];
            ASSERT_LT((mesh->positions[read] - frame.vertices_world[written]).norm(), 0.03);
            const aiVector3D& n = read_mesh.mNormals[read_mesh.mFaces[i].mIndices[k]];
            const Eigen::Vector3f normal(n.x, -n.z, n.y);
            ASSERT_LT((normal - frame.normals[written]).norm(), 1e-6f);
        }
    }
}

TEST(AssimpReader, StlKeepsItsAxes) {
    const Result<TriangleMesh> mesh = parse_with_assimp(kStlText, "stl");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 2u);
    EXPECT_EQ(mesh->positions[mesh->triangles[0][2]], Eigen::Vector3d(0.0, 2.0, 3.0));
}

TEST(AssimpReader, ForeignAndEmptyBytesAreRefused) {
    for (const char* ending : {"glb", "gltf", "stl"}) {
        for (const char* bytes : {"", "v 0 0 0\n", "{}", "glTF"}) {
            const Result<TriangleMesh> mesh = parse_with_assimp(bytes, ending);
            EXPECT_TRUE(!mesh || mesh->triangles.empty()) << ending << ": " << bytes;
        }
    }
}

TEST(AssimpReader, ChangedAndTruncatedFilesNeverThrow) {
    constexpr unsigned kSeed = 20240611;
    std::mt19937 random(kSeed);
    const std::string glb = glb_of_two_triangles();
    for (const auto& [ending, whole] :
         {std::pair<std::string, std::string>{"glb", glb}, {"stl", kStlText}}) {
        for (int round = 0; round < 400; ++round) {
            SCOPED_TRACE(testing::Message() << ending << " round " << round << " seed " << kSeed);
            std::string bytes = whole;
            if (round % 4 == 0) bytes.resize(random() % bytes.size());
            for (unsigned flips = 1 + random() % 4; !bytes.empty() && flips > 0; --flips) {
                bytes[random() % bytes.size()] = static_cast<char>(random() & 0xffu);
            }
            const Result<TriangleMesh> mesh = parse_with_assimp(bytes, ending);
            if (!mesh) continue;
            for (const auto& triangle : mesh->triangles) {
                EXPECT_LT(std::ranges::max(triangle), mesh->positions.size());
            }
        }
    }
}

}  // namespace
}  // namespace terrane::tools
