// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/view.h>

#include <optional>
#include <span>

namespace terrane::internal {

/// A camera that may see chunks appear and vanish.
struct FadeObserver {
    View view;
    Frustum frustum;
    double threshold_px = 1.0;
    /// Its view at the update before; absent for a new camera.
    struct PreviousView {
        WorldPos eye_world;
        Frustum frustum;
    };
    std::optional<PreviousView> previous;
};

/// How visible the fade of a chunk is.
struct FadeVisibility {
    /// Upper bound of the largest screen error of its vertices over the camera's threshold, maximum over the
    /// cameras; 0 if none would see it change. Errors are limited to the most that fades ever hold back. A
    /// fade of at most 1 / ratio hides the chunk, or that much of it.
    double ratio = 0.0;
    double fade_in = 1.0;   ///< least 1 / fade after one more update of fading in
    double fade_out = 1.0;  ///< greatest 1 / fade after one more update of fading out
};

/// Evaluates a chunk for the cameras that would see it change: those whose last two frusta both may contain
/// some of the surface that it moves, farther away than ten times the eye's displacement between them. The
/// step of the fade is that of the camera that sees most of it; a chunk below a camera's threshold is invisible
/// to it.
///
/// @param inverse_fade 1 / fade of the chunk now, >= 1
FadeVisibility find_fade_visibility(const Lattice& lattice, const Chunk& chunk,
                                    std::span<const FadeObserver> observers, double inverse_fade);

/// 1 / fade of a chunk after one more update.
///
/// @param is_new        it was inserted in this update
/// @param is_fading_out it is to be evicted; else it fades in
double next_inverse_fade(const FadeVisibility& visibility, bool is_new, bool is_fading_out);

/// 1 / inverse_fade, rounded down.
float fade_of(double inverse_fade);

}  // namespace terrane::internal
