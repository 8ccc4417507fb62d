// SPDX-License-Identifier: MIT
#include "ground/column/column.h"
#include "ground/column/ground_lift.h"
#include "ground/joined_queries.h"
#include "pairs/convex_core.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// Gap between the body and the surface after a separating translation, metres.
constexpr double kFree = 1e-9;
/// Relative tolerance of offsets here, which may be coarse: any offset that separates the body gives contacts.
constexpr double kRough = 1.0;

bool separates(const MeshQuery& query, const Eigen::Vector3d& d, bool& is_missing) {
    const LocalBody moved = query.moved(d);
    const MeshNearness near = find_nearness(query.surface(), moved, 0.0, kFree, kFree);
    is_missing = near.is_missing;
    return !near.is_missing && near.distance > 0.0;
}

/// Adds the deepest contacts of a body after a translation, with depths at the untranslated pose. False if there are
/// none.
bool add_contacts(const MeshQuery& query, const Eigen::Vector3d& d, const MeshOverlap& overlap,
                  HalfSpaces& spaces) {
    constexpr std::size_t kMostOfRound = 6;
    const LocalBody moved = query.moved(d);
    ContactPatches patches;
    find_mesh_contacts(query.surface(), moved, overlap.offset, kFree, kInfinity, patches);
    std::size_t count = 0;
    for (const Contact& contact : patches.finish()) {
        if (count == kMostOfRound || !(contact.depth > -kFree)) break;
        spaces.add({contact.normal, contact.depth + dot(contact.normal, d) + 2.0 * kFree});
        ++count;
    }
    return count > 0;
}

/// Extends a translation along the contact normals of the translated body until the body is separated. Finds none if
/// the translated body is deep.
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
        const MeshOverlap overlap =
            find_overlap_offset(query.surface(), query.moved(d), kFree, kRough);
        if (overlap.is_deep || overlap.is_missing) return answer;
        if (!add_contacts(query, d, overlap, spaces) || !find_shortest(spaces, d)) return answer;
    }
    return answer;
}

/// Candidate translations that lead out of the solid through the nearest points of its surface, nearest point first.
class Candidates {
public:
    void add(double distance, const Eigen::Vector3d& d) {
        if (count_ == kMost && !(distance < distances_[count_ - 1])) return;
        std::size_t at = count_ < kMost ? count_++ : count_ - 1;
        for (; at > 0 && distance < distances_[at - 1]; --at) {
            distances_[at] = distances_[at - 1];
            all_[at] = all_[at - 1];
        }
        distances_[at] = distance;
        all_[at] = d;
    }
    std::span<const Eigen::Vector3d> all() const { return {all_.data(), count_}; }

private:
    static constexpr std::size_t kMost = 12;
    std::array<Eigen::Vector3d, kMost> all_;
    std::array<double, kMost> distances_{};
    std::size_t count_ = 0;
};

/// Adds candidates through the surface points within `around` of `inside`, a point of the body.
void add_candidates(const MeshQuery& query, const Eigen::Vector3d& inside, double around,
                    Candidates& candidates) {
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(around);
    query.surface().visit({inside - half, inside + half}, [&](const SurfaceTriangle& triangle) {
        const Eigen::Vector3d to = closest_on_triangle(inside, triangle) - inside;
        const double distance = length(to);
        if (distance > around) return;
        const bool is_on = distance < kFree;
        const Eigen::Vector3d u = is_on ? triangle.normal : Eigen::Vector3d(to / distance);
        if (!(dot(u, triangle.normal) > 0.0)) return;  // the back of the triangle
        const double behind = dot(u, inside) - query.lowest(u);
        candidates.add(distance, (distance + behind + 2.0 * kFree) * u);
    });
}

/// Rise after which the body is above all ground over and under it, metres; 0 without ground, infinity if unknown.
double rise_over_all(const MeshQuery& query) {
    const LocalGround& local = query.local();
    const Aabb box = query.box(0.0);
    const CellRange cells = local.cells(box.low[0], box.low[1], box.high[0], box.high[1]);
    if (cells.east < cells.west || cells.north < cells.south) return 0.0;
    const RangeAnswer range = local.ground().range(cells);
    if (range.status == QueryStatus::outside) return 0.0;
    if (range.status == QueryStatus::not_resident) return kInfinity;
    constexpr double kHair = 1e-6;  // for rounding, metres
    const Eigen::Vector3d origin = local.to_world(Eigen::Vector3d::Zero());
    const Eigen::Vector3d wider = Eigen::Vector3d::Constant(kHair);
    Aabb columns{box.low + origin - wider, box.high + origin + wider};
    columns.low.z() = -kInfinity;
    columns.high.z() = kInfinity;
    const double top =
        std::max(local.z(range.high), highest_solid(local.ground(), cells, columns) - origin.z());
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
    LocalHull hull;
    const LocalShape first = query.body().part(0, hull);
    const Eigen::Vector3d inside = ErodedPart(first, 0, 0.0).inside();
    double around = query.body().whole().bounds.maxCoeff() + query.local().spacing();
    for (int search = 0; search < kSearches; ++search, around *= 2.0) {
        Candidates candidates;
        add_candidates(query, inside, around, candidates);
        MeshTranslation best;
        for (const Eigen::Vector3d& d : candidates.all()) {
            if (rise > 0.0 && length(d) >= rise) continue;
            if (best.is_found && length(d) >= length(best.d)) continue;
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
