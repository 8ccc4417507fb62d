// SPDX-License-Identifier: MIT
//
// The part of a segment over the extent is cut into 2^n equal pieces. They are the leaves of a binary tree; a node is
// left out with all below it where the interval of heights over its rectangle does not reach the segment.
#include "query/loading/long_ray.h"

#include "query/loading/ground_loading.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace terrane::tools {
namespace {

constexpr int kMostHalvings = 52;  // fractions of pieces are exact

}  // namespace

NearPieces::NearPieces(const WorldPos& from_world, const WorldPos& to_world,
                       const HeightSource& source, double side, double margin)
    : from_(from_world), displacement_(to_world - from_world), source_(source), margin_(margin) {
    const WorldRect& extent = source.extent();
    const std::array low{extent.west - margin, extent.south - margin};
    const std::array high{extent.east + margin, extent.north + margin};
    for (const int axis : {0, 1}) {
        const auto a = static_cast<std::size_t>(axis);
        if (displacement_[axis] == 0.0) {
            if (from_[axis] < low[a] || from_[axis] > high[a]) leave_ = -1.0;
            continue;
        }
        const double t0 = (low[a] - from_[axis]) / displacement_[axis];
        const double t1 = (high[a] - from_[axis]) / displacement_[axis];
        enter_ = std::max(enter_, std::min(t0, t1));
        leave_ = std::min(leave_, std::max(t0, t1));
    }
    const double length = (leave_ - enter_) * displacement_.head<2>().norm();
    while (log2_count_ < kMostHalvings && std::ldexp(side, log2_count_) < length) ++log2_count_;
}

double NearPieces::share(std::uint64_t piece) const {
    return enter_ + (leave_ - enter_) * std::ldexp(static_cast<double>(piece), -log2_count_);
}

bool NearPieces::may_be_near(std::uint64_t first, int log2_count) {
    ++intervals_;
    const WorldPos a = from_ + share(first) * displacement_;
    const WorldPos b = from_ + share(first + (std::uint64_t{1} << log2_count)) * displacement_;
    const HeightInterval heights =
        source_.interval({std::min(a.x(), b.x()) - margin_, std::min(a.y(), b.y()) - margin_,
                          std::max(a.x(), b.x()) + margin_, std::max(a.y(), b.y()) + margin_});
    return !(std::min(a.z(), b.z()) > heights.high + margin_ ||
             std::max(a.z(), b.z()) < heights.low - margin_);
}

// The first piece of a node from next_ on that may be near.
std::optional<std::uint64_t> NearPieces::first_near(std::uint64_t first, int log2_count) {
    if (first + (std::uint64_t{1} << log2_count) <= next_ || has_given_up()) return std::nullopt;
    if (!may_be_near(first, log2_count)) return std::nullopt;
    if (log2_count == 0) return first;
    const auto found = first_near(first, log2_count - 1);
    if (found) return found;
    return first_near(first + (std::uint64_t{1} << (log2_count - 1)), log2_count - 1);
}

std::optional<RayPiece> NearPieces::next() {
    if (!(enter_ <= leave_)) return std::nullopt;
    const std::optional<std::uint64_t> piece = first_near(0, log2_count_);
    if (!piece) return std::nullopt;
    next_ = *piece + 1;
    return RayPiece{share(*piece), share(next_)};
}

RayAnswer long_ray(QueryGround& ground, const WorldPos& from_world, const WorldPos& to_world) {
    const double spacing = ground.ground().spacing();
    const WorldPos displacement = to_world - from_world;
    NearPieces pieces(from_world, to_world, ground.source(), spacing * kChunkCells,
                      spacing + ground.ground().lattice().quantum);
    // pieces overlap, so that no hit is lost between two of them
    const double overlap = spacing / displacement.head<2>().norm();
    while (const auto piece = pieces.next()) {
        const double begin = std::max(0.0, piece->begin - overlap);
        const double end = std::min(1.0, piece->end + overlap);
        const WorldPos begin_world = from_world + begin * displacement;
        const WorldPos end_world = from_world + end * displacement;
        RayAnswer found = ask_along(ground, begin_world, end_world, 0.0,
                                    [&] { return ground.ground().ray(begin_world, end_world); });
        if (found.status == GroundStatus::ok) {
            found.fraction = std::clamp(begin + found.fraction * (end - begin), 0.0, 1.0);
        }
        if (found.status != GroundStatus::miss) return found;
        ground.release();
    }
    RayAnswer answer;
    answer.status = pieces.has_given_up() ? GroundStatus::not_resident : GroundStatus::miss;
    return answer;
}

}  // namespace terrane::tools
