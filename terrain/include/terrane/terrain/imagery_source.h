// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <array>
#include <cstdint>
#include <span>

namespace terrane {

/// A colour of imagery: red, green and blue with display gamma, and opacity (0: no data), 0 to 255.
using ImageryTexel = std::array<std::uint8_t, 4>;

/// Where imagery comes from that is draped over the ground: a raster, a map, a test picture.
class ImagerySource {
public:
    virtual ~ImagerySource() = default;

    /// Where it has data, metres of the world.
    virtual WorldRect rect() const = 0;
    /// Side of its finest texels, metres, > 0: finer squares than this are not asked for.
    virtual double texel_size() const = 0;

    /// Reads a square, each texel with the colour of its middle, or the mean of its area where the source is finer.
    ///
    /// @param square     world metres; may extend beyond rect(): no data there
    /// @param side       texels along its side
    /// @param texels_out [side * side] row by row from the south-west
    ///
    /// Fails:   with the source's own errors, such as io. The renderer then leaves the square without imagery, as it
    ///          does after an exception
    /// Threads: any number at once
    virtual Result<void> read(const WorldRect& square, int side,
                              std::span<ImageryTexel> texels_out) const = 0;
};

}  // namespace terrane
