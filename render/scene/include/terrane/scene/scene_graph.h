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

/// Names a node of a SceneGraph. Never used again for another one.
enum class NodeId : std::uint64_t {};

/// A node that only places its children.
struct GroupNode {};

/// A mesh, or an impostor where the level is one.
struct GeometryNode {
    MeshId mesh{};            ///< of the renderer; ignored where there is an impostor
    std::uint32_t level = 0;  ///< of the mesh
    std::optional<ImpostorId> impostor = {};  ///< drawn in place of the mesh
    Aabb bounds;                              ///< in the node's frame, metres
    std::uint32_t triangles = 0;              ///< for the counts; 2 of an impostor
    /// The mesh for SceneGraph::ray(), within the bounds; none: rays do not meet it.
    std::optional<MeshRays> rays = {};
};

/// Selects one of its children by distance or screen error, or two during a cross-fade. The children are levels of
/// detail, the finest first, in the order in which they were added.
struct SwitchNode {
    /// Criterion between two levels.
    enum class By : std::uint8_t {
        distance,  ///< limits are metres from the eye to the bounding sphere: the classic one
        error,  ///< limits are errors in metres of the coarser level: it is drawn below the frame's threshold in pixels
    };
    By by = By::error;  ///< what the limits are compared with
    /// [levels] Limit i separates level i from level i + 1. Beyond the last limit the node draws nothing; infinity: it
    /// always draws its last level. Positive, not decreasing.
    std::vector<double> limits;
    /// A level changes where the limit is passed by this ratio, 1 to 2, so that levels do not alternate near a limit.
    double hysteresis = 1.0;
    /// Levels fade into each other while the limit is passed by up to this ratio, 1 to 2; 1: at once. Not together with
    /// hysteresis.
    double fade_ratio = 1.0;
};

/// Turns its children to the viewer.
struct BillboardNode {
    /// Degrees of freedom of the rotation.
    enum class Axis : std::uint8_t {
        screen,  ///< its x is the picture's right, its y the picture's up: for smoke
        up,  ///< about its z axis only, until its x points to the eye, whatever the viewer's up is: for trees
    };
    Axis axis = Axis::screen;  ///< how it turns to the eye
};

/// Soft discs, in the node's frame.
struct ParticlesNode {
    /// A disc.
    struct Disc {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();     ///< metres
        double radius = 1.0;                                  ///< metres, > 0
        std::array<float, 4> colour{1.0f, 1.0f, 1.0f, 1.0f};  ///< as Particle::colour
    };
    std::vector<Disc> discs;  ///< replaced by set_content() as they move
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
    std::size_t culled = 0;     ///< nodes whose bounds are out of view, their children not counted
    std::size_t triangles = 0;  ///< of geometry and particles
};

/// Where a segment first meets a node.
struct NodeHit {
    NodeId node{};                                      ///< a GeometryNode
    double fraction = 0.0;                              ///< of the segment from its start, 0 to 1
    WorldPos point_world = WorldPos::Zero();            ///< where the segment meets the mesh
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, world axes, against the segment
    std::uint32_t triangle = 0;                         ///< of the node's mesh
};

/// A tree of nodes with transforms: vehicles of parts, smoke over a chimney, whatever is not scattered by the thousand
/// (see Scene for that). Bounds follow what changes below a node, and culling follows the bounds down the tree.
///
/// Threads: one at a time
class SceneGraph {
public:
    SceneGraph();
    SceneGraph(SceneGraph&&) noexcept;
    SceneGraph& operator=(SceneGraph&&) noexcept;
    ~SceneGraph();

    /// The node above all others, a GroupNode at the world's origin.
    NodeId root() const;

    /// Adds a node as the last child of another.
    ///
    /// Fails: invalid_argument, naming the value, for a parent that does not exist, a place that is not finite or out
    ///        of range, or content out of range: bounds, limits, ratios, discs
    Result<NodeId> add(NodeId parent, const NodePlace& place, NodeContent content);
    /// Removes a node and all below it. The root stays. Nothing where there is no such node.
    void remove(NodeId node);
    /// Fails: as add()
    Result<void> set_place(NodeId node, const NodePlace& place);
    /// Fails: as add()
    Result<void> set_content(NodeId node, NodeContent content);

