// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/image.h>

#include <cstddef>
#include <memory>
#include <string>

namespace terrane::tools {

/// A film that the program ffmpeg makes (H.264 in MP4) from the frames it is given. It appears under
/// its name only when it is whole; what was not finished is removed.
class Film {
public:
    /// Starts ffmpeg, which writes to `path`.part.mp4.
    ///
    /// Fails: invalid_argument for a size that is not positive and even, or a rate that is not 0 to
    ///        1000 frames a second; io where ffmpeg is not installed or cannot be started
    static Result<Film> create(const std::string& path, int width_px, int height_px,
                               double frames_per_second);

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

private:
    struct State;
    explicit Film(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane::tools
