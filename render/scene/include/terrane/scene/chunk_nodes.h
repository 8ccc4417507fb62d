// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/scene/scene.h>
#include <terrane/scene/scene_nodes.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/lattice.h>
#include <terrane/terrain/resident_set.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>

namespace terrane {

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
///     nodes.update(*pager.resident(), view.eye_world, scene);
///
/// The nodes depend only on the sets and eyes passed to the updates. ChunkNodes keeps the chunks of its nodes alive:
/// a chunk that the pager has evicted is freed by the next update.
///
/// Threads: one at a time, while no other thread uses the scene
class ChunkNodes {
public:
    /// Adds the content of a chunk below `node`, a GroupNode at the chunk's south-western corner, at height 0, with
    /// world axes. Everything added there is removed with the chunk, or at once if the function fails.
    using Make = std::function<Result<void>(const Chunk& chunk, Scene& scene, NodeId node)>;

    /// @param parent parent of the nodes; its frame must be the world frame, as for Scene::root()
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
    /// Fails: as Scene::add() or the function given to create(), for the first chunk that failed; the others are
    ///        populated nevertheless. A failed chunk is retried only after it has been evicted or replaced
    /// Cost:  O(chunks of the level); O(1) if the set is the same as in the last update and no chunk waits
    Result<void> update(const ResidentSet& resident, const WorldPos& eye_world, Scene& scene);

    /// Removes all nodes. The next update creates them again.
    void clear(Scene& scene);

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
    void remove_gone(const ResidentSet& resident, Scene& scene);
    Result<NodeId> make_node(const Chunk& chunk, const Lattice& lattice, Scene& scene) const;

    ChunkNodesSettings settings_;
    NodeId parent_;
    Make make_;
    std::map<ChunkKey, Place, ResidentSet::Order> places_;
    std::optional<std::uint64_t> epoch_;  // of the last update
    ChunkNodesCounts counts_;
};

}  // namespace terrane
