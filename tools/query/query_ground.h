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
/// Query first and load() only if the answer is not_resident: resident ground costs no update.
class QueryGround {
public:
    /// Fails as Pager::create().
    static Result<QueryGround> create(std::shared_ptr<const HeightSource> source,
                                      const QueryGroundSettings& settings);

    /// Source of the ground.
    const HeightSource& source() const { return *source_; }

    /// The ground loaded so far, which load() replaces.
    const Ground& ground() const { return *ground_; }

    /// Loads the ground of a rectangle and one cell around it, and keeps it until release(). False if it does not fit
    /// in memory together with ground already kept, or the source cannot be read.
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
    double time_s_ = 0.0;         ///< the pager's time: a count, because only the order matters
};

/// Largest number of pieces of a path.
inline constexpr std::size_t kMostPathPieces = std::size_t{1} << 20;

/// Rectangles that cover the part of a segment over the extent, with a margin of `reach` on each side, in order along
/// the segment. Each covers a piece of at most `side` metres. Only the first kMostPathPieces are returned.
std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent);

/// Horizontal distance of a point from a rectangle; 0 inside.
double distance_beside(const WorldPos& p_world, const WorldRect& rect);

// Queries that load ground on demand.

/// Whether an answer needs ground that is not resident.
template <class Answer>
bool is_absent(const Answer& answer) {
    return answer.status == decltype(answer.status)::not_resident;
}

/// Calls `ask`; if ground around a shape is not resident, loads it and calls `ask` again.
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

/// Calls `ask` until the answer is complete, and between the calls loads ground along a segment in growing batches, so
/// that a motion that the ground stops early does not load its whole path.
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

/// Rays with a horizontal length above this, metres, are answered by long_ray().
inline constexpr double kLongRay = 0x1p18;

/// A part of a segment, as fractions of its length.
struct RayPiece {
    double begin = 0.0;
    double end = 1.0;
};

/// The pieces of a segment that may be near the surface, according to the source's intervals, in order along the
/// segment. A ray needs no ground between them.
class NearPieces {
public:
    /// @param side    largest horizontal length of a piece, metres, > 0
    /// @param margin  distance that counts as near along each axis, metres, >= 0
    NearPieces(const WorldPos& from_world, const WorldPos& to_world, const HeightSource& source,
               double side, double margin);

    /// The next piece; absent at the end of the segment, or if has_given_up().
    std::optional<RayPiece> next();

    /// Whether next() ended because it had computed kMostIntervals intervals.
    bool has_given_up() const { return intervals_ >= kMostIntervals; }

    /// Limit of intervals computed for one segment.
    static constexpr std::uint64_t kMostIntervals = std::uint64_t{1} << 20;

private:
    std::optional<std::uint64_t> first_near(std::uint64_t first, int log2_count);
    bool may_be_near(std::uint64_t first, int log2_count);
    double share(std::uint64_t piece) const;

    WorldPos from_, displacement_;
    const HeightSource& source_;
    double margin_;
    double enter_ = 0.0, leave_ = 1.0;  ///< the part over the extent; empty if enter_ > leave_
    int log2_count_ = 0;                ///< log2 of the number of pieces of this part
    std::uint64_t next_ = 0;            ///< pieces before it have been returned
    std::uint64_t intervals_ = 0;
};

/// Answers as Ground::ray(), but loads ground piece by piece, only where the ray may hit it. Fraction and point are
/// computed from the piece that hits the ground, so that their error is the rounding of the piece's ends: a unit in the
/// last place of the coordinates. `not_resident` if the ground does not fit in memory, or if NearPieces gives up.
RayAnswer long_ray(QueryGround& ground, const WorldPos& from_world, const WorldPos& to_world);

}  // namespace terrane::tools
