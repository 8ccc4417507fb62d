// SPDX-License-Identifier: MIT
#include "conversions.h"
#include "terrain.h"

#include <terrane/terrain/lattice.h>

#include <array>
#include <unordered_map>
#include <vector>

namespace terrane::python {
namespace {

struct PointHash {
    std::size_t operator()(const LatticePoint& point) const {
        const auto x = static_cast<std::uint64_t>(point.x) * 0x9e3779b97f4a7c15u;
        const auto y = static_cast<std::uint64_t>(point.y) * 0xd1b54a32d192ed03u;
        return static_cast<std::size_t>((x ^ (y << 1 | y >> 63)) >> 7);
    }
};

// Joins all chunks into one indexed mesh. A sample that several chunks draw becomes one vertex, because its displayed
// position has the same bits in all of them. Vertices are in order of first use.
class Welder {
public:
    explicit Welder(const TerrainMesh& mesh) : mesh_(mesh), lattice_(mesh.resident->lattice()) {
        triangles_.reserve(mesh.triangle_count);
        for (const MeshChunk& chunk : mesh.chunks) add(chunk);
        for (const MeshSolid& solid : mesh.solids) add(solid);
    }

    py::object vertices() const {
        py::array_t<double> array({static_cast<py::ssize_t>(vertices_.size()), py::ssize_t{3}});
        double* out = array.mutable_data();
        for (const WorldPos& p_world : vertices_) {
            write_vector(p_world, out);
            out += 3;
        }
        return array;
    }

    py::object triangles() const {
        const auto count = static_cast<py::ssize_t>(triangles_.size());
        return py::array_t<std::uint32_t>({count, py::ssize_t{3}},
                                          triangles_.empty() ? nullptr : triangles_[0].data());
    }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    void add(const MeshChunk& drawn) {
        const Chunk& chunk = *drawn.chunk;
        std::vector<std::uint32_t> vertex(chunk.heights.size(), kNone);
        for (std::uint32_t i = 0; i < drawn.index_count; i += 3) {
            std::array<std::uint32_t, 3> triangle{};
            for (std::uint32_t corner = 0; corner < 3; ++corner) {
                const std::size_t sample = mesh_.indices[drawn.first_index + i + corner];
                if (vertex[sample] == kNone) vertex[sample] = vertex_of(drawn, sample);
                triangle[corner] = vertex[sample];
            }
            triangles_.push_back(triangle);
        }
    }

    std::uint32_t vertex_of(const MeshChunk& drawn, std::size_t sample) {
        const auto column = static_cast<std::int64_t>(sample % kChunkSamples);
        const auto row = static_cast<std::int64_t>(sample / kChunkSamples);
        const Chunk& chunk = *drawn.chunk;
        const LatticePoint place{chunk.corner.x + column * chunk.step,
                                 chunk.corner.y + row * chunk.step};
        const auto next = static_cast<std::uint32_t>(vertices_.size());
        const auto [found, is_new] = known_.try_emplace(place, next);
        if (is_new) {
            vertices_.emplace_back(lattice_.x(place.x), lattice_.y(place.y),
                                   drawn.displayed_height(sample, lattice_.quantum));
        }
        return found->second;
    }

    // Vertices of volumes are not shared with other chunks.
    void add(const MeshSolid& solid) {
        const auto& vertices = solid.chunk->solid->triangles().vertices_world;
        const auto first = static_cast<std::uint32_t>(vertices_.size());
        vertices_.insert(vertices_.end(), vertices.begin(), vertices.end());
        const auto append = [&](const MeshSolid::Triangles& triangles) {
            for (const auto& [a, b, c] : triangles)
                triangles_.push_back({first + a, first + b, first + c});
        };
        append(solid.triangles);
        for (const MeshSolid::Triangles& cap : solid.caps) append(cap);
    }

    const TerrainMesh& mesh_;
    const Lattice& lattice_;
    std::unordered_map<LatticePoint, std::uint32_t, PointHash> known_;
    std::vector<WorldPos> vertices_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;
};

void make_arrays(Mesh& mesh) {
    if (mesh.vertices) return;
    if (mesh.mesh.resident == nullptr) {
        mesh.vertices = py::array_t<double>(std::vector<py::ssize_t>{0, 3});
        mesh.triangles = py::array_t<std::uint32_t>(std::vector<py::ssize_t>{0, 3});
        return;
    }
    const auto use = mesh.use();
    const Welder welder = without_lock([&] { return Welder(mesh.mesh); });
    mesh.vertices = welder.vertices();
    mesh.triangles = welder.triangles();
}

}  // namespace

Guarded<HeldTerrain>::Use Mesh::use() const {
    // A running update() has already incremented the count, and none can start while the interpreter lock is held.
    if (terrain->updates.load() != update)
        throw std::runtime_error("this Mesh was valid until the next update() of its Terrain");
    return terrain->held.read();
}

void bind_meshes(py::module_& module) {
    py::class_<Mesh>(
        module, "Mesh",
        R"(A frame's mesh of a camera. Its arrays can be asked for until the next update() of its Terrain, which is a
RuntimeError afterwards; arrays that were asked for stay valid. Numbers can always be read.)")
        .def_property_readonly(
            "vertices",
            [](Mesh& mesh) {
                make_arrays(mesh);
                return mesh.vertices;
            },
            "Displayed places, morphing included: float64 of shape (n, 3), world, metres. Shared "
            "by triangles.")
        .def_property_readonly(
            "triangles",
            [](Mesh& mesh) {
                make_arrays(mesh);
                return mesh.triangles;
            },
            "Indices of vertices: uint32 of shape (m, 3), counter-clockwise from above.")
        .def_property_readonly(
            "triangle_count", [](const Mesh& mesh) { return mesh.mesh.triangle_count; },
            "Number of triangles, at most the budget.")
        .def_property_readonly(
            "status",
            [](const Mesh& mesh) {
                return make_answer("MeshStatus", static_cast<int>(mesh.mesh.status));
            },
            "Whether the mesh meets its target, and why not: MeshStatus.")
        .def_property_readonly(
            "error_px", [](const Mesh& mesh) { return mesh.mesh.error_px; },
            "Certified bound of the displayed surface's distance from the true one, pixels.");
}

}  // namespace terrane::python
