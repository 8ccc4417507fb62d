// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <optional>
#include <span>

namespace terrane::internal {

/// A camera that may see chunks come and go.
struct Watcher {
    View view;
    Frustum frustum;
    double threshold_px = 1.0;
    /// Where it stood in the update before; nothing where it was not there.
    struct Before {
        WorldPos eye_world;
        Frustum frustum;
    };
    std::optional<Before> before;
};

/// How the coming or going of a chunk would show.
struct Watch {
    /// Largest screen error of one of its vertices over the camera's threshold, for the camera where
    /// that is largest, rounded up; 0 where no camera would see it come or go. Errors count up to what
    /// is held back at most. A fade of at most 1 / ratio hides the chunk, or as much of it as is to be
    /// hidden.
    double ratio = 0.0;
    /// 1 / fade after one more update, where it comes, at least, and where it goes, at most.
    double coming = 1.0;
    double going = 1.0;
};

/// Looks at a chunk through the cameras that would see it come or go: both their last two views may
/// hold some of what it moves, further away than ten times the way between the two. The pace is that of
/// the camera that sees most of a step: beyond what hides the chunk from it, it sees nothing.
///
/// @param inverse_fade   1 / fade of the chunk now, >= 1
Watch watch(const Lattice& lattice, const Chunk& chunk, std::span<const Watcher> watchers,
            double inverse_fade);

/// 1 / fade of a chunk after one more update.
///
/// @param is_new       it comes with this update
/// @param is_leaving   it fades out
double faded_on(const Watch& seen, bool is_new, bool is_leaving);

/// The fade that an inverse stands for, rounded down.
float fade_of(double inverse_fade);

}  // namespace terrane::internal
