// SPDX-License-Identifier: MIT
//
// The only source that includes assimp. PLY and OBJ have other readers: see mesh_reader.cpp.
#include "scene/mesh_files.h"

#include <assimp/BaseImporter.h>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <set>
#include <utility>

namespace terrane::tools {
namespace {

constexpr int kMostNodeDepth = 256;

std::uint8_t to_level(float value) {
    // NaN becomes 0
    return static_cast<std::uint8_t>(255.0f * (value > 0.0f ? std::min(value, 1.0f) : 0.0f) + 0.5f);
}

/// @param is_linear whether the file's colours are linear, as in glTF; other formats have display gamma
std::array<std::uint8_t, 4> to_colour(const aiColor4D& c, bool is_linear) {
    const auto level = [&](float value) {
        return to_level(is_linear ? std::pow(std::max(value, 0.0f), 1.0f / 2.2f) : value);
    };
    return {level(c.r), level(c.g), level(c.b), to_level(c.a)};
}

Eigen::Affine3d to_affine(const aiMatrix4x4& m) {
    Eigen::Affine3d affine = Eigen::Affine3d::Identity();
    affine.matrix().topRows<3>() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2,
        m.c3, m.c4;
    return affine;
}

/// Opens nothing: an input file must not cause other files to be read.
class NoFiles : public Assimp::IOSystem {
public:
    bool Exists(const char* /*path*/) const override { return false; }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* /*path*/, const char* /*mode*/) override { return nullptr; }
    void Close(Assimp::IOStream* /*stream*/) override {}
};

/// Whether a file has a GLB header whose lengths fit in the file: assimp allocates by these lengths before it reads.
bool has_glb_header(std::string_view bytes) {
    std::uint32_t words[5];  // magic, version, file length, length and type of chunk 0
    if (bytes.size() < sizeof words) return false;
    std::memcpy(words, bytes.data(), sizeof words);
    return bytes.starts_with("glTF") && words[2] <= bytes.size() &&
           words[3] <= bytes.size() - sizeof words;
}

/// Joins the meshes of all nodes.
class SceneJoiner {
public:
    SceneJoiner(const aiScene& scene, bool is_linear) : scene_(scene), is_linear_(is_linear) {}

    Result<void> add(const aiNode& node, const Eigen::Affine3d& parent, int depth = 0) {
        if (depth > kMostNodeDepth) {
            return fail(ErrorCode::bad_data,
                        fmt::format("its nodes are nested deeper than {}", kMostNodeDepth));
        }
        const Eigen::Affine3d to_file = parent * to_affine(node.mTransformation);
        for (unsigned i = 0; i < node.mNumMeshes; ++i) {
            TERRANE_TRY(add_mesh(*scene_.mMeshes[node.mMeshes[i]], to_file));
        }
        for (unsigned i = 0; i < node.mNumChildren; ++i) {
            TERRANE_TRY(add(*node.mChildren[i], to_file, depth + 1));
        }
        return {};
    }

    TriangleMesh take() {
        if (!has_colours_) mesh_.colours.clear();
        return std::move(mesh_);
    }

private:
    Result<void> add_mesh(const aiMesh& part, const Eigen::Affine3d& to_file) {
        if (part.mNumVertices > kMostMeshParts - mesh_.positions.size()) {
            return fail(ErrorCode::bad_data,
                        fmt::format("it has more than {} points", kMostMeshParts));
        }
        const auto first = static_cast<std::int64_t>(mesh_.positions.size());
        const Eigen::Matrix3d linear = to_file.linear();
        const bool is_mirrored = linear.determinant() < 0.0;  // reverses triangles
        const aiColor4D colour = base_colour(part);
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiVector3D& p = part.mVertices[i];
            mesh_.positions.push_back(to_file * Eigen::Vector3d(p.x, p.y, p.z));
            mesh_.colours.push_back(
                to_colour(part.HasVertexColors(0) ? part.mColors[0][i] : colour, is_linear_));
        }
        std::vector<std::int64_t> corners;
        for (unsigned i = 0; i < part.mNumFaces; ++i) {
            const aiFace& face = part.mFaces[i];
            if (face.mNumIndices < 3) continue;  // points and lines
            corners.clear();
            for (unsigned k = 0; k < face.mNumIndices; ++k) {
                if (face.mIndices[k] >= part.mNumVertices) {
                    return fail(ErrorCode::bad_data,
                                fmt::format("a face names point {} of {}", face.mIndices[k],
                                            part.mNumVertices));
                }
                corners.push_back(first + face.mIndices[k]);
            }
            if (is_mirrored) std::ranges::reverse(corners);
            TERRANE_TRY(add_polygon(corners, mesh_));
        }
        return {};
    }

    aiColor4D base_colour(const aiMesh& part) {
        aiColor4D colour(1.0f, 1.0f, 1.0f, 1.0f);
        has_colours_ |= part.HasVertexColors(0);
        if (part.mMaterialIndex < scene_.mNumMaterials &&
            scene_.mMaterials[part.mMaterialIndex]->Get(AI_MATKEY_COLOR_DIFFUSE, colour) ==
                aiReturn_SUCCESS) {
            has_colours_ = true;
        }
        return colour;
    }

    const aiScene& scene_;
    TriangleMesh mesh_;
    bool is_linear_;  // of the file's colours
    bool has_colours_ = false;
};

}  // namespace

Result<TriangleMesh> parse_with_assimp(std::string_view bytes, const std::string& ending) {
    if (ending == "glb" && !has_glb_header(bytes)) {
        return fail(ErrorCode::bad_data, "it is no GLB file, or ends early");
    }
    try {
        Assimp::Importer importer;
        importer.SetIOHandler(new NoFiles);  // owned by the importer
        // keeps only the importer for the extension: others would guess the format from the content
        for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
            Assimp::BaseImporter* const kind = importer.GetImporter(i);
            std::set<std::string> endings;
            kind->GetExtensionList(endings);
            if (!endings.contains(ending)) {
                importer.UnregisterLoader(kind);
                delete kind;
            }
        }
        const aiScene* const scene = importer.ReadFileFromMemory(
            bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, ending.c_str());
        if (scene == nullptr || scene->mRootNode == nullptr) {
            return fail(ErrorCode::bad_data, importer.GetErrorString());
        }
        const bool is_gltf = ending == "gltf" || ending == "glb";
        Eigen::Affine3d to_z_up = Eigen::Affine3d::Identity();
        if (is_gltf) {
            to_z_up.linear() << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
        }
        SceneJoiner joiner(*scene, is_gltf);
        TERRANE_TRY(joiner.add(*scene->mRootNode, to_z_up));
        return joiner.take();
    } catch (const std::exception& error) {
        return fail(ErrorCode::bad_data, error.what());
    }
}

}  // namespace terrane::tools
