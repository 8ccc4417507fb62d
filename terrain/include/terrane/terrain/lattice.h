// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <compare>
#include <cstddef>
#include <cstdint>

namespace terrane {

/// The address of one chunk. Level 0 is a root square, the coarsest chunk; each further level halves the side of a
/// chunk. x grows east, y grows north; the south-west corner of (0, 0) is lattice point (0, 0).
struct ChunkKey {
    std::int32_t x = 0;      ///< column, counted in chunks of the level from lattice point (0, 0)
    std::int32_t y = 0;      ///< row
    std::uint8_t level = 0;  ///< 0: a root square

    friend constexpr auto operator<=>(const ChunkKey&, const ChunkKey&) = default;

    /// The chunk of the next coarser level that contains this one. Rounds down, also below zero. Requires level > 0.
    constexpr ChunkKey parent() const {
        return {x >> 1, y >> 1, static_cast<std::uint8_t>(level - 1)};
    }

    /// One of the four chunks of the next finer level: bit 0 of the quadrant is east, bit 1 is north.
    constexpr ChunkKey child(int quadrant) const {
        return {2 * x + (quadrant & 1), 2 * y + (quadrant >> 1),
                static_cast<std::uint8_t>(level + 1)};
    }

    /// Which child of its parent this is. Requires level > 0.
    constexpr int quadrant() const { return (x & 1) | ((y & 1) << 1); }
};

/// Hash function for unordered containers that are used for lookups and never iterated.
struct ChunkKeyHash {
    /// Hash of all members.
    std::size_t operator()(const ChunkKey& key) const {
        const std::uint64_t packed = static_cast<std::uint32_t>(key.x) |
                                     std::uint64_t{static_cast<std::uint32_t>(key.y)} << 32;
        const std::uint64_t hash = (packed + key.level * 0xd1b54a32d192ed03u) * 0x9e3779b97f4a7c15u;
        return static_cast<std::size_t>(hash >> 32);
    }
};

/// Cells along the side of a chunk, a power of two; a chunk has one more sample along its side.
inline constexpr int kChunkCells = 128;
/// Samples along the side of a chunk.
inline constexpr int kChunkSamples = kChunkCells + 1;

/// Largest absolute height, metres. Quanta and double positions are too coarse for ground beyond it.
inline constexpr double kMostHeight = 0x1p38;
/// Largest absolute height in quanta. Differences of heights then fit into 32 bits.
inline constexpr double kMostQuanta = 0x1p30;

/// Largest absolute coordinate of ground, poses and rays, metres. Doubles are 2^-12 m apart there.
inline constexpr double kFarthestPlace = 0x1p40;
/// Least and largest spacing of the finest level, metres. Within this range, bounds and screen errors fit into single
/// precision.
inline constexpr double kLeastSpacing = 0x1p-30;
inline constexpr double kMostSpacing = 0x1p20;  ///< see kLeastSpacing
/// Largest distance between the origins of the lattice and the world, in spacings. The side of a cell is then at least
/// 4096 times the distance between neighbouring doubles.
inline constexpr double kMostSpacingsFromOrigin = 0x1p40;

/// A point of the finest lattice, in finest spacings from the lattice's origin.
struct LatticePoint {
    std::int64_t x = 0;  ///< column on the finest lattice
    std::int64_t y = 0;  ///< row
    friend constexpr auto operator<=>(const LatticePoint&, const LatticePoint&) = default;
};

/// The integer addresses of all samples of a world, and their positions.
///
/// A world is a rectangle of root squares. All addresses are integers: two chunks agree on a shared sample because they
/// compute the same integer. Heights are integer multiples of `quantum`.
///
/// All root squares of a world are resident, unless there are more of them than fit into memory. Such a world has a
/// *root window*: a square of root squares that the pager moves with the camera.
struct Lattice {
    /// World x of lattice point (0, 0), metres; at most kMostSpacingsFromOrigin spacings from 0.
    double origin_x = 0.0;
    double origin_y = 0.0;          ///< world y of lattice point (0, 0), as origin_x
    double spacing = 1.0;           ///< between samples of the finest level, metres, 2^-30 to 2^20
    double quantum = 0x1p-12;       ///< unit of heights, metres, a power of two, 2^-60 to 2^20
    int finest_level = 0;           ///< 0 to 24; level 0 is a root square
    std::int32_t first_root_x = 0;  ///< ChunkKey::x of the westernmost root squares
    std::int32_t first_root_y = 0;  ///< ChunkKey::y of the southernmost root squares
    std::int32_t root_count_x =
        1;  ///< root squares from west to east, >= 1; <= 1024 without a root window
    std::int32_t root_count_y = 1;  ///< root squares from south to north, as root_count_x
    std::int32_t root_window =
        0;  ///< root squares along the side of the window, even, 4 to 64; 0: all are resident

