// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace terrane {

/// A placement of a model: position, scale and rotation.
struct PlacedObject {
    WorldPos position_world = WorldPos::Zero();  ///< of the object's origin
    float scale = 1.0f;                          ///< 1e-6 to 1e6
    /// Unit quaternion x, y, z, w: rotation from the object's frame to world axes.
    std::array<float, 4> rotation{0.0f, 0.0f, 0.0f, 1.0f};
    std::array<float, 3> tint{1.0f, 1.0f, 1.0f};  ///< factor of its colours
};

/// Settings of a Scene. Fixed once it is created.
struct SceneSettings {
    /// Width of cross-fades between levels, 1 to 2: while an object's screen error is between the threshold divided by
    /// this ratio and the threshold, both levels are drawn, with complementary coverage. A larger ratio changes less
    /// from frame to frame and draws more triangles. 1: levels switch at once.
    double fade_ratio = 1.3;
    CullTest cull_test =
        CullTest::planes;  ///< for groups of objects; single objects are tested by planes
    double far_distance =
        std::numeric_limits<double>::infinity();  ///< no object is drawn beyond it, metres, > 0
    /// Largest number of objects per frame that are drawn with continuous levels of detail (ObjectModel::continuous):
    /// those in view with the most pixels per metre of their models. The others have discrete levels. An object keeps
    /// continuous levels until another one has an eighth more pixels per metre. Memory: 12 bytes per triangle of the
    /// finest level, for each object. 0: none.
    std::size_t most_continuous = 16;
};

/// Statistics of a frame of a Scene.
struct SceneCounts {
    std::size_t objects = 0;  ///< in the scene
    std::size_t in_view = 0;  ///< not culled
    /// Objects culled because the ground hides them. All objects of a hidden cluster count, including those out of view
    /// or too small.
    std::size_t occluded = 0;
    /// occluded / (occluded + visible objects above least_threshold_px), 0 to 1: the benefit of a HorizonMap. An
    /// estimate, because `occluded` counts whole clusters. 0 if no HorizonMap was used.
    double occluded_share = 0.0;
    std::size_t drawn = 0;  ///< objects in view that are drawn
    std::size_t left_out =
        0;  ///< objects in view that are not drawn, because the error of their absence is below the threshold
    std::size_t continuous = 0;  ///< objects drawn with continuous levels of detail
    std::size_t triangles = 0;   ///< of the frame, including both levels of cross-fades
    std::size_t casters =
        0;  ///< objects out of view submitted as casters; not included in the other counts
};

/// Names a model of a Scene.
enum class ModelId : std::uint32_t {};
/// Names a group of a Scene.
enum class GroupId : std::uint64_t {};

/// First intersection of a segment with an object.
struct SceneHit {
    GroupId group{};                                    ///< group of the object
    std::size_t object = 0;                             ///< index among the group's objects
    double fraction = 0.0;                              ///< 0 at the segment's start, 1 at its end
    WorldPos point_world = WorldPos::Zero();            ///< where the segment hits the object
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< index in the model's mesh
};

/// A set of objects with levels of detail, placed in groups, such as the trees of a chunk. In each frame it culls the
/// objects, and draws each at its coarsest level whose screen error is within the frame's threshold. The screen error
/// is the level's error divided by the distance from the eye to the object's bounding sphere, times pixels per radian.
/// An object is omitted if the error of its absence is within the threshold.
///
/// One frame:
///
///     const auto demands = scene.begin_frame(view);
///     const TerrainMesh mesh = triangulator.update(resident, view, demands);   // one budget
///     const SceneDraws draws = scene.end_frame(mesh.demand_threshold_px);
///
/// The draws have at most as many triangles as all demands together whose TriangleDemand::threshold_px is above the
/// frame's threshold. A frame is a function of the objects, the settings, the view and the threshold, with one
/// exception: if more than SceneSettings::most_continuous objects qualify for continuous levels of detail, the choice
/// among them depends on earlier frames.
///
/// The screen error of a continuous level is also within the threshold, so when an object gains or loses continuous
/// levels, its picture changes by no more than the errors of the two levels.
///
/// Threads: one at a time
class Scene {
public:
    /// Fails: invalid_argument, naming the field, for settings out of range
    static Result<Scene> create(const SceneSettings& settings);
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;
    ~Scene();

    /// Fails: invalid_argument as ObjectModel::validate()
    Result<ModelId> add_model(const ObjectModel& model);

    /// Adds objects of a model.
    ///
    /// Fails: invalid_argument, naming the object, for a model that is not the scene's, a coordinate beyond 2e9 m, a
    ///        scale outside 1e-6 to 1e6, a quaternion whose length is not 1 to 1e-3, or a tint that is not finite
    /// Cost:  O(n log n)
    Result<GroupId> add_group(ModelId model, std::span<const PlacedObject> objects);
    /// Removes a group and its objects; no effect for an unknown id. Cancels a frame that has begun: its end_frame()
    /// draws nothing.
    void remove_group(GroupId group);

    /// Number of objects in all groups.
    std::size_t object_count() const;

    /// Culls the objects, and returns the triangles that those in view need at each threshold. Valid until the next
    /// call. An invalid view shows no objects.
    ///
    /// @param least_threshold_px lower limit of end_frame()'s threshold: objects whose error of absence is not above it
    ///                           cost nearly nothing. 0: no limit
    /// @param shadows            end_frame() also returns casters: objects out of view whose shadows can fall into the
    ///                           view, at the levels that they would have in view. Demands exclude them. None, or a
    ///                           distance or direction out of range: no casters, at no cost
    /// @param horizon_map        also culls objects hidden by the ground; ignored if null or built for another view,
    ///                           and with shadows, because hidden objects may cast them
    ///
    /// Allocates: nothing once the buffers are large enough
    /// Cost:      with end_frame() about 20 ns per object in view (`scene_benchmark`); for an object with continuous
    ///            levels some microseconds, plus the contractions since its last level
    std::span<const TriangleDemand> begin_frame(const View& view, double least_threshold_px = 0.0,
                                                const std::optional<SunShadows>& shadows = {},
                                                const HorizonMap* horizon_map = nullptr);

    /// Chooses the levels of the objects of begin_frame(). The draws are valid until the next call of either function.
    ///
    /// @param threshold_px largest screen error of an object, pixels, > 0 and >= least_threshold_px of begin_frame();
    ///                     infinity: nothing is drawn
    ///
    /// Allocates: nothing once the buffers are large enough
    SceneDraws end_frame(double threshold_px);

    /// Statistics of the last frame.
    const SceneCounts& counts() const;

    /// The first object whose mesh a segment hits; models without ObjectModel::rays are ignored. Independent of frames:
    /// the mesh of ObjectModel::rays is tested, even if another level is drawn.
    ///
    /// Fails: no answer if `from_world` or `to_world` is not finite
    /// Cost:  O(clusters of up to 256 objects), and the meshes near the segment
    std::optional<SceneHit> ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    struct State;
    explicit Scene(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
