// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <array>
#include <cstdint>
#include <span>

namespace terrane {

/// A colour of imagery, 0 to 255: red, green and blue with display gamma, and opacity (0: no data).
using ImageryTexel = std::array<std::uint8_t, 4>;

/// A source of imagery that is draped over the ground, such as a raster, a map or a test picture.
class ImagerySource {
public:
    virtual ~ImagerySource() = default;

    /// The rectangle that has data, world, metres.
    virtual WorldRect rect() const = 0;
    /// Side of the source's finest texels, metres, > 0. The finest squares that are requested are the coarsest ones
    /// whose texels are no larger than this.
    virtual double texel_size() const = 0;

    /// Reads a square. Each texel has the colour at its centre, or the mean over its area if the source is finer.
    ///
    /// @param square     world, metres; may extend beyond rect(), where there is no data
    /// @param side       texels along its side
    /// @param texels_out [side * side] row by row from the south-west
    ///
    /// Fails:   with any error, such as io. After an error or an exception the renderer draws the square without
    ///          imagery
    /// Threads: any number at once
    virtual Result<void> read(const WorldRect& square, int side,
                              std::span<ImageryTexel> texels_out) const = 0;
};

}  // namespace terrane
