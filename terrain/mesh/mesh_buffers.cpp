// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/base/math.h>
#include <terrane/terrain/mesh_buffers.h>
#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Normals of a chunk's samples from central differences, across borders to resident chunks of the same level;
/// one-sided at other borders.
class SampleNormals {
public:
    /// @param resident, chunk must outlive this object
    SampleNormals(const ResidentSet& resident, const Chunk& chunk);
    /// Unit, pointing up. @param sample  sample_index()
    Eigen::Vector3f at(std::size_t sample) const;

private:
    const Chunk& chunk_;
    const Chunk* west_;
    const Chunk* east_;
    const Chunk* south_;
    const Chunk* north_;
    double slope_of_quantum_;  // slope of a rise by one quantum per spacing
};

/// Normals of the vertices of a chunk's volumes: area-weighted means over a vertex's triangles in this frame, or +z if
/// the vertex has none.
std::vector<Eigen::Vector3f> solid_normals(const MeshSolid& solid);

/// Calls visit(triangle) with the indices of each triangle of a chunk's volumes in this frame.
template <class Visit>
void visit_triangles(const MeshSolid& solid, Visit visit) {
    for (const auto& triangle : solid.triangles) visit(triangle);
    for (const MeshSolid::Triangles& cap : solid.caps) {
        for (const auto& triangle : cap) visit(triangle);
    }
}

SampleNormals::SampleNormals(const ResidentSet& resident, const Chunk& chunk)
    : chunk_(chunk),
      west_(resident.find_chunk({chunk.key.x - 1, chunk.key.y, chunk.key.level})),
      east_(resident.find_chunk({chunk.key.x + 1, chunk.key.y, chunk.key.level})),
      south_(resident.find_chunk({chunk.key.x, chunk.key.y - 1, chunk.key.level})),
      north_(resident.find_chunk({chunk.key.x, chunk.key.y + 1, chunk.key.level})),
      slope_of_quantum_(resident.lattice().quantum /
                        (resident.lattice().spacing * static_cast<double>(chunk.step))) {}

Eigen::Vector3f SampleNormals::at(std::size_t sample) const {
    const auto column = static_cast<int>(sample % kChunkSamples);
    const auto row = static_cast<int>(sample / kChunkSamples);
    struct Side {
        double height;
        int steps;  // 0 if there is no sample on this side
    };
    const double here = chunk_.heights[sample];
    const auto beside = [&](int c, int r, const Chunk* neighbour) -> Side {
        const bool is_inside = c >= 0 && r >= 0 && c < kChunkSamples && r < kChunkSamples;
        if (is_inside) return {static_cast<double>(chunk_.heights[sample_index(c, r)]), 1};
        if (neighbour == nullptr) return {here, 0};
        // chunks share border samples: sample -1 is the neighbour's last but one
        const auto across = [](int i) {
            return i < 0 ? i + kChunkCells : i >= kChunkSamples ? i - kChunkCells : i;
        };
        return {static_cast<double>(neighbour->heights[sample_index(across(c), across(r))]), 1};
    };
    const auto slope = [&](const Side& low, const Side& high) {
        return slope_of_quantum_ * (high.height - low.height) / (low.steps + high.steps);
    };
    const double slope_x = slope(beside(column - 1, row, west_), beside(column + 1, row, east_));
    const double slope_y = slope(beside(column, row - 1, south_), beside(column, row + 1, north_));
    const double length = std::sqrt(slope_x * slope_x + slope_y * slope_y + 1.0);
    return {static_cast<float>(-slope_x / length), static_cast<float>(-slope_y / length),
            static_cast<float>(1.0 / length)};
}

std::vector<Eigen::Vector3f> solid_normals(const MeshSolid& solid) {
    const std::vector<Eigen::Vector3d>& vertices = solid.chunk->solid->triangles().vertices_world;
    std::vector<Eigen::Vector3d> sums(vertices.size(), Eigen::Vector3d::Zero());
    visit_triangles(solid, [&](const std::array<std::uint32_t, 3>& t) {
        const Eigen::Vector3d a = vertices[t[1]] - vertices[t[0]];
        const Eigen::Vector3d b = vertices[t[2]] - vertices[t[0]];
        const Eigen::Vector3d twice_area(a.y() * b.z() - a.z() * b.y(),
                                         a.z() * b.x() - a.x() * b.z(),
                                         a.x() * b.y() - a.y() * b.x());
        for (const std::uint32_t corner : t) sums[corner] += twice_area;
    });
    std::vector<Eigen::Vector3f> normals;
    normals.reserve(sums.size());
    for (const Eigen::Vector3d& sum : sums) {
        const double length = std::sqrt(sum.x() * sum.x() + sum.y() * sum.y() + sum.z() * sum.z());
        if (length > 0.0) {
            normals.emplace_back(static_cast<float>(sum.x() / length),
                                 static_cast<float>(sum.y() / length),
                                 static_cast<float>(sum.z() / length));
        } else {
            normals.emplace_back(0.0f, 0.0f, 1.0f);
        }
    }
    return normals;
}

}  // namespace terrane::internal

