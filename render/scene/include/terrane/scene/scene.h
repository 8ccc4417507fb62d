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
    float scale = 1.0f;                          ///< > 0
    /// Unit quaternion x, y, z, w: rotation from the object's frame to world axes.
    std::array<float, 4> rotation{0.0f, 0.0f, 0.0f, 1.0f};
    std::array<float, 3> tint{1.0f, 1.0f, 1.0f};  ///< factor of its colours
};

/// Settings of a Scene. Fixed once it is created.
struct SceneSettings {
    /// An object changes between two levels while its screen error is between the threshold over this ratio and the
    /// threshold, 1 to 2: both are drawn, with complementary coverage. A larger ratio changes less from frame to
    /// frame and draws more triangles. 1: levels switch at once.
    double fade_ratio = 1.3;
    CullTest cull_test =
        CullTest::planes;  ///< of groups of objects; single objects have the test of planes
    double far_distance =
        std::numeric_limits<double>::infinity();  ///< beyond it no object is drawn, metres, > 0
    /// Most objects of a frame with continuous levels of detail (ObjectModel::continuous): those in view with the most
    /// pixels a metre of their models, the others have discrete levels. One that was among them stays until another
    /// one has an eighth more. Each takes 12 bytes a triangle of its finest level. 0: none.
    std::size_t most_continuous = 16;
};

/// Statistics of a frame of a Scene.
struct SceneCounts {
    std::size_t objects = 0;  ///< in the scene
    std::size_t in_view = 0;  ///< not culled
    /// Culled because the ground hides them. Of clusters of objects that are hidden as a whole, all: also those that
    /// are out of view or too small.
    std::size_t occluded = 0;
    /// Part of the objects in view, and large enough to be drawn at the least threshold, that the ground hides, 0 to 1:
    /// what a HorizonMap is worth. Of hidden clusters all objects count.
    double occluded_share = 0.0;
    std::size_t drawn = 0;  ///< those of them that are drawn
    std::size_t left_out =
        0;  ///< those of them whose absence is an error below the threshold: not drawn
    std::size_t continuous = 0;  ///< those drawn with continuous levels of detail
    std::size_t triangles = 0;   ///< of the frame; objects that change levels count twice
    std::size_t casters = 0;     ///< not in view, and given as casters: in none of the other counts
};

/// Names a model of a Scene.
enum class ModelId : std::uint32_t {};
/// Names a group of a Scene.
enum class GroupId : std::uint64_t {};

/// Where a segment first meets an object.
struct SceneHit {
    GroupId group{};                                    ///< that has the object
    std::size_t object = 0;                             ///< index among the group's objects
    double fraction = 0.0;                              ///< of the segment from its start, 0 to 1
    WorldPos point_world = WorldPos::Zero();            ///< where the segment meets the object
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< of the model's mesh
};

/// Objects with levels of detail, placed in groups, such as the trees of a chunk. Decides in each frame which are in
/// view, and draws the coarsest level of each whose screen error is within the frame's threshold: error over the
/// distance from the eye to the object's bounding sphere, times pixels per radian. What would be missing without an
/// object is the error of its absence: the least ones are left out first.
///
/// One frame:
///
///     const auto demands = scene.begin_frame(view);
///     const TerrainMesh mesh = triangulator.update(resident, view, demands);   // one budget
///     const SceneDraws draws = scene.end_frame(mesh.others_threshold_px);
///
/// The draws have at most as many triangles as the demands above the threshold. A frame is a function of the objects,
/// the settings, the view and the threshold. One thing depends on the frames before: which objects have continuous
/// levels of detail, where more than SceneSettings::most_continuous could.
///
/// The screen error of a continuous level is within the threshold too, so that an object that becomes near, or is not
/// near any more, changes by no more than the errors of its two levels.
///
/// Threads: one at a time
class Scene {
public:
    /// Fails: invalid_argument, naming the field, for settings out of range
    static Result<Scene> create(const SceneSettings& settings);
    Scene(Scene&&) noexcept;
    Scene& operator=(Scene&&) noexcept;
    ~Scene();

    /// Fails: invalid_argument as check(ObjectModel)
    Result<ModelId> add_model(const ObjectModel& model);

    /// Adds objects of a model.
    ///
    /// Fails: invalid_argument, naming the object, for a model that is not the scene's; a position, scale, rotation or
    ///        tint that is not finite; a scale that is not above 0; a quaternion whose length is not 1 to 1e-3
    /// Cost:  O(n log n)
    Result<GroupId> add_group(ModelId model, std::span<const PlacedObject> objects);
    /// Removes a group and its objects; nothing where there is none of that name. Ends a frame that has begun:
    /// end_frame() draws nothing then.
    void remove_group(GroupId group);

    /// Number of objects in all groups.
    std::size_t object_count() const;

    /// Culls, and gives the triangles that the objects in view need at each threshold. Valid until the next call.
    /// An invalid view has no objects.
    ///
    /// @param least_threshold_px end_frame() uses no smaller threshold: objects whose absence is not above it cost
    ///                           nearly nothing. 0: none such
    /// @param shadows            end_frame() also gives the objects out of view whose shadows can fall into it, as
    ///                           casters, at the levels that they would be drawn with in view; no demand counts them.
    ///                           None, or a distance or direction out of range: no casters, at no cost
    /// @param horizon            what the ground hides is culled too; null, or a map of another view, or with
    ///                           shadows, which what is hidden may cast: nothing is
    ///
    /// Allocates: nothing once the buffers are large enough
    /// Cost:      with end_frame() some 20 ns an object in view: `scene_benchmark`; of an object with continuous levels
    ///            some microseconds, and the contractions since its last level
    std::span<const TriangleDemand> begin_frame(const View& view, double least_threshold_px = 0.0,
                                                const std::optional<SunShadows>& shadows = {},
                                                const HorizonMap* horizon = nullptr);

    /// Chooses the levels of the objects of begin_frame(). Valid until the next call of it or of begin_frame().
    ///
    /// @param threshold_px largest screen error of an object, pixels, > 0; infinity: nothing is drawn. Not below the
    ///                     one given to begin_frame()
    ///
    /// Allocates: nothing once the buffers are large enough
    SceneDraws end_frame(double threshold_px);

    /// Of the last frame.
    const SceneCounts& counts() const;

    /// The first object whose mesh a segment meets; models without ObjectModel::rays are not met. Independent of
    /// frames: it is the mesh that is met, whichever level is drawn.
    ///
    /// Fails: no answer where `from_world` or `to_world` is not finite
    /// Cost:  O(clusters of up to 256 objects), and the meshes near the segment
    std::optional<SceneHit> ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    struct State;
    explicit Scene(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
