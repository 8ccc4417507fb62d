// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>

#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Why a chunk is wanted; smaller goes first.
enum class NeedClass : std::uint8_t {
    root,       ///< nothing can be drawn or stood on without
    contact,    ///< a body or a ticket stands on it, or will
    drawn,      ///< a camera sees too little detail now
    predicted,  ///< a camera will, within the horizon
    none,
};

/// How much a chunk is wanted. Order: class, then value, larger first.
struct Need {
    NeedClass why = NeedClass::none;
    /// Contact: minus the seconds until it is needed. Cameras: pixels of error that it can remove.
    double value = 0.0;

    bool is_wanted() const { return why != NeedClass::none; }
    bool goes_before(const Need& other) const {
        return why != other.why ? why < other.why : value > other.value;
    }
};

/// A rectangle that was asked for by name.
struct RegionNeed {
    WorldRect region;
    double deadline_s = 0.0;
};

/// A camera, with what follows from its view.
struct Camera {
    explicit Camera(const CameraNeed& wanted)
        : need(wanted),
          frustum(make_frustum(wanted.view)),
          pixels_per_radian(wanted.view.pixels_per_radian()) {}

    CameraNeed need;
    Frustum frustum;
    double pixels_per_radian;

    /// Where it stood in the update before; nothing where it was not there.
    struct Before {
        WorldPos eye_world;
        Frustum frustum;
    };
    std::optional<Before> before;
};

/// Everything that clients want at one moment.
struct Clients {
    std::vector<Camera> cameras;
    std::vector<BodyNeed> bodies;
    std::vector<RegionNeed> regions;
    double time_s = 0.0;
};

/// How much a quadrant of a resident chunk is wanted one level finer.
///
/// @param chunk         resident parent of the chunk asked about
/// @param quadrant      which of its children
/// @param contact_level chunks finer than it are for drawing only
Need child_need(const Lattice& lattice, const Chunk& chunk, int quadrant, const Clients& clients,
                int contact_level, double horizon);

/// How the coming or going of a chunk would show.
struct Watch {
    /// Largest screen error of one of its vertices over the camera's threshold, for the camera where
    /// that is largest, rounded up; 0 where no camera would see it come or go. A fade of at most
    /// 1 / ratio hides the chunk.
    double ratio = 0.0;
    /// How far 1 / fade may move in one update.
    double step = 0.0;
};

/// Looks at a chunk through the cameras that would see it come or go: both their last two views may
/// hold some of what it moves, further away than ten times the way between the two.
///
/// @param inverse_fade   1 / fade of the chunk now, >= 1
Watch watch(const Lattice& lattice, const Chunk& chunk, const Clients& clients,
            double inverse_fade);

/// Whether a rectangle and a chunk share a point.
bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect);

}  // namespace terrane::internal
