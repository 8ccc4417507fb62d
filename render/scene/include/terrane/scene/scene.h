// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/scene/scene_nodes.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

namespace terrane {

namespace internal {
class InstanceDevice;
}

/// Settings of a Scene. Fixed once it is created.
struct SceneSettings {
    /// Width of cross-fades between levels, 1 to 2: while an object's screen error is between the threshold divided by
    /// this ratio and the threshold, both levels are drawn, with complementary coverage. A larger ratio changes less
    /// from frame to frame and draws more triangles. 1: levels switch at once.
    double fade_ratio = 1.3;
    CullTest cull_test =
        CullTest::planes;  ///< for clusters of instances; single objects are tested by planes
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
    std::size_t objects = 0;  ///< models and instances in the scene
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
    std::size_t triangles =
        0;  ///< of the frame, including both levels of cross-fades, and 2 a particle
    std::size_t particles = 0;  ///< in view
    std::size_t culled_nodes =
        0;  ///< nodes out of view, without their descendants; nodes of instances are not included
    std::size_t casters =
        0;  ///< objects out of view submitted as casters; not included in the other counts
};

/// First intersection of a segment with an object.
struct SceneHit {
    NodeId node{};                                      ///< a ModelNode or an InstancesNode
    std::size_t object = 0;                             ///< index in InstancesNode::objects
    double fraction = 0.0;                              ///< 0 at the segment's start, 1 at its end
    WorldPos point_world = WorldPos::Zero();            ///< where the segment hits the object
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< index in the model's mesh
};

/// A tree of nodes with transforms, whose content is models with levels of detail, instances, switches, billboards and
/// particles. A node's bounds contain its subtree and are updated after changes; subtrees out of view are skipped.
///
/// In each frame the scene culls the objects, which are models and instances, and draws each at its coarsest level
/// whose screen error is within the frame's threshold. The screen error is the level's error divided by the distance
/// from the eye to the object's bounding sphere, times pixels per radian. An object is omitted if the error of its
/// absence is within the threshold. Below a switch that fades, an object has one level.
///
/// One frame:
///
///     const auto demands = scene.begin_frame(view);
///     const TerrainMesh mesh = triangulator.update(resident, view, demands);   // one budget
///     const SceneDraws draws = scene.end_frame(mesh.demand_threshold_px);
///
/// The draws have at most as many triangles as all demands together whose TriangleDemand::threshold_px is above the
/// frame's threshold. A frame is a function of the nodes, the settings, the view and the threshold, with two
/// exceptions: if more than SceneSettings::most_continuous objects qualify for continuous levels of detail, the choice
/// among them depends on earlier frames; so does a switch with hysteresis.
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

    /// Adds a model, for any number of nodes.
    ///
    /// Fails: invalid_argument as ObjectModel::validate()
    Result<ModelId> add_model(const ObjectModel& model);

    /// The root node, a GroupNode at the world's origin.
    NodeId root() const;

    /// Adds a node as the last child of another. Changes of nodes show in the next frame; instances that move or go end
    /// the current frame: its end_frame() draws nothing.
    ///
    /// Fails: invalid_argument, naming the value, for a parent that does not exist or is 256 nodes deep, a place that
    ///        is not finite or out of range, a model that is not the scene's, content out of range, and instances or
    ///        emitters below a switch or a billboard
    /// Cost:  O(depth); for instances O(n log n)
    Result<NodeId> add(NodeId parent, const NodePlace& place, NodeContent content);
    /// Removes a node and its subtree; no effect for the root or an unknown id.
    void remove(NodeId node);
    /// Replaces the place of a node. Fails as add().
    ///
    /// Cost: O(depth); for a subtree with instances also as adding them
    Result<void> set_place(NodeId node, const NodePlace& place);
    /// Replaces the content of a node. Fails as add(), and for a switch or billboard above instances or emitters.
    Result<void> set_content(NodeId node, NodeContent content);

    /// Sets the time of emitters, and records their places: call it before begin_frame(), after the places of the frame
    /// are set. 0 before the first call.
    ///
    /// @param time_s finite, seconds; a jump back forgets the places after it
    /// Cost: O(emitters)
    void set_time(double time_s);

    /// Culls the objects of InstancesNode on a device, and chooses their levels there, from the next frame on: with the
    /// same results, bit for bit, in instances that stay on the device (SceneDraws::device). The CPU does so for models
    /// with continuous levels or more than 8 levels, for casters out of view, and if the device's memory does not
    /// suffice.
    ///
    /// @param device TerrainRenderer::instance_device(), of the renderer that draws the scene; serves one scene. Null:
    ///               the CPU. Must outlive the scene, or its replacement here
    ///
    /// Threads: with a device begin_frame() and end_frame() only on the one on which its context is current
    void set_device(internal::InstanceDevice* device);

    /// Number of nodes, including the root.
    std::size_t node_count() const;
    /// Number of models and instances in all nodes.
    std::size_t object_count() const;
    /// World bounds of a node and its subtree; none if the subtree draws nothing or the id is unknown.
    ///
    /// Cost: with instances in the scene, O(nodes of the subtree)
    std::optional<Aabb> bounds_world(NodeId node) const;

    /// Culls nodes and objects, chooses the levels of switches, turns billboards, sorts particles from far to near, and
    /// returns the triangles that the objects in view need at each threshold. Valid until the next call. An invalid
    /// view shows nothing.
    ///
    /// @param least_threshold_px lower limit of end_frame()'s threshold: objects whose error of absence is not above it
    ///                           cost nearly nothing, and switches by error choose their levels at it. 0: no limit
    /// @param shadows            end_frame() also returns casters: objects out of view whose shadows can fall into the
    ///                           view, at the levels that they would have in view. Demands exclude them. None, or a
    ///                           distance or direction out of range: no casters, at no cost
    /// @param horizon_map        also culls objects hidden by the ground; ignored if null or built for another view,
    ///                           and with shadows, because hidden objects may cast them
    ///
    /// Allocates: nothing once the buffers are large enough
    /// Cost:      with end_frame() about 20 ns per instance in view (`scene_benchmark`); for an object with continuous
    ///            levels some microseconds, plus the contractions since its last level
    std::span<const TriangleDemand> begin_frame(const View& view, double least_threshold_px = 0.0,
                                                const std::optional<SunShadows>& shadows = {},
                                                const HorizonMap* horizon_map = nullptr);

    /// Chooses the levels of the objects of begin_frame(). The draws are valid until the next non-const call.
    ///
    /// @param threshold_px largest screen error of an object, pixels, > 0 and >= least_threshold_px of begin_frame();
    ///                     infinity: nothing is drawn
    ///
    /// Allocates: nothing once the buffers are large enough
    SceneDraws end_frame(double threshold_px);

    /// Statistics of the last frame.
    const SceneCounts& counts() const;

    /// The first object whose mesh a segment hits; models without ObjectModel::rays, and particles, are ignored. If
    /// several are hit at the same point, the node that was added first. Independent of frames: the mesh of
    /// ObjectModel::rays is tested, even if another level is drawn, and the finest level of a switch. Models below a
    /// billboard are tested as turned to the last valid view passed to begin_frame(), and ignored until there is one.
    ///
    /// Fails: no answer if `from_world` or `to_world` is not finite
    /// Cost:  O(clusters of up to 256 instances + nodes whose parent's bounds are hit), and the meshes near the
    ///        segment; after changes also the update of the bounds
    std::optional<SceneHit> ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    struct State;
    explicit Scene(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
