// SPDX-License-Identifier: MIT
#pragma once

#include "program/output_file.h"

#include <terrane/render/offscreen.h>

#include <cstddef>
#include <memory>
#include <string>

namespace terrane::tools {

/// A film (H.264 in MP4) encoded by the program ffmpeg. It appears under its name only when it is complete; an
/// unfinished film is removed. ffmpeg has its own process group, so that Ctrl-C in the terminal does not end it.
class Film {
public:
    /// Starts ffmpeg, which writes to a temporary file in the same folder.
    ///
    /// @param place      a path named by the user, where an existing file is replaced; or a name in an output folder
    /// @param patience_s timeout of add() and finish() while ffmpeg makes no progress, seconds, > 0
    ///
    /// Fails: invalid_argument for a size that is not positive and even, and for a rate of 0 or less or more than 1000
    ///        frames a second; io if ffmpeg is not installed or cannot be started
    static Result<Film> create(const OutputPlace& place, int width_px, int height_px,
                               double frames_per_second, int patience_s = kPatience_s);

    Film(Film&&) noexcept;
    Film& operator=(Film&&) noexcept;
    /// If finish() was not called, stops ffmpeg and removes the temporary file.
    ~Film();

    /// Appends a frame; blocks until ffmpeg accepts it.
    ///
    /// Fails: invalid_argument for a frame of another size; io, with ffmpeg's message, if ffmpeg failed or timed out:
    ///        the film is then lost.
    Result<void> add(const Image& frame);

    /// Completes the film and renames it to its final name. Fails with io, naming the path and the cause. Call once.
    Result<void> finish();

    std::size_t frame_count() const;

    static constexpr int kPatience_s = 60;

private:
    struct State;
    explicit Film(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
