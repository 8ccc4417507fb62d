// SPDX-License-Identifier: MIT
#pragma once

#include "bodies/solver/rigid_body.h"

#include <terrane/collision/broadphase.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Pairs that were found separated, with a lower bound of their distance that decreases as the bodies move: while it
/// exceeds the reach of contacts, a pair needs no narrowphase. All pairs are given in ascending order.
class SeparatedPairs {
public:
    /// Begins a collision step: bodies may have moved, or been placed anew.
    void begin(std::span<const RigidBody> bodies);

    /// Whether a pair is known to be farther apart than `reach` metres. It is then kept for the next step.
    bool is_clear(const BodyPair& pair, double reach);

    /// Adds a pair that was found separated in this step, by at least `distance` metres.
    void add(const BodyPair& pair, double distance);

    /// Ends the step.
    void end();

    /// Forgets the pairs of a body whose shape may have changed.
    void forget(std::uint32_t body) {
        std::erase_if(entries_, [body](const Entry& entry) {
            return entry.pair.a == body || entry.pair.b == body;
        });
    }

private:
    struct Entry {
        BodyPair pair;
        double travel;  // of both bodies, at which their distance may be 0, metres
    };
    double travel_of(const BodyPair& pair) const { return travel_[pair.a] + travel_[pair.b]; }

    std::vector<Entry> entries_, kept_, added_;
    std::size_t next_ = 0;  // of entries_
    std::vector<double>
        travel_;               // [bodies] sum of upper bounds of how far a point has moved, metres
    std::vector<Pose> poses_;  // [bodies] at the last begin()
};

}  // namespace terrane::internal
