// SPDX-License-Identifier: MIT
#include "query/query_ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace terrane::tools {

QueryGround::QueryGround(std::shared_ptr<const HeightSource> source, Pager pager,
                         const QueryGroundSettings& settings)
    : source_(std::move(source)),
      pager_(std::move(pager)),
      surface_(settings.surface),
      max_chunks_(settings.memory_bytes / Chunk::max_bytes()) {}

Result<QueryGround> QueryGround::create(std::shared_ptr<const HeightSource> source,
                                        const QueryGroundSettings& settings) {
    // without workers update() loads everything requested, so that no answer depends on time
    TERRANE_TRY(Pager pager, Pager::create(source, {.memory_bytes = settings.memory_bytes,
                                                    .worker_count = 0,
                                                    .contact_spacing = settings.contact_spacing}));
    QueryGround made(std::move(source), std::move(pager), settings);
    made.pager_.update({}, {}, made.time_s_);
    made.ground_ = made.pager_.ground(made.surface_);
    return made;
}

bool QueryGround::load(const WorldRect& region) {
    const WorldRect& extent = ground_->extent();
    const double margin = ground_->spacing();
    const WorldRect wanted{
        std::max(region.west - margin, extent.west), std::max(region.south - margin, extent.south),
        std::min(region.east + margin, extent.east), std::min(region.north + margin, extent.north)};
    if (!(wanted.west <= wanted.east && wanted.south <= wanted.north)) return true;
    // refuses without a load requests that can never fit
    const double side = margin * kChunkCells;
    const double chunk_count = std::floor((wanted.east - wanted.west) / side) *
                               std::floor((wanted.north - wanted.south) / side);
    if (chunk_count > static_cast<double>(max_chunks_)) return false;

    const RequiredRegion& held = held_.emplace_back(pager_.require(wanted, time_s_));
    const int level = ground_->level();
    // release the old set first: chunks that only it refers to count against the memory ceiling
    ground_.reset();
    time_s_ += 1.0;
    pager_.update({}, {}, time_s_);
    if (held.state() == RegionState::failing) {
        // a chunk with volumes may turn out larger than its claim; the next load claims what it needs
        time_s_ += 1.0;
        pager_.update({}, {}, time_s_);
    }
    ground_.emplace(pager_.resident(), level, surface_);
    return held.is_ready();
}

void QueryGround::release() { held_.clear(); }

std::vector<WorldRect> cut_path(const WorldPos& from_world, const WorldPos& to_world, double reach,
                                double side, const WorldRect& extent) {
    const std::array<double, 2> low{extent.west - reach, extent.south - reach};
    const std::array<double, 2> high{extent.east + reach, extent.north + reach};
    const std::array<double, 2> from{from_world.x(), from_world.y()};
    const std::array<double, 2> displacement{to_world.x() - from_world.x(),
                                             to_world.y() - from_world.y()};
    double enter = 0.0;
    double leave = 1.0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (displacement[axis] == 0.0) {
            if (from[axis] < low[axis] || from[axis] > high[axis]) return {};
            continue;
        }
        const double t0 = (low[axis] - from[axis]) / displacement[axis];
        const double t1 = (high[axis] - from[axis]) / displacement[axis];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
    }
    if (enter > leave) return {};
    const double length = (leave - enter) * std::sqrt(displacement[0] * displacement[0] +
                                                      displacement[1] * displacement[1]);
    const double whole = std::max(1.0, std::ceil(length / side));
    const auto count =
        static_cast<std::size_t>(std::min(whole, static_cast<double>(kMostPathPieces)));
    std::vector<WorldRect> pieces;
    pieces.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double share = 1.0 / whole;
        const double t0 = enter + (leave - enter) * share * static_cast<double>(i);
        const double t1 = enter + (leave - enter) * share * static_cast<double>(i + 1);
        const double x0 = from[0] + t0 * displacement[0], x1 = from[0] + t1 * displacement[0];
        const double y0 = from[1] + t0 * displacement[1], y1 = from[1] + t1 * displacement[1];
        pieces.push_back({std::min(x0, x1) - reach, std::min(y0, y1) - reach,
                          std::max(x0, x1) + reach, std::max(y0, y1) + reach});
    }
    return pieces;
}

double distance_beside(const WorldPos& p_world, const WorldRect& rect) {
    const double x = std::max({rect.west - p_world.x(), 0.0, p_world.x() - rect.east});
    const double y = std::max({rect.south - p_world.y(), 0.0, p_world.y() - rect.north});
    return std::sqrt(x * x + y * y);
}

// The part of a segment over the extent is divided into 2^n equal pieces, the leaves of a binary tree. A subtree is
// skipped if the height interval over its rectangle does not reach the segment.

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

// The first piece of a node of the tree, at or after next_, that may be near the surface.
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
        if (found.status == QueryStatus::ok) {
            found.fraction = std::clamp(begin + found.fraction * (end - begin), 0.0, 1.0);
        }
        if (found.status != QueryStatus::miss) return found;
        ground.release();
    }
    RayAnswer answer;
    answer.status = pieces.has_given_up() ? QueryStatus::not_resident : QueryStatus::miss;
    return answer;
}

}  // namespace terrane::tools