    /// Distance between neighbouring samples of a level, in spacings of the finest level.
    constexpr std::int64_t step(int level) const {
        return std::int64_t{1} << (finest_level - level);
    }
    /// Side of a chunk of a level, in spacings of the finest level.
    constexpr std::int64_t chunk_side(int level) const { return kChunkCells * step(level); }
    /// Distance between neighbouring samples of a level, metres.
    constexpr double level_spacing(int level) const {
        return spacing * static_cast<double>(step(level));
    }
    /// Side of a root square, metres.
    constexpr double root_size() const { return level_spacing(0) * kChunkCells; }

    /// World x of a lattice index: one product and one sum. Not inline, so that its bits do not depend on the caller's
    /// compiler flags.
    double x(std::int64_t index) const;
    /// World y of a lattice index, as x().
    double y(std::int64_t index) const;

    /// South-west corner of a chunk.
    constexpr LatticePoint corner(const ChunkKey& key) const {
        return {key.x * chunk_side(key.level), key.y * chunk_side(key.level)};
    }

    /// The world's western edge in lattice indices.
    constexpr std::int64_t west() const { return first_root_x * chunk_side(0); }
    /// The world's southern edge in lattice indices.
    constexpr std::int64_t south() const { return first_root_y * chunk_side(0); }
    /// The world's eastern edge in lattice indices.
    constexpr std::int64_t east() const { return (first_root_x + root_count_x) * chunk_side(0); }
    /// The world's northern edge in lattice indices.
    constexpr std::int64_t north() const { return (first_root_y + root_count_y) * chunk_side(0); }

    /// Number of root squares that are resident at a time.
    constexpr std::int64_t resident_root_count() const {
        const auto along = [this](std::int32_t count) {
            return std::int64_t{root_window > 0 && root_window < count ? root_window : count};
        };
        return along(root_count_x) * along(root_count_y);
    }

    /// Whether a key names a chunk of this world.
    constexpr bool contains(const ChunkKey& key) const {
        if (key.level > finest_level) return false;
        const std::int64_t per_root = std::int64_t{1} << key.level;
        return key.x >= first_root_x * per_root && key.y >= first_root_y * per_root &&
               key.x < (first_root_x + root_count_x) * per_root &&
               key.y < (first_root_y + root_count_y) * per_root;
    }

    /// The coarsest level whose spacing is at most `wanted`, metres; the finest level if all spacings are larger.
    int level_for_spacing(double wanted) const;

    /// Fails: invalid_argument, naming the field and its value, for a lattice out of range
    Result<void> validate() const;

    friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// Whether a cell is cut along the diagonal from its south-west to its north-east corner; otherwise it is cut along the
/// other diagonal. True if the sum of its column and row, counted in cells of its level from lattice point (0, 0), is
/// even. Drawing and contact share this rule.
constexpr bool cut_to_north_east(std::int64_t column, std::int64_t row) {
    return ((column + row) & 1) == 0;
}

/// A rectangle of lattice points that are `step` finest spacings apart. Stored row by row from the south-west.
struct SampleGrid {
    LatticePoint corner;    ///< south-western sample; may be outside the world
    std::int64_t step = 1;  ///< between neighbours, in finest spacings; a power of two
    int columns = 0;        ///< samples from west to east
    int rows = 0;           ///< samples from south to north

    /// Number of samples.
    std::size_t size() const {
        return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    }
};

}  // namespace terrane
