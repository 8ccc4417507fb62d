// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

struct QueryGroundSettings {
    double contact_spacing = 0.0;  ///< metres; 0: the finest
    std::size_t memory_bytes = std::size_t{1} << 30;
    std::shared_ptr<const SurfaceMap> surface = {};  ///< of the ground; null: none
};

/// Ground loaded on demand; evicted only when the memory ceiling requires it.
///
/// Query first and load() only where the answer is not_resident: resident ground costs no update.
class QueryGround {
public:
    /// Fails as Pager::create().
    static Result<QueryGround> create(std::shared_ptr<const HeightSource> source,
                                      const QueryGroundSettings& settings);

    /// Where the ground is loaded from.
    const HeightSource& source() const { return *source_; }

    /// Replaced by load().
    const Ground& ground() const { return *ground_; }

    /// Loads the ground of a rectangle and one cell around it, and keeps it until release(). False where it does not
    /// fit in memory together with what is kept, or the source cannot be read.
    bool load(const WorldRect& region);

    /// Allows eviction of everything loaded.
    void release();

private:
    QueryGround(std::shared_ptr<const HeightSource> source, Pager pager,
                const QueryGroundSettings& settings);

    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    std::shared_ptr<const SurfaceMap> surface_;
    std::optional<Ground> ground_;
    std::vector<RequiredRegion> held_;
    std::size_t max_chunks_ = 0;  ///< capacity of the memory ceiling
    double time_s_ = 0.0;         ///< number of loads: only the order matters
};

/// The most pieces that a path is cut into.
inline constexpr std::size_t kMostPathPieces = std::size_t{1} << 20;

/// Rectangles that cover the part of a segment above the extent, with `reach` to each side, in order along it. Each
/// rectangle covers a piece of at most `side` metres; of more than kMostPathPieces the first so many.
std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent);

/// Horizontal distance of a point from a rectangle; 0 inside.
double distance_beside(const WorldPos& p_world, const WorldRect& rect);

// Questions whose ground is loaded where the answer needs it.

/// Whether an answer needs ground that is not resident.
template <class Answer>
bool is_absent(const Answer& answer) {
    return answer.status == decltype(answer.status)::not_resident;
}

/// Calls `ask`; where ground around a shape is not resident, loads it and calls `ask` again.
template <class Ask>
auto ask_around(QueryGround& ground, const WorldPos& centre_world, double reach, Ask ask) {
    auto answer = ask();
    if (is_absent(answer)) {
        ground.load({centre_world.x() - reach, centre_world.y() - reach, centre_world.x() + reach,
                     centre_world.y() + reach});
        answer = ask();
    }
    return answer;
}

/// Calls `ask` while loading ground along a segment in growing batches, until the answer is complete: a motion that
/// ends early at the ground loads nothing beyond.
template <class Ask>
auto ask_along(QueryGround& ground, const WorldPos& from_world, const WorldPos& to_world,
               double reach, Ask ask) {
    auto answer = ask();
    if (!is_absent(answer)) return answer;
    const double side = ground.ground().spacing() * kChunkCells;
    const std::vector<WorldRect> pieces =
        cut_path(from_world, to_world, reach, side, ground.ground().extent());
    std::size_t batch = 1;
    for (std::size_t next = 0; next < pieces.size() && is_absent(answer); batch *= 2) {
        for (std::size_t end = std::min(next + batch, pieces.size()); next < end; ++next) {
            if (!ground.load(pieces[next])) return ask();
        }
        answer = ask();
    }
    return answer;
}

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
