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

/// Merges the triangles of all chunks and volumes of a frame into one mesh in world coordinates, morphing included.
/// Vertices are merged if their displayed positions are bit-identical, which the triangulator guarantees for every
/// vertex that triangles share, across chunks too. A crack would therefore be an edge with only one triangle.
///
/// Vertices are in the order of their first use. Normals are as in MeshVertex.
///
/// Threads: one at a time per triangulator
/// Cost:    O(triangles), about 0.3 microseconds each
TriangleMesh expand_mesh(const TerrainMesh& mesh);

/// One vertex of a vertex buffer: 24 bytes, no padding.
struct MeshVertex {
    std::array<float, 3> position{};  ///< metres from MeshBuffers::origin_world(), world axes
    /// Unit, out of the solid. On the heightfield it is computed from the slopes of the chunk's samples around the
    /// vertex, so that it does not depend on which triangles are drawn; on volumes it is the area-weighted mean of
    /// their triangles' normals.
    std::array<float, 3> normal{};
    friend bool operator==(const MeshVertex&, const MeshVertex&) = default;
};
static_assert(sizeof(MeshVertex) == 24 && std::is_trivially_copyable_v<MeshVertex>);

/// Change of a part since the previous frame.
enum class PartChange : std::uint8_t {
    same,     ///< bit-identical: nothing to upload
    changed,  ///< in both frames, with other vertices or indices
    added,    ///< not in the previous frame
};

/// The triangles that are drawn with one chunk, including those of its volumes. Never empty.
struct MeshPart {
    ChunkKey key;                           ///< of the chunk
    PartChange change = PartChange::added;  ///< since the last update()
    std::span<const MeshVertex> vertices =
        {};  ///< used by the indices, in the order of their first use
    /// Three per triangle, counter-clockwise from outside the solid: indices of `vertices`.
    std::span<const std::uint32_t> indices = {};
};

/// Settings of MeshBuffers. Fixed once they are created.
struct MeshBuffersSettings {
    /// Distance of the eye from the origin, metres, at which the origin moves to the eye, which changes all parts; 1 to
    /// 1e6. Positions are rounded to 2^-24 of the distance from the origin: 0.25 mm at 4 km.
    double rebase_distance = 4096.0;
};

/// A frame's mesh by chunks, and its changes since the previous frame.
///
/// All parts have one origin. A vertex that is repeated in several chunks has the same bits in each, so there are no
/// hairline cracks. The origin is the eye's position when it was last set; see
/// MeshBuffersSettings::rebase_distance.
///
/// Threads:   one at a time
/// Allocates: twice what the largest frame needs; then little
class MeshBuffers {
public:
    /// Fails: invalid_argument for a setting out of range
    static Result<MeshBuffers> create(const MeshBuffersSettings& settings = {});
    MeshBuffers(MeshBuffers&&) noexcept;
    MeshBuffers& operator=(MeshBuffers&&) noexcept;
    ~MeshBuffers();

    /// Takes the mesh of a frame, which is not needed afterwards. A non-finite eye does not move the origin.
    ///
    /// Cost: O(triangles), about 0.1 microseconds each, including those of unchanged parts
    void update(const TerrainMesh& mesh, const WorldPos& eye_world);

    /// The origin of all positions, metres.
    const WorldPos& origin_world() const;
    /// The parts of the frame, ordered by level, then y, then x. Valid until the next update().
    std::span<const MeshPart> parts() const;
    /// Chunks that had a part in the previous frame and have none now, ordered like parts(). Valid until the next
    /// update().
    std::span<const ChunkKey> gone() const;

private:
    struct State;
    explicit MeshBuffers(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
