// SPDX-License-Identifier: MIT
#pragma once

#include "graph/node_store.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <map>
#include <span>
#include <vector>

namespace terrane::internal {

/// An emitter at a time.
struct EmitterPlace {
    double time = 0.0;  ///< seconds
    WorldPlace place;
    float strength = 1.0f;  ///< EmitterNode::strength
};

/// Appends the particles of an emitter that are alive at a time.
///
/// @param places of the emitter, in the order of their times, not empty; between two of them it moves linearly, before
///               the first and after the last it stands still
void append_particles(const EmitterNode& emitter, std::span<const EmitterPlace> places, double time,
                      const WorldPos& eye_world, std::vector<Particle>& particles_out);

/// The emitters of a scene and their recent places.
class Emitters {
public:
    void add(NodeId node);
    /// No effect for a node that is not an emitter.
    void remove(NodeId node);
    bool empty() const { return tracks_.empty(); }

    /// Sets the time and records the places of all emitters. A time before the last one forgets the places after it.
    void set_time(double time, const NodeStore& nodes);

    /// Appends the particles of emitters that can be in view, except those of which no particle has a radius of
    /// `least_px`.
    void append(const NodeStore& nodes, const View& view, const ViewVolume& volume, double least_px,
                std::vector<Particle>& particles_out) const;

private:
    double time_ = 0.0;
    std::map<NodeId, std::vector<EmitterPlace>> tracks_;
};

/// Fails: invalid_argument, naming the value, for a value out of range
Result<void> check_emitter(const EmitterNode& emitter);

}  // namespace terrane::internal