namespace terrane {
namespace {

// The bits of a displayed position. Chunks whose heights differ at a lattice point do not share the vertex, so that a
// crack becomes visible in the mesh.
using Bits = std::array<std::uint64_t, 3>;

Bits bits_of(const WorldPos& p_world) {
    // + 0.0 turns -0.0 into +0.0
    return {std::bit_cast<std::uint64_t>(p_world.x() + 0.0),
            std::bit_cast<std::uint64_t>(p_world.y() + 0.0),
            std::bit_cast<std::uint64_t>(p_world.z() + 0.0)};
}

struct BitsHash {
    std::size_t operator()(const Bits& bits) const {
        std::uint64_t h = bits[0] * 0x9e3779b97f4a7c15u;
        h = (h ^ (h >> 29) ^ bits[1]) * 0xbf58476d1ce4e5b9u;
        h = (h ^ (h >> 31) ^ bits[2]) * 0x94d049bb133111ebu;
        return static_cast<std::size_t>(h ^ (h >> 32));
    }
};

// Numbers vertices in the order of their first use by a triangle. The table is never iterated.
class Welder {
public:
    explicit Welder(TriangleMesh& mesh, std::size_t triangles) : mesh_(mesh) {
        numbers_.reserve(triangles);
        mesh_.triangles.reserve(triangles);
    }

    template <class Normal>
    std::uint32_t number_of(const WorldPos& p_world, const Normal& normal) {
        const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
        const auto [place, is_new] = numbers_.try_emplace(bits_of(p_world), next);
        if (is_new) {
            mesh_.positions.push_back(p_world);
            mesh_.normals.push_back(normal());
        }
        return place->second;
    }

private:
    TriangleMesh& mesh_;
    std::unordered_map<Bits, std::uint32_t, BitsHash> numbers_;
};

}  // namespace

TriangleMesh expand_mesh(const TerrainMesh& mesh) {
    TriangleMesh expanded;
    if (mesh.triangle_count == 0) return expanded;
    const Lattice& lattice = mesh.resident->lattice();
    Welder welder(expanded, mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const internal::SampleNormals normals(*mesh.resident, chunk);
        const auto number_of = [&](std::uint16_t sample) {
            return welder.number_of(
                {lattice.x(chunk.corner.x + chunk.step * (sample % kChunkSamples)),
                 lattice.y(chunk.corner.y + chunk.step * (sample / kChunkSamples)),
                 part.displayed_height(sample, lattice.quantum)},
                [&] { return normals.at(sample); });
        };
        const std::span<const std::uint16_t> indices =
            mesh.indices.subspan(part.first_index, part.index_count);
        for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
            const std::uint32_t a = number_of(indices[i]);
            const std::uint32_t b = number_of(indices[i + 1]);
            const std::uint32_t c = number_of(indices[i + 2]);
            expanded.triangles.push_back({a, b, c});
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const std::vector<Eigen::Vector3d>& vertices =
            solid.chunk->solid->triangles().vertices_world;
        const std::vector<Eigen::Vector3f> normals = internal::solid_normals(solid);
        const auto number_of = [&](std::uint32_t vertex) {
            return welder.number_of(vertices[vertex], [&] { return normals[vertex]; });
        };
        internal::visit_triangles(solid, [&](const std::array<std::uint32_t, 3>& triangle) {
            const std::uint32_t a = number_of(triangle[0]);
            const std::uint32_t b = number_of(triangle[1]);
            const std::uint32_t c = number_of(triangle[2]);
            expanded.triangles.push_back({a, b, c});
        });
    }
    return expanded;
}

namespace {

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

struct PartArrays {
    ChunkKey key;
    std::vector<MeshVertex> vertices;
    std::vector<std::uint32_t> indices;
};

bool is_before(const ChunkKey& a, const ChunkKey& b) { return ResidentSet::Order{}(a, b); }

// Compares bits.
bool is_same(const PartArrays& a, const PartArrays& b) {
    return a.indices == b.indices && a.vertices.size() == b.vertices.size() &&
           std::memcmp(a.vertices.data(), b.vertices.data(),
                       a.vertices.size() * sizeof(MeshVertex)) == 0;
}

// Appends the triangles of one chunk, or of its volumes, to a part.
class PartWriter {
public:
    PartWriter(PartArrays& part, const WorldPos& origin_world, std::vector<std::uint32_t>& numbers,
               std::size_t vertices)
        : part_(part), origin_world_(origin_world), numbers_(numbers) {
        numbers_.assign(vertices, kNoVertex);
    }

    // Calls `place` and `normal` once per vertex.
    template <class Place, class Normal>
    void add(std::size_t vertex, const Place& place, const Normal& normal) {
        std::uint32_t& number = numbers_[vertex];
        if (number == kNoVertex) {
            number = static_cast<std::uint32_t>(part_.vertices.size());
            // a function of the position alone: the same bits in each chunk that shares the vertex
            const LocalVec p = to_local(place(), origin_world_);
            const Eigen::Vector3f n = normal();
            part_.vertices.push_back({{p.x(), p.y(), p.z()}, {n.x(), n.y(), n.z()}});
        }
        part_.indices.push_back(number);
    }

private:
    PartArrays& part_;
    WorldPos origin_world_;
    std::vector<std::uint32_t>& numbers_;
};

}  // namespace

struct MeshBuffers::State {
    MeshBuffersSettings settings;
    WorldPos origin_world = WorldPos::Zero();
    bool has_origin = false;
    std::vector<PartArrays> arrays, before;  // in the order of keys
    std::vector<PartArrays> spare;           // buffers for reuse
    std::vector<MeshPart> parts;
    std::vector<ChunkKey> gone;
    std::vector<std::uint32_t> numbers;  // [vertices of a part's source] their numbers in the part

