// SPDX-License-Identifier: MIT
#include "objects/store/mesh_store.h"

#include "gl/gl_error.h"

#include <terrane/scene/bounds.h>
#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <limits>
#include <string>

namespace terrane::internal {
namespace {

using Triangle = TriangleMesh::Triangle;

// Levels of fewer triangles have no clusters: a few clusters of wide cones are rarely culled.
constexpr std::size_t kLeastClustered = 256;

Result<void> check_levels(const TriangleMesh& mesh, std::span<const MeshLevel> levels) {
    std::size_t indices = 0;
    for (std::size_t level = 0; level < levels.size(); ++level) {
        const auto& [triangles, targets] = levels[level];
        indices += 3 * triangles.size();
        const auto refuse = [&](const char* what, std::uint32_t vertex, std::size_t count) {
            return fail(ErrorCode::invalid_argument, "level " + number_text(level) + what +
                                                         number_text(vertex) + " of " +
                                                         number_text(count));
        };
        for (const Triangle& t : triangles) {
            const std::uint32_t most = std::max({t[0], t[1], t[2]});
            if (most >= mesh.positions.size())
                return refuse(" names vertex ", most, mesh.positions.size());
            if (!targets.empty() && most >= targets.size())
                return refuse(" has no morph target for vertex ", most, targets.size());
        }
        for (const std::uint32_t target : targets) {
            if (target >= mesh.positions.size())
                return refuse(" morphs to vertex ", target, mesh.positions.size());
        }
    }
    if (indices > std::numeric_limits<std::int32_t>::max()) {
        return fail(ErrorCode::invalid_argument,
                    "a mesh must have at most 2^31 indices, got " + number_text(indices));
    }
    return {};
}

std::vector<ObjectVertex> make_vertices(const TriangleMesh& mesh, const MeshMaterial& material) {
    const std::vector<Eigen::Vector3f> normals =
        mesh.normals.empty() ? vertex_normals(mesh) : mesh.normals;
    std::vector<ObjectVertex> vertices(mesh.positions.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        ObjectVertex& vertex = vertices[i];
        for (int axis = 0; axis < 3; ++axis) {
            vertex.position[axis] = static_cast<float>(mesh.positions[i][axis]);
            vertex.normal[axis] = normals[i][axis];
        }
        if (mesh.colours.empty()) {
            std::copy(material.colour.begin(), material.colour.end(), vertex.colour);
            vertex.colour[3] = 255;
        } else {
            std::copy(mesh.colours[i].begin(), mesh.colours[i].end(), vertex.colour);
        }
    }
    return vertices;
}

}  // namespace

std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh) {
    std::vector<Eigen::Vector3d> sums(mesh.positions.size(), Eigen::Vector3d::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Eigen::Vector3d& a = mesh.positions[t[0]];
        const Eigen::Vector3d normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
        for (const std::uint32_t vertex : t) sums[vertex] += normal;
    }
    std::vector<Eigen::Vector3f> normals;
    for (const Eigen::Vector3d& sum : sums) {
        const double length = sum.norm();
        normals.push_back(length > 0.0 ? Eigen::Vector3f((sum / length).cast<float>())
                                       : Eigen::Vector3f(Eigen::Vector3f::UnitZ()));
    }
    return normals;
}

Result<MeshId> MeshStore::add(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                              const MeshMaterial& material) {
    if (auto ok = check(mesh); !ok) return tl::unexpected(ok.error());
    const MeshLevel whole = {.triangles = mesh.triangles};
    if (levels.empty()) levels = {&whole, 1};
    if (auto ok = check_levels(mesh, levels); !ok) return tl::unexpected(ok.error());
    StoredMesh stored;
    stored.vertices = make_vertices(mesh, material);
    stored.bounds = bounding_box(mesh.positions);
    stored.is_two_sided = material.is_two_sided;
    const auto upload = [&](const void* data, std::size_t bytes) {
        GlBuffer buffer = make_buffer();
        // a buffer must have a size
        glNamedBufferStorage(buffer.name(),
                             static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 4)),
                             bytes > 0 ? data : nullptr, 0);
        stored.bytes += bytes;
        return buffer;
    };
    std::vector<Triangle> indices;
    for (const MeshLevel& level : levels) {
        StoredMesh::Level& made = stored.levels.emplace_back();
        made.first_index = static_cast<std::uint32_t>(3 * indices.size());
        made.index_count = static_cast<std::uint32_t>(3 * level.triangles.size());
        if (!stored.is_two_sided && level.triangles.size() >= kLeastClustered) {
            Result<MeshClusters> clusters = MeshClusters::create(mesh.positions, level.triangles);
            if (!clusters) return tl::unexpected(clusters.error());
            for (const std::uint32_t i : clusters->order()) indices.push_back(level.triangles[i]);
            made.clusters = *std::move(clusters);
        } else {
            indices.insert(indices.end(), level.triangles.begin(), level.triangles.end());
        }
        if (level.morph_targets.empty()) continue;
        std::vector<ObjectVertex> moved;
        for (const std::uint32_t target : level.morph_targets)
            moved.push_back(stored.vertices[target]);
        made.targets = upload(moved.data(), moved.size() * sizeof(ObjectVertex));
    }
    stored.vertex_buffer =
        upload(stored.vertices.data(), stored.vertices.size() * sizeof(ObjectVertex));
    stored.index_buffer = upload(indices.data(), indices.size() * sizeof(Triangle));
    if (auto ok = check_gl("keep a mesh of " + number_text(indices.size()) + " triangles"); !ok)
        return tl::unexpected(ok.error());
    const MeshId id{next_++};
    meshes_.emplace(id, std::move(stored));
    return id;
}

const StoredMesh* MeshStore::find(MeshId mesh) const {
    const auto found = meshes_.find(mesh);
    return found == meshes_.end() ? nullptr : &found->second;
}

std::size_t MeshStore::bytes() const {
    std::size_t bytes = 0;
    for (const auto& [id, mesh] : meshes_) bytes += mesh.bytes;
    return bytes;
}

}  // namespace terrane::internal
