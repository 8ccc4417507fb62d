// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/imagery_source.h>
#include <terrane/terrain/lattice.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/view.h>

#include <array>
#include <compare>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

namespace terrane::internal {

// Imagery is paged in squares of the quadtree rooted in the world's root squares: the squares of chunks down to the
// finest chunk level, and finer squares down to the resolution of the imagery.

/// Texels along the side of a square's texture. kImageryBorder of them at each edge show the neighbours, so that the
/// coarsest mipmap still has one border texel.
inline constexpr int kImageryTexels = 256;
inline constexpr int kImageryBorder = 4;
inline constexpr int kImageryContent = kImageryTexels - 2 * kImageryBorder;
inline constexpr int kImageryMipmaps = 3;
/// Finest level of the quadtree.
inline constexpr int kMostImageryLevel = 24;

/// A square of a level: x and y count squares of the level from the lattice's origin.
struct ImagerySquare {
    int level = 0;
    std::int64_t y = 0, x = 0;
    friend constexpr auto operator<=>(const ImagerySquare&, const ImagerySquare&) = default;
};

/// Side of the squares of a level, metres.
double imagery_side(const Lattice& lattice, int level);
/// Rectangle of a square without and with its border, world metres.
WorldRect imagery_rect(const Lattice& lattice, const ImagerySquare& square);
WorldRect imagery_rect_with_border(const Lattice& lattice, const ImagerySquare& square);

/// The mipmaps of a square, finest first: colours times opacity.
struct ImageryTexture {
    std::array<std::vector<ImageryTexel>, kImageryMipmaps> mipmaps;
};

/// Multiplies colours by opacity, and averages 2 x 2 texels for each coarser mipmap.
///
/// @param texels [kImageryTexels * kImageryTexels] of a source
ImageryTexture make_imagery_texture(std::vector<ImageryTexel> texels);

/// The coarsest level with texels no larger than those of the imagery, `texel_size` metres; at most kMostImageryLevel.
int finest_imagery_level(const Lattice& lattice, double texel_size);

/// The squares that a view needs at its pixel size, each after the square that contains it: those in view, then those
/// around the eye that become visible by turning.
///
/// @param resident heights of the ground
/// @param rect     rectangle with imagery
/// @param most     largest number of squares; beyond it the finest are omitted
///
/// Cost: linear in the squares, plus the root squares at most 16 from the eye's root square
std::vector<ImagerySquare> select_imagery(const ResidentSet& resident, const View& view,
                                          const WorldRect& rect, double texel_size,
                                          std::size_t most);

/// A square to read.
struct ImageryRequest {
    ImagerySquare square;
    WorldRect rect;  ///< with its border
    friend bool operator==(const ImageryRequest&, const ImageryRequest&) = default;
};
/// A square that was read.
struct ImageryLoad {
    ImageryRequest request;
    std::optional<ImageryTexture> texture;  ///< absent: the source failed
};

/// Reads squares on its own thread, in the order of the last request.
///
/// Threads: called by the renderer's thread only
class ImageryLoader {
public:
    explicit ImageryLoader(std::shared_ptr<const ImagerySource> source);
    /// Waits for the square that is being read.
    ~ImageryLoader();

    /// Replaces the queue of squares to read.
    void request(std::vector<ImageryRequest> wanted);
    /// Squares that have been read since the last call. Never waits for the source.
    std::vector<ImageryLoad> take();
    /// Waits until all requested squares have been read.
    void finish();

private:
    void run(const std::stop_token& stop);
    ImageryLoad load(const ImageryRequest& request) const;

    std::shared_ptr<const ImagerySource> source_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::vector<ImageryRequest> wanted_;  // the next one is last
    std::optional<ImageryRequest> loading_;
    std::vector<ImageryLoad> loaded_;
    std::jthread thread_;  // declared last: it uses the others
};

}  // namespace terrane::internal
