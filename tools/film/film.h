// SPDX-License-Identifier: MIT
#pragma once

#include "output/output_folder.h"

#include <terrane/render/image.h>

#include <cstddef>
#include <memory>
#include <string>

namespace terrane::tools {

/// A film that the program ffmpeg makes (H.264 in MP4) from the frames it is given. It appears under
/// its name only when it is whole; what was not finished is removed. ffmpeg is in a process group of its own, so
/// that a Ctrl-C of the terminal does not reach it.
class Film {
public:
    /// Starts ffmpeg, which writes to a file beside the place.
    ///
    /// @param place      a path that the user named, whose file is replaced; or a name in a run's folder
    /// @param patience_s seconds without a sign of life of ffmpeg, whole and above 0, after which add() and finish()
    ///                   give it up
    ///
    /// Fails: invalid_argument for a size that is not positive and even, or a rate that is not 0 to
    ///        1000 frames a second; io where ffmpeg is not installed or cannot be started
    static Result<Film> create(const OutputPlace& place, int width_px, int height_px,
                               double frames_per_second, int patience_s = kPatience_s);

    Film(Film&&) noexcept;
    Film& operator=(Film&&) noexcept;
    /// Stops ffmpeg and removes the part where finish() was not called.
    ~Film();

    /// Appends a frame; waits for ffmpeg where it is slower.
    ///
    /// Fails: invalid_argument for a frame of another size; io, with what ffmpeg says, where it gave
    ///        up. Then the film is lost.
    Result<void> add(const Image& frame);

    /// Makes the film appear. Fails with io, naming the path and the cause. Call once.
    Result<void> finish();

    std::size_t frame_count() const;

    static constexpr int kPatience_s = 60;

private:
    struct State;
    explicit Film(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
