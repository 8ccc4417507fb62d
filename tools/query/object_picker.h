// SPDX-License-Identifier: MIT
#pragma once

#include "scene/scene_objects.h"

#include <terrane/base/math.h>
#include <terrane/scene/object_model.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/scatter.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

/// A part of a segment, as fractions of its length.
struct SegmentPart {
    double begin = 0.0;
    double end = 1.0;
};

/// The part of a segment that may be within a margin of the surface, according to the source's intervals. A ray needs
/// no ground outside this part. Absent if no point of the segment is so near.
///
/// @param margin metres, >= 0, along each axis
///
/// Cost: at most 1022 intervals; few if the segment soon leaves the terrain's height range
std::optional<SegmentPart> near_ground(const WorldPos& from_world, const WorldPos& to_world,
                                       const HeightSource& source, double margin);

/// First intersection of a segment with an object of a scene.
struct PickedObject {
    std::size_t entry = 0;                              ///< index in the scene's list of objects
    std::size_t mesh = 0;                               ///< index of SceneObjects::meshes
    std::optional<ScatterSquare> square;                ///< of a scattered object
    std::size_t index = 0;                              ///< of a scattered object, in its square
    WorldPos position_world = WorldPos::Zero();         ///< of the object's origin
    double scale = 1.0;                                 ///< of the object
    double fraction = 0.0;                              ///< of the segment, 0 to 1
    WorldPos point_world = WorldPos::Zero();            ///< where the segment hits the object
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< index in the mesh
};

/// Casts rays against the triangles of a scene's objects, placed and scattered.
class ObjectPicker {
public:
    /// @param source  ground of scattered objects
    /// @param objects of the scene
    ///
    /// Fails: as MeshRays::create() and Scatter::create(), naming the file of the mesh
    static Result<ObjectPicker> create(std::shared_ptr<const HeightSource> source,
                                       const SceneObjects& objects);

    /// The first object that a segment hits. Of several at the same point, it is the one with the least entry, square
    /// (by y, then x) and index, so that the answer does not depend on earlier calls.
    ///
    /// @param from_world, to_world ends of the segment, finite
    /// @param limit fraction of the segment beyond which objects are ignored
    ///
    /// Fails: as Scatter::objects_in()
    /// Cost:  O(placed objects + objects of the squares along the segment, up to the first hit)
    Result<std::optional<PickedObject>> ray(const WorldPos& from_world, const WorldPos& to_world,
                                            double limit);

private:
    struct Placed {
        std::size_t entry = 0, mesh = 0;
        Pose world_from_object;
        double scale = 1.0;
    };
    struct Scattered {
        std::size_t entry = 0, mesh = 0;
        Scatter scatter;
        double reach = 0.0;  // largest distance of an object's points from its origin, metres
        std::map<ScatterSquare, std::vector<ScatterPoint>> squares = {};  // computed so far
    };
    class Search;

    explicit ObjectPicker(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}
    Result<void> search_scatter(Scattered& scattered, Search& search);
    Result<const std::vector<ScatterPoint>*> points_of(Scattered& scattered,
                                                       const ScatterSquare& square);

    std::shared_ptr<const HeightSource> source_;
    std::vector<MeshRays> meshes_;
    std::vector<Placed> placed_;
    std::vector<Scattered> scattered_;
    std::size_t kept_points_ = 0;  // of all squares
};

}  // namespace terrane::tools
