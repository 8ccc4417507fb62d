// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/lattice.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

namespace terrane {

/// Identifies a node of a SceneGraph. Never reused.
enum class NodeId : std::uint64_t {};

/// A node that only places its children.
struct GroupNode {};

/// A mesh at one of its levels, or an impostor.
struct GeometryNode {
    MeshId mesh{};                            ///< of the renderer; ignored if there is an impostor
    std::uint32_t level = 0;                  ///< of the mesh
    std::optional<ImpostorId> impostor = {};  ///< drawn instead of the mesh
    Aabb bounds;                              ///< in the node's frame, metres
    std::uint32_t triangles = 0;              ///< for the counts; 2 for an impostor
    /// The mesh for SceneGraph::ray(), within the bounds; none: rays pass through the node.
    std::optional<MeshRays> rays = {};
};

/// Draws one of its children, chosen by distance or screen error, or two during a cross-fade. The children are levels
/// of detail, finest first, in the order in which they were added.
struct SwitchNode {
    /// Criterion between two levels.
    enum class By : std::uint8_t {
        distance,  ///< limits are metres from the eye to the bounding sphere
        error,  ///< limit i is the error of level i + 1, metres: that level is drawn if it is within the frame's threshold
    };
    By by = By::error;  ///< quantity compared with the limits
    /// [levels] Limit i separates level i from level i + 1. Beyond the last limit the node draws nothing; infinity: the
    /// last level is always drawn. Positive; each at least fade_ratio times the one before.
    std::vector<double> limits;
    /// A level changes only after its limit is passed by this ratio, 1 to 2, so that levels do not alternate near a
    /// limit.
    double hysteresis = 1.0;
    /// Levels cross-fade while the limit is passed by up to this ratio, 1 to 2; 1: they switch at once. Cannot be
    /// combined with hysteresis.
    double fade_ratio = 1.0;
};

/// Turns its children towards the viewer.
struct BillboardNode {
    /// Degrees of freedom of the rotation.
    enum class Axis : std::uint8_t {
        screen,  ///< x points to the picture's right and y to its top: for smoke
        up,  ///< about its z axis only, so that x points towards the eye, whatever the viewer's up: for trees
    };
    Axis axis = Axis::screen;  ///< degrees of freedom
};

/// Soft discs, in the node's frame.
struct ParticlesNode {
    /// A disc.
    struct Disc {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();     ///< metres
        double radius = 1.0;                                  ///< metres, > 0
        std::array<float, 4> colour{1.0f, 1.0f, 1.0f, 1.0f};  ///< as Particle::colour
    };
    std::vector<Disc> discs;  ///< to move them, call set_content()
};

/// Type of a node, with its data.
using NodeContent = std::variant<GroupNode, GeometryNode, SwitchNode, BillboardNode, ParticlesNode>;

/// Transform from a node's frame to its parent's.
struct NodePlace {
    Pose parent_from_node;  ///< rotation and position
    double scale = 1.0;     ///< 1e-6 to 1e6
};

/// Statistics of a frame of a SceneGraph.
struct GraphCounts {
    std::size_t drawn = 0;      ///< geometry nodes
    std::size_t culled = 0;     ///< nodes whose bounds are out of view, excluding their descendants
    std::size_t triangles = 0;  ///< of geometry and particles
};

/// First intersection of a segment with a node.
struct NodeHit {
    NodeId node{};                                      ///< a GeometryNode
    double fraction = 0.0;                              ///< 0 at the segment's start, 1 at its end
    WorldPos point_world = WorldPos::Zero();            ///< where the segment hits the mesh
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< index in the node's mesh
};

/// A tree of nodes with transforms, for articulated vehicles, smoke over a chimney and other objects that are not
/// scattered by the thousand (see Scene for those). A node's bounds contain its subtree and are updated after changes;
/// culling skips subtrees whose bounds are out of view.
///
/// Threads: one at a time
class SceneGraph {
public:
    SceneGraph();
    SceneGraph(SceneGraph&&) noexcept;
    SceneGraph& operator=(SceneGraph&&) noexcept;
    ~SceneGraph();

    /// The root node, a GroupNode at the world's origin.
    NodeId root() const;

    /// Adds a node as the last child of another.
    ///
    /// Fails: invalid_argument, naming the value, for a parent that does not exist, a place that is not finite or out
    ///        of range, or content with bounds, limits, ratios or discs out of range
    Result<NodeId> add(NodeId parent, const NodePlace& place, NodeContent content);
    /// Removes a node and its subtree. No effect for the root or an unknown id.
    void remove(NodeId node);
    /// Replaces the place of a node. Fails as add().
    Result<void> set_place(NodeId node, const NodePlace& place);
    /// Replaces the content of a node. Fails as add().
    Result<void> set_content(NodeId node, NodeContent content);

