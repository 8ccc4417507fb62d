// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene_graph.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_key.h>
#include <terrane/terrain/resident_set.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>

namespace terrane {

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