    PartArrays& part_of(const ChunkKey& key);
    void move_origin(const WorldPos& eye_world);
    void fill(const TerrainMesh& mesh);
    void compare();
};

// An existing part, or a new one inserted in order.
PartArrays& MeshBuffers::State::part_of(const ChunkKey& key) {
    const auto place = std::lower_bound(
        arrays.begin(), arrays.end(), key,
        [](const PartArrays& part, const ChunkKey& k) { return is_before(part.key, k); });
    if (place != arrays.end() && place->key == key) return *place;
    PartArrays fresh;
    if (!spare.empty()) {
        fresh = std::move(spare.back());
        spare.pop_back();
    }
    fresh.key = key;
    fresh.vertices.clear();
    fresh.indices.clear();
    return *arrays.insert(place, std::move(fresh));
}

void MeshBuffers::State::move_origin(const WorldPos& eye_world) {
    if (!eye_world.array().isFinite().all()) return;
    if (has_origin && (eye_world - origin_world).norm() <= settings.rebase_distance) return;
    origin_world = eye_world;
    has_origin = true;
}

void MeshBuffers::State::fill(const TerrainMesh& mesh) {
    if (mesh.triangle_count == 0) return;
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshChunk& drawn : mesh.chunks) {
        if (drawn.index_count == 0) continue;
        const Chunk& chunk = *drawn.chunk;
        const internal::SampleNormals normals(*mesh.resident, chunk);
        PartWriter writer(part_of(chunk.key), origin_world, numbers, chunk.heights.size());
        for (const std::uint16_t sample :
             mesh.indices.subspan(drawn.first_index, drawn.index_count)) {
            writer.add(
                sample,
                [&]() -> WorldPos {
                    return {lattice.x(chunk.corner.x + chunk.step * (sample % kChunkSamples)),
                            lattice.y(chunk.corner.y + chunk.step * (sample / kChunkSamples)),
                            drawn.displayed_height(sample, lattice.quantum)};
                },
                [&] { return normals.at(sample); });
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        if (solid.triangle_count() == 0) continue;
        const std::vector<Eigen::Vector3d>& vertices =
            solid.chunk->solid->triangles().vertices_world;
        const std::vector<Eigen::Vector3f> normals = internal::solid_normals(solid);
        PartWriter writer(part_of(solid.chunk->key), origin_world, numbers, vertices.size());
        internal::visit_triangles(solid, [&](const std::array<std::uint32_t, 3>& triangle) {
            for (const std::uint32_t vertex : triangle) {
                writer.add(
                    vertex, [&] { return vertices[vertex]; }, [&] { return normals[vertex]; });
            }
        });
    }
}

// Both lists are ordered by key.
void MeshBuffers::State::compare() {
    parts.clear();
    gone.clear();
    auto old = before.begin();
    for (const PartArrays& part : arrays) {
        for (; old != before.end() && is_before(old->key, part.key); ++old)
            gone.push_back(old->key);
        PartChange change = PartChange::added;
        if (old != before.end() && old->key == part.key) {
            change = is_same(*old, part) ? PartChange::same : PartChange::changed;
            ++old;
        }
        parts.push_back({part.key, change, part.vertices, part.indices});
    }
    for (; old != before.end(); ++old) gone.push_back(old->key);
}

MeshBuffers::MeshBuffers(std::unique_ptr<State> state) : state_(std::move(state)) {}
MeshBuffers::MeshBuffers(MeshBuffers&&) noexcept = default;
MeshBuffers& MeshBuffers::operator=(MeshBuffers&&) noexcept = default;
MeshBuffers::~MeshBuffers() = default;

Result<MeshBuffers> MeshBuffers::create(const MeshBuffersSettings& settings) {
    TERRANE_TRY(check_range("rebase_distance", settings.rebase_distance, 1.0, 1e6));
    auto state = std::make_unique<State>();
    state->settings = settings;
    return MeshBuffers(std::move(state));
}

void MeshBuffers::update(const TerrainMesh& mesh, const WorldPos& eye_world) {
    State& state = *state_;
    for (PartArrays& part : state.before) state.spare.push_back(std::move(part));
    state.before = std::move(state.arrays);
    state.arrays.clear();
    state.move_origin(eye_world);
    state.fill(mesh);
    state.compare();
}

const WorldPos& MeshBuffers::origin_world() const { return state_->origin_world; }
std::span<const MeshPart> MeshBuffers::parts() const { return state_->parts; }
std::span<const ChunkKey> MeshBuffers::gone() const { return state_->gone; }

}  // namespace terrane