    /// Nodes, the root included.
    std::size_t size() const;
    /// World bounds of a node and all below it; none where there is nothing to draw, or no such node.
    std::optional<Aabb> bounds_world(NodeId node) const;

    /// Culls, chooses the levels of switches, turns billboards, and sorts particles from far to near. Valid until the
    /// next call that is not const. An invalid view draws nothing.
    ///
    /// @param threshold_px of switches by error
    /// @param shadows      also gives the geometry out of view whose shadows can fall into it, as casters, which
    ///                     counts() has not. None, or a distance or direction out of range: no casters, at no cost
    SceneDraws collect(const View& view, double threshold_px,
                       const std::optional<SunShadows>& shadows = {});
    /// Of the last collect().
    const GraphCounts& counts() const;

    /// The first geometry whose mesh a segment meets; of several at once the one that was added first. Nodes without
    /// GeometryNode::rays are not met, nor are particles. A switch is met by its finest level, whichever is drawn. What
    /// is below a billboard is met as it faces the last valid view of collect(), and not at all before there is one.
    ///
    /// Fails: no answer where `from_world` or `to_world` is not finite
    /// Cost:  O(nodes whose parents' bounds the segment meets), and their meshes; after changes also that of the bounds
    std::optional<NodeHit> ray(const WorldPos& from_world, const WorldPos& to_world) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Settings of ChunkNodes. Fixed once they are created.
struct ChunkNodesSettings {
    int level = 0;              ///< of the chunks that have nodes, 0 to 24
    std::size_t most_made = 4;  ///< chunks whose content one update makes, >= 1
};

/// Statistics of the last update of ChunkNodes.
struct ChunkNodesCounts {
    std::size_t made = 0;     ///< chunks that got their nodes
    std::size_t removed = 0;  ///< chunks whose nodes were removed
    std::size_t failed = 0;   ///< chunks that have none, because their content could not be made
    std::size_t waiting = 0;  ///< chunks that get theirs in later updates
};

/// Nodes that come and go with the chunks of one level: one subtree for each chunk that is resident, such as the
/// houses or the trees on it.
///
/// One frame:
///
///     pager.update(cameras, bodies, time);
///     nodes.update(*pager.resident(), view.eye_world, graph);
///
/// Which nodes there are depends on the sets and the eyes of the updates alone. Between updates it holds the chunks
/// that have nodes: what the pager has evicted is freed by the next update.
///
/// Threads: one at a time, and none in the graph
class ChunkNodes {
public:
    /// Adds the content of a chunk below a GroupNode, which is at the chunk's south-western corner, at height 0, with
    /// the world's axes. What it has added goes with the chunk, also where it fails.
    using Make = std::function<Result<void>(const Chunk& chunk, SceneGraph& graph, NodeId node)>;

    /// @param parent of the nodes, whose frame is the world frame, such as SceneGraph::root()
    ///
    /// Fails: invalid_argument, naming the field and its value, for settings out of range, or no function
    static Result<ChunkNodes> create(const ChunkNodesSettings& settings, NodeId parent, Make make);

    /// Removes the nodes of chunks that are no longer resident, or have been replaced by others, and makes those of
    /// chunks that have come: the nearest first, by the horizontal distance of a chunk's middle from the eye, of
    /// equally near ones the southern and then the western one first.
    ///
    /// @param resident  a set of the same pager in all updates
    /// @param eye_world finite
    ///
    /// Fails: as SceneGraph::add() or the function given to create(), for the first chunk that failed; the others are
    ///        made all the same. It is tried again only once the chunk has gone or been replaced
    /// Cost:  O(chunks of the level); O(1) where the set is that of the last update and no chunk waits
    Result<void> update(const ResidentSet& resident, const WorldPos& eye_world, SceneGraph& graph);

    /// Removes all nodes. The next update makes them anew.
    void clear(SceneGraph& graph);

    /// The node of a chunk; none where it has none.
    std::optional<NodeId> node_of(const ChunkKey& key) const;
    /// Chunks that have nodes.
    std::size_t size() const { return places_.size() - counts_.failed; }
    /// Of the last update.
    const ChunkNodesCounts& counts() const { return counts_; }

private:
    struct Place {
        std::shared_ptr<const Chunk> chunk;
        std::optional<NodeId> node;  // none: it could not be made
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
