// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_field.h"

#include <terrane/scene/horizon_map.h>

#include <cstddef>
#include <limits>
#include <memory>

namespace terrane::tools {

/// Lets the ground hide objects in the frames in which that pays.
///
/// A map pays where it hides at least 300 objects, and a quarter of those that would be drawn, or a fifth in the frames
/// after one in which it paid. A frame whose map does not pay hides nothing, so that trials do not show. After it, and
/// after a frame whose errors were larger than the map's, 32 frames have no map. Which have one depends on what the
/// frames before showed, not on their times: equal flights have equal frames.
class FrameHorizon {
public:
    /// The map of a frame; null where it is not expected to pay.
    const HorizonMap* begin(const std::shared_ptr<const ResidentSet>& resident, const View& view);

    /// Whether the map pays, by the counts of the objects that were culled with it. True where there is none. If not,
    /// cull again without it.
    bool pays(const ObjectCounts& culled);

    /// Whether what the map hides is behind the ground of its frame. True where there is none. If not, cull and
    /// triangulate again without it.
    bool holds_for(const TerrainMesh& mesh);

    /// Ends the frame.
    ///
    /// @param mesh   that is drawn
    /// @param counts of the objects that are drawn
    void end(const TerrainMesh& mesh, const ObjectCounts& counts);

    /// Lets the limits of the next map's errors follow those of a mesh.
    void follow(const TerrainMesh& mesh);

    /// Time that the map of the last frame took, 0 without one.
    double ms() const { return ms_; }

private:
    void leave_out();

    HorizonMap map_;
    GroundError largest_;    // of the next map
    bool has_map_ = false;   // this frame
    bool has_paid_ = false;  // the last map, to the end of its frame
    /// Objects drawn or hidden in the last frame; before the first, as many as a map needs.
    std::size_t object_count_ = std::numeric_limits<std::size_t>::max();
    std::size_t pause_ = 0;  // frames without a map to come
    double ms_ = 0.0;
};

}  // namespace terrane::tools
