// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace terrane::tools {

/// What the colours over the ground show.
enum class GroundColours {
    none,
    levels,     ///< level of detail: blue is coarse, red fine
    chunks,     ///< a colour for each chunk, so that borders show
    error,      ///< certified error of each chunk: blue is none, red that of the frame
    late,       ///< chunks that should be finer, and whose finer chunks have not arrived
    materials,  ///< TerrainRenderer::set_flat_materials()
};
inline constexpr std::array<const char*, 6> kGroundColourNames{"none",  "levels", "chunks",
                                                               "error", "late",   "materials"};

/// Certified error of the part of the ground that a chunk of a mesh draws, pixels of the picture's centre: its share of
/// the threshold, and the bounds of the quarters that no finer chunk draws, at their least distance from the eye.
double chunk_error_px(const TerrainMesh& mesh, const MeshChunk& chunk, const View& view,
                      double morph_ratio);

/// The colours of the chunks of a mesh; null for none and materials. References `mesh`, and is valid as long as it.
///
/// @param max_error_px the frame's target
std::function<GroundMark(const MeshChunk&)> ground_marks(GroundColours colours,
                                                         const TerrainMesh& mesh, const View& view,
                                                         double max_error_px, double morph_ratio);

/// A point on the drawn surface.
struct MeshHit {
    WorldPos point_world = WorldPos::Zero();
    const Chunk* chunk = nullptr;       ///< that draws it
    const MeshChunk* ground = nullptr;  ///< the same in the mesh; null for volumes
};

/// The first point of a ray on the drawn surface, volumes included; none within a distance.
///
/// @param along unit
/// Cost: O(triangles of the mesh)
std::optional<MeshHit> first_on_mesh(const TerrainMesh& mesh, const WorldPos& from_world,
                                     const Eigen::Vector3d& along, double most_distance);

/// The finest resident chunk over a place; null where none is.
const Chunk* finest_chunk_at(const ResidentSet& resident, const WorldVec2& place_world);

/// A line or a point over a picture, pixels from its left upper corner.
struct PictureLine {
    std::array<float, 4> ends{};    ///< x, y, x, y
    std::array<float, 3> colour{};  ///< with display gamma
};

/// Projects lines of the world onto a picture.
class LineProjector {
public:
    explicit LineProjector(const View& view);

    /// Adds the part of a segment in front of the eye.
    void add(const WorldPos& from_world, const WorldPos& to_world,
             const std::array<float, 3>& colour, std::vector<PictureLine>& lines_out) const;
    /// The place of a point; none if it is not in front of the eye.
    std::optional<std::array<double, 2>> place_of(const WorldPos& p_world) const;

private:
    Eigen::Vector3d in_eye(const WorldPos& p_world) const;
    std::array<double, 2> on_picture(const Eigen::Vector3d& p_eye) const;

    View view_;
    Eigen::Vector3d right_;
};

/// Which marks of bodies are drawn.
struct BodyMarks {
    bool contacts = false;  ///< points with normals, and impulses
    bool bounds = false;    ///< boxes in the axes of the bodies, grey for sleeping ones
    bool needs = false;     ///< the ground that bodies need
    bool operator==(const BodyMarks&) const = default;
};

/// Lines for the bodies of a world.
void add_body_marks(const World& world, std::span<const BodyNeed> needs, const BodyMarks& marks,
                    const LineProjector& projector, std::vector<PictureLine>& lines_out);

}  // namespace terrane::tools
