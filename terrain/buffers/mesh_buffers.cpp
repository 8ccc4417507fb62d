// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "buffers/vertex_normals.h"

#include <terrane/terrain/mesh_buffers.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

namespace terrane {
namespace {

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

struct PartArrays {
    ChunkKey key;
    std::vector<MeshVertex> vertices;
    std::vector<std::uint32_t> indices;
};

bool is_before(const ChunkKey& a, const ChunkKey& b) { return ResidentSet::Order{}(a, b); }

// Bit for bit.
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

    // `place` and `normal` are asked once for each vertex.
    template <class Place, class Normal>
    void add(std::size_t vertex, const Place& place, const Normal& normal) {
        std::uint32_t& number = numbers_[vertex];
        if (number == kNoVertex) {
            number = static_cast<std::uint32_t>(part_.vertices.size());
            // a function of the position alone: the same bits in each chunk that shares it
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
    std::vector<std::uint32_t> numbers;  // of a part's vertices

    PartArrays& part_of(const ChunkKey& key);
    void move_origin(const WorldPos& eye_world);
    void fill(const TerrainMesh& mesh);
    void compare();
};

// An existing part, or a new one in its place.
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

// Both lists are in the order of keys.
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
    if (auto ok = check_range("rebase_distance", settings.rebase_distance, 1.0, 1e6); !ok) {
        return tl::unexpected(ok.error());
    }
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
