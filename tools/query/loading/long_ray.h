// SPDX-License-Identifier: MIT
#pragma once

#include "query/loading/query_ground.h"

#include <terrane/terrain/ground.h>

#include <cstdint>
#include <optional>

namespace terrane::tools {

/// Rays that are longer than this in the plane, metres, are answered by long_ray().
inline constexpr double kLongRay = 0x1p18;

/// A part of a segment, as fractions of its way.
struct RayPiece {
    double begin = 0.0;
    double end = 1.0;
};

/// The pieces of a segment in which a point may be near the surface, by the source's intervals, in order from its
/// beginning. What lies between them need not be loaded.
class NearPieces {
public:
    /// @param side    most metres of a piece in the plane, > 0
    /// @param margin  metres, >= 0, along each axis: what counts as near
    NearPieces(const WorldPos& from_world, const WorldPos& to_world, const HeightSource& source,
               double side, double margin);

    /// The next piece; none where there is no other one, or where has_given_up().
    std::optional<RayPiece> next();

    /// Whether next() ended because it had asked for kMostIntervals.
    bool has_given_up() const { return intervals_ >= kMostIntervals; }

    /// Intervals that all pieces of one segment may take.
    static constexpr std::uint64_t kMostIntervals = std::uint64_t{1} << 20;

private:
    std::optional<std::uint64_t> first_near(std::uint64_t first, int log2_count);
    bool may_be_near(std::uint64_t first, int log2_count);
    double share(std::uint64_t piece) const;

    WorldPos from_, displacement_;
    const HeightSource& source_;
    double margin_;
    double enter_ = 0.0, leave_ = 1.0;  ///< the part over the extent; empty where enter_ > leave_
    int log2_count_ = 0;                ///< of the pieces that this part is cut into
    std::uint64_t next_ = 0;            ///< pieces before it have been given
    std::uint64_t intervals_ = 0;
};

/// Ground::ray() that loads the ground only where the ray may meet it, piece by piece. Fraction and point are those of
/// the piece that is met, so that their rounding is that of its ends: a unit in the last place of the coordinates.
/// `not_resident` where the ground does not fit in memory, and where NearPieces gives up.
RayAnswer long_ray(QueryGround& ground, const WorldPos& from_world, const WorldPos& to_world);

}  // namespace terrane::tools
