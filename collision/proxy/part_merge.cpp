// SPDX-License-Identifier: MIT
//
// Source:     Mamou, Ghorbel. A simple and efficient approach for 3D mesh approximate convex decomposition. ICIP 2009
//             (parts are merged in the order of their cost).
// Deviations: a merge costs the volume that the common hull adds; it is made where the certified distance of the common
//             hull is within the error.
#include "proxy/part_merge.h"

#include "base/boxes.h"

#include <algorithm>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

/// The common hull of two parts.
struct MergedPair {
    double added_volume = 0.0;
    std::size_t first = 0, second = 0;  ///< parts, by their number
    ProxyPart part;

    bool operator<(const MergedPair& other) const {  // the queue's top is the greatest
        return std::tie(added_volume, first, second) >
               std::tie(other.added_volume, other.first, other.second);
    }
};

class PartMerger {
public:
    PartMerger(const SolidMesh& solid, std::vector<ProxyPart> parts) : solid_(solid) {
        for (ProxyPart& part : parts) parts_.emplace_back(std::move(part));
        count_ = parts_.size();
    }

    /// Merges while the distance allows it and more than `enough` parts are left.
    Result<void> run(double error, std::size_t enough, bool only_neighbours) {
        pairs_ = {};
        margin_ = only_neighbours ? std::max(0.5 * error, 1e-9 * solid_.extent) : kInfinity;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            if (const Result<void> added = add_pairs(i); !added) return added;
        }
        while (!pairs_.empty() && count_ > enough) {
            MergedPair pair = pairs_.top();
            pairs_.pop();
            if (!parts_[pair.first] || !parts_[pair.second]) continue;
            pair.part.distance =
                distance_outside(solid_, pair.part.hull, error < kInfinity ? error : 0.0,
                                 error < kInfinity ? 0.0 : 1e-2 * solid_.extent, error);
            if (!(pair.part.distance.high <= error)) continue;
            parts_[pair.first].reset();
            parts_[pair.second].reset();
            parts_.emplace_back(std::move(pair.part));
            --count_;
            drop_contained(parts_.size() - 1);
            if (const Result<void> added = add_pairs(parts_.size() - 1); !added) return added;
        }
        return {};
    }

    std::vector<ProxyPart> take() {
        std::vector<ProxyPart> left;
        for (std::optional<ProxyPart>& part : parts_) {
            if (part) left.push_back(*std::move(part));
        }
        return left;
    }

private:
    /// Removes the parts that a new one contains.
    void drop_contained(std::size_t by) {
        const ConvexHull& hull = parts_[by]->hull;
        for (std::size_t i = 0; i < by; ++i) {
            if (!parts_[i] || !overlap(parts_[i]->bounds, parts_[by]->bounds, 0.0)) continue;
            const std::span<const Eigen::Vector3d> all = parts_[i]->hull.vertices();
            const bool is_contained =
                std::all_of(all.begin(), all.end(), [&](const Eigen::Vector3d& vertex) {
                    return !(distance_to_hull(hull, vertex) > 1e-12 * solid_.extent);
                });
            if (!is_contained) continue;
            parts_[i].reset();
            --count_;
        }
    }

    /// The pairs of a part with those before it.
    Result<void> add_pairs(std::size_t second) {
        if (!parts_[second]) return {};
        const ProxyPart& b = *parts_[second];
        for (std::size_t first = 0; first < second; ++first) {
            if (!parts_[first] || !overlap(parts_[first]->bounds, b.bounds, margin_)) continue;
            const ProxyPart& a = *parts_[first];
            std::vector<Eigen::Vector3d> points(a.hull.vertices().begin(), a.hull.vertices().end());
            points.insert(points.end(), b.hull.vertices().begin(), b.hull.vertices().end());
            Result<ProxyPart> made = make_part(points);
            if (!made) return tl::unexpected<Error>(made.error());
            const double added = made->volume - a.volume - b.volume;
            pairs_.push({added, first, second, *std::move(made)});
        }
        return {};
    }

    const SolidMesh& solid_;
    double margin_ = 0.0;
    std::size_t count_ = 0;
    std::vector<std::optional<ProxyPart>> parts_;  ///< those that were merged are absent
    std::priority_queue<MergedPair> pairs_;
};

}  // namespace

Result<std::vector<ProxyPart>> merge_parts(const SolidMesh& solid, std::vector<ProxyPart> parts,
                                           double error, std::size_t max_parts) {
    PartMerger merger(solid, std::move(parts));
    if (const Result<void> done = merger.run(error, 1, true); !done) {
        return tl::unexpected<Error>(done.error());
    }
    if (const Result<void> done = merger.run(kInfinity, max_parts, false); !done) {
        return tl::unexpected<Error>(done.error());
    }
    return merger.take();
}

ReducedHull reduce_hull(const ConvexHull& hull, double error, std::size_t max_vertices) {
    const std::span<const Eigen::Vector3d> all = hull.vertices();
    if (all.size() <= 4) return {hull, 0.0};
    // Four vertices to begin with: the first in order, the farthest from it, and so on.
    std::vector<Eigen::Vector3d> chosen{all[0]};
    for (;;) {
        const ConvexHull made = ConvexHull::create(chosen).value();
        double farthest = 0.0;
        const Eigen::Vector3d* next = nullptr;
        for (const Eigen::Vector3d& vertex : all) {
            const double distance = distance_to_hull(made, vertex);
            if (distance > farthest) {
                farthest = distance;
                next = &vertex;
            }
        }
        const bool is_enough = chosen.size() >= 4 && farthest <= error;
        if (next == nullptr || is_enough || chosen.size() >= max_vertices) return {made, farthest};
        chosen.push_back(*next);
    }
}

}  // namespace terrane::internal
