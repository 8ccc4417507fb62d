// SPDX-License-Identifier: MIT
#include "mesh/mesh_depth.h"

#include "ground/lift/ground_lift.h"
#include "math/half_spaces.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// What is left of a gap after a separating translation, metres.
constexpr double kFree = 1e-9;

bool separates(const MeshQuery& query, const Eigen::Vector3d& d, bool& is_missing) {
    const LocalBody moved = query.moved(d);
    const MeshNearness near = find_nearness(query.surface(), moved, 0.0, kFree, kFree);
    is_missing = near.is_missing;
    return !near.is_missing && near.distance > 0.0;
}

/// Adds the deepest contacts that a body has after a translation, counted from before it. False where there are none.
bool add_contacts(const MeshQuery& query, const Eigen::Vector3d& d, const MeshOverlap& overlap,
                  HalfSpaces& spaces) {
    constexpr std::size_t kMostOfRound = 6;
    const LocalBody moved = query.moved(d);
    ContactPatches patches;
    find_mesh_contacts(query.surface(), moved, overlap.offset, 0.0, kInfinity, patches);
    std::size_t count = 0;
    for (const Contact& contact : patches.finish()) {
        if (count == kMostOfRound || !(contact.depth > -kFree)) break;
        spaces.add({contact.normal, contact.depth + dot(contact.normal, d) + 2.0 * kFree});
        ++count;
    }
    return count > 0;
}

/// Lengthens a translation along the contacts that a body has after it, until it separates. Where the body is deep
/// after it, there is no answer.
MeshTranslation refine(const MeshQuery& query, Eigen::Vector3d d) {
    constexpr int kRounds = 24;
    MeshTranslation answer;
    HalfSpaces spaces;
    const double size = length(d);
    if (size > 0.0) spaces.add({d / size, size});
    for (int round = 0; round < kRounds; ++round) {
        if (separates(query, d, answer.is_missing)) {
            answer.is_found = true;
            answer.d = d;
            return answer;
        }
        if (answer.is_missing) return answer;
        const MeshOverlap overlap = find_overlap_offset(query.surface(), query.moved(d), kFree);
        if (overlap.is_deep || overlap.is_missing) return answer;
        if (!add_contacts(query, d, overlap, spaces) || !find_shortest(spaces, d)) return answer;
    }
    return answer;
}

/// The shortest candidates that were found, in order.
class Candidates {
public:
    void add(const Eigen::Vector3d& d) {
        const double size = length(d);
        if (count_ == kMost && !(size < sizes_[count_ - 1])) return;
        std::size_t at = count_ < kMost ? count_++ : count_ - 1;
        for (; at > 0 && size < sizes_[at - 1]; --at) {
            sizes_[at] = sizes_[at - 1];
            all_[at] = all_[at - 1];
        }
        sizes_[at] = size;
        all_[at] = d;
    }
    std::span<const Eigen::Vector3d> all() const { return {all_.data(), count_}; }

private:
    static constexpr std::size_t kMost = 32;
    std::array<Eigen::Vector3d, kMost> all_;
    std::array<double, kMost> sizes_{};
    std::size_t count_ = 0;
};

void add_candidates(const MeshQuery& query, double around, Candidates& candidates) {
    constexpr double kFloor = 0.2;  // least z of the normal of a surface to stand on
    query.surface().visit(query.box(around), [&](const SurfaceTriangle& t) {
        const double depth = dot(t.normal, t.v[0]) - query.lowest(t.normal) + 2.0 * kFree;
        if (!(depth > 0.0)) return;
        candidates.add(depth * t.normal);
        if (t.normal.z() > kFloor) candidates.add({0.0, 0.0, depth / t.normal.z()});
    });
}

/// Up over all that lies over and under the body; 0 where there is nothing, infinity where it is not known.
double rise_over_all(const MeshQuery& query) {
    const LocalGround& local = query.local();
    const Aabb box = query.box(0.0);
    const CellRange cells = local.cells(box.low[0], box.low[1], box.high[0], box.high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return 0.0;
    const RangeAnswer range = local.ground().range(cells);
    if (range.status == GroundStatus::outside) return 0.0;
    if (range.status == GroundStatus::not_resident) return kInfinity;
    const double base = local.to_world(Eigen::Vector3d::Zero()).z();
    const double top = std::max(local.z(range.high), highest_solid(local.ground(), cells) - base);
    return std::max(0.0, top - box.low.z() + 2.0 * kFree);
}

}  // namespace

MeshTranslation find_separating_translation(const MeshQuery& query, const MeshOverlap& overlap) {
    constexpr int kSearches = 6;
    MeshTranslation answer;
    if (!overlap.is_deep) {
        answer = refine(query, Eigen::Vector3d::Zero());
        if (answer.is_found || answer.is_missing) return answer;
    }
    const double rise = rise_over_all(query);
    double around = query.body().whole().bounds.maxCoeff() + query.local().spacing();
    for (int search = 0; search < kSearches; ++search, around *= 2.0) {
        Candidates candidates;
        add_candidates(query, around, candidates);
        MeshTranslation best;
        for (const Eigen::Vector3d& d : candidates.all()) {
            if (rise > 0.0 && length(d) >= rise) break;
            if (best.is_found && length(d) >= length(best.d)) break;
            const MeshTranslation found = refine(query, d);
            const bool is_better =
                found.is_found && (!best.is_found || length(found.d) < length(best.d));
            if (is_better) best = found;
            answer.is_missing = answer.is_missing || found.is_missing;
        }
        if (best.is_found && !(rise > 0.0 && length(best.d) >= rise)) return best;
        if (around > rise) break;
    }
    if (rise > 0.0 && rise < kInfinity) {
        answer.is_found = true;
        answer.d = {0.0, 0.0, rise};
        answer.is_missing = false;
    }
    return answer;
}

}  // namespace terrane::internal
