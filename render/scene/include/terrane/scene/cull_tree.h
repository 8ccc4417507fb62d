// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/caster_volume.h>
#include <terrane/scene/view_volume.h>
#include <terrane/terrain/aabb.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace terrane {

/// Test of bounding boxes against the view volume.
enum class CullTest : std::uint8_t {
    planes,  ///< one plane at a time: keeps some boxes outside the edges of the volume
    exact,   ///< separating axes where the planes do not decide
};

/// Temporal coherence of one viewer: the plane that last excluded each node of a CullTree. Affects the time only.
struct CullMemory {
    std::vector<std::uint8_t> last_plane;  ///< [nodes]; any size: cull() sets it
};

/// Finds the boxes in view among many, by a hierarchy of boxes: a node that is outside excludes all below it, one that
/// is inside includes them, and planes that a node is inside of are not tested below it.
///
/// Threads: any number of cull() at once, each with its own memory
class CullTree {
public:
    /// @param boxes_world [objects] finite, low <= high; at most 2^31
    ///
    /// Cost: O(n log n), about 0.2 microseconds an object
    explicit CullTree(std::span<const Aabb> boxes_world);
    CullTree(CullTree&&) noexcept;
    CullTree& operator=(CullTree&&) noexcept;
    ~CullTree();

    /// Number of objects.
    std::size_t size() const;

    /// Moves the boxes; the hierarchy stays, so that culling costs more the more objects have moved among each other.
    ///
    /// @param boxes_world [size()]
    void refit(std::span<const Aabb> boxes_world);

    /// Replaces visible_out by the indices of the objects whose boxes, and all boxes of nodes around them, are not
    /// outside: each once, in an order that depends on the boxes of the constructor alone.
    ///
    /// Allocates: nothing once the outputs are large enough
    void cull(const ViewVolume& volume, CullTest test, CullMemory& memory,
              std::vector<std::uint32_t>& visible_out) const;

    /// Replaces casters_out by the indices of the objects whose boxes, and all boxes of nodes around them, meet the
    /// volume, in the same order.
    ///
    /// Allocates: nothing once the output is large enough
    void find_casters(const CasterVolume& volume, std::vector<std::uint32_t>& casters_out) const;

private:
    struct Nodes;
    std::unique_ptr<Nodes> nodes_;
};

}  // namespace terrane