    /// Number of nodes, including the root.
    std::size_t size() const;
    /// World bounds of a node and its subtree; none if the subtree draws nothing or the id is unknown.
    std::optional<Aabb> bounds_world(NodeId node) const;

    /// Culls nodes, chooses the levels of switches, turns billboards, and sorts particles from far to near. Valid until
    /// the next non-const call. An invalid view draws nothing.
    ///
    /// @param threshold_px largest screen error of a level that a switch chooses by error, pixels
    /// @param shadows      also returns casters: geometry out of view whose shadows can fall into the view; counts()
    ///                     excludes it. None, or a distance or direction out of range: no casters, at no cost
    SceneDraws collect(const View& view, double threshold_px,
                       const std::optional<SunShadows>& shadows = {});
    /// Statistics of the last collect().
    const GraphCounts& counts() const;

    /// The first geometry whose mesh a segment hits; if several are hit at the same point, the one that was added
    /// first. Particles, and geometry without GeometryNode::rays, are ignored. For a switch its finest level is tested,
    /// even if another level is drawn. Geometry below a billboard is tested as turned to the last valid view passed to
    /// collect(), and ignored until there is one.
    ///
    /// Fails: no answer if `from_world` or `to_world` is not finite
    /// Cost:  O(nodes whose parent's bounds are hit), and their meshes; after changes also the update of the bounds
    std::optional<NodeHit> ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Settings of ChunkNodes. Fixed after create().
struct ChunkNodesSettings {
    int level = 0;              ///< level of the chunks that get nodes, 0 to 24
    std::size_t most_made = 4;  ///< largest number of chunks populated per update, >= 1
};

/// Statistics of the last update of ChunkNodes.
struct ChunkNodesCounts {
    std::size_t made = 0;     ///< chunks that got their nodes
    std::size_t removed = 0;  ///< chunks whose nodes were removed
    std::size_t failed = 0;   ///< chunks without nodes, because their content could not be created
    std::size_t waiting = 0;  ///< chunks to be populated in later updates
};

/// Ties scene content to chunks of one level: one subtree for each resident chunk, such as the houses or the trees on
/// it.
///
/// One frame:
///
///     pager.update(cameras, bodies, time);
///     nodes.update(*pager.resident(), view.eye_world, graph);
///
/// The nodes depend only on the sets and eyes passed to the updates. ChunkNodes keeps the chunks of its nodes alive:
/// a chunk that the pager has evicted is freed by the next update.
///
/// Threads: one at a time, while no other thread uses the graph
class ChunkNodes {
public:
    /// Adds the content of a chunk below `node`, a GroupNode at the chunk's south-western corner, at height 0, with
    /// world axes. Everything added there is removed with the chunk, or at once if the function fails.
    using Make = std::function<Result<void>(const Chunk& chunk, SceneGraph& graph, NodeId node)>;

    /// @param parent parent of the nodes; its frame must be the world frame, as for SceneGraph::root()
    ///
    /// Fails: invalid_argument, naming the field and its value, for settings out of range, or an empty function
    static Result<ChunkNodes> create(const ChunkNodesSettings& settings, NodeId parent, Make make);

    /// Removes the nodes of chunks that are no longer resident or have been replaced, and populates new chunks: nearest
    /// first, by the horizontal distance from the eye to the chunk's centre; ties go to the southern, then to the
    /// western chunk.
    ///
    /// @param resident  a set of the same pager in every update
    /// @param eye_world finite
    ///
    /// Fails: as SceneGraph::add() or the function given to create(), for the first chunk that failed; the others are
    ///        populated nevertheless. A failed chunk is retried only after it has been evicted or replaced
    /// Cost:  O(chunks of the level); O(1) if the set is the same as in the last update and no chunk waits
    Result<void> update(const ResidentSet& resident, const WorldPos& eye_world, SceneGraph& graph);

    /// Removes all nodes. The next update creates them again.
    void clear(SceneGraph& graph);

    /// The node of a chunk, if any.
    std::optional<NodeId> node_of(const ChunkKey& key) const;
    /// Number of chunks with nodes.
    std::size_t size() const { return places_.size() - counts_.failed; }
    /// Statistics of the last update.
    const ChunkNodesCounts& counts() const { return counts_; }

private:
    struct Place {
        std::shared_ptr<const Chunk> chunk;
        std::optional<NodeId> node;  // none: it could not be created
    };

    ChunkNodes(const ChunkNodesSettings& settings, NodeId parent, Make make);
    void remove_gone(const ResidentSet& resident, SceneGraph& graph);
    Result<NodeId> make_node(const Chunk& chunk, const Lattice& lattice, SceneGraph& graph) const;

    ChunkNodesSettings settings_;
    NodeId parent_;
    Make make_;
    std::map<ChunkKey, Place, ResidentSet::Order> places_;
    std::optional<std::uint64_t> epoch_;  // of the last update
    ChunkNodesCounts counts_;
};

}  // namespace terrane
