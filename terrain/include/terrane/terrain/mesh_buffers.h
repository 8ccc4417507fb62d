// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>

/// A frame's mesh as plain vertices and indices, for renderers and programs that do not read chunks.
namespace terrane {

/// The triangles of all chunks and volumes of a frame as one mesh in world coordinates, morphing included. A vertex
/// that triangles share, of several chunks too, is there once: vertices are one where they have the same displayed
/// position, bit for bit. The triangulator guarantees that they always do; a crack would be an edge with one triangle.
///
/// Vertices are in the order of their first use. Normals are those of MeshVertex.
///
/// Threads: one at a time for a triangulator
/// Cost:    O(triangles), about 0.3 microseconds each
TriangleMesh expand_mesh(const TerrainMesh& mesh);

/// One vertex as a vertex buffer holds it: 24 bytes, no padding.
struct MeshVertex {
    std::array<float, 3> position{};  ///< metres from MeshBuffers::origin_world(), world axes
    /// Unit, out of the solid: of the heightfield from the slopes of the chunk's samples around the vertex, so that it
    /// does not depend on which triangles are drawn; of volumes the mean of their triangles', by area.
    std::array<float, 3> normal{};
    friend bool operator==(const MeshVertex&, const MeshVertex&) = default;
};
static_assert(sizeof(MeshVertex) == 24 && std::is_trivially_copyable_v<MeshVertex>);

/// How a part compares with the frame before.
enum class PartChange : std::uint8_t {
    same,     ///< no bit differs: nothing is uploaded
    changed,  ///< was there; other vertices or indices
    added,    ///< was not there
};

/// The triangles that are drawn with one chunk, those of its volumes included. Never empty.
struct MeshPart {
    ChunkKey key;                           ///< of the chunk
    PartChange change = PartChange::added;  ///< since the last update()
    std::span<const MeshVertex> vertices =
        {};  ///< used by the indices, in the order of their first use
    /// Three a triangle, counter-clockwise from outside the solid: numbers of the part's vertices.
    std::span<const std::uint32_t> indices = {};
};

/// Settings of MeshBuffers. Fixed once they are created.
struct MeshBuffersSettings {
    /// Metres that the eye moves from the origin until the origin follows, which changes all parts; 1 to 1e6. Rounding
    /// is 2^-24 of a vertex's distance from the origin: 0.25 mm at 4 km.
    double rebase_distance = 4096.0;
};

/// A frame's mesh by chunks, and what of it has changed since the frame before.
///
/// All parts have one origin, so that vertices which chunks share have the same bits in each: no hairline cracks, at
/// most repeated vertices. The origin is where the eye was when it was set last, and moves with MeshBuffersSettings::
/// rebase_distance.
///
/// Threads:   one at a time
/// Allocates: as much as the largest frame needs, twice; then little
class MeshBuffers {
public:
    /// Fails: invalid_argument for a setting out of range
    static Result<MeshBuffers> create(const MeshBuffersSettings& settings = {});
    MeshBuffers(MeshBuffers&&) noexcept;
    MeshBuffers& operator=(MeshBuffers&&) noexcept;
    ~MeshBuffers();

    /// Takes the mesh of a frame, which is not needed afterwards. An eye that is not finite does not move the origin.
    ///
    /// Cost: O(triangles), about 0.1 microseconds each, those of unchanged parts too
    void update(const TerrainMesh& mesh, const WorldPos& eye_world);

    /// What positions are relative to, metres.
    const WorldPos& origin_world() const;
    /// The parts of the frame: by level, then y, then x. Valid until the next update().
    std::span<const MeshPart> parts() const;
    /// Chunks that had a part in the frame before and have none now, in the same order. Valid until the next update().
    std::span<const ChunkKey> gone() const;

private:
    struct State;
    explicit MeshBuffers(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
