// SPDX-License-Identifier: MIT
#include "pairs/kernels/manifold.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {

bool Manifold::Candidate::is_before(const Candidate& other) const {
    if (depth != other.depth) return depth > other.depth;
    if (features != other.features) return features < other.features;
    for (int i = 0; i < 3; ++i) {
        if (point[i] != other.point[i]) return point[i] < other.point[i];
    }
    return false;
}

void Manifold::add(const Eigen::Vector3d& point_on_a, double depth, ShapeFeature a, ShapeFeature b,
                   std::uint32_t part_a, std::uint32_t part_b) {
    if (!(depth >= -margin_)) return;
    if (count_ == kMost) reduce();
    deepest_ = count_ == 0 ? depth : std::max(deepest_, depth);
    candidates_[count_++] = {
        point_on_a, depth, {part_a, a.first, a.second, part_b, b.first, b.second}};
}

// Keeps up to four contacts: the deepest, the farthest from it, the one of the largest triangle with both, and the one
// that adds the largest area to the triangle.
void Manifold::reduce() {
    if (count_ == 0) return;
    sort();
    std::size_t kept = 1;
    double same_place = 0.0;  // square metres: points with a smaller gain coincide
    while (kept < 4) {
        double best = 0.0;
        std::size_t which = 0;
        for (std::size_t i = kept; i < count_; ++i) {
            const Eigen::Vector3d& p = candidates_[i].point;
            const Eigen::Vector3d& a = candidates_[0].point;
            double gain = 0.0;
            if (kept == 1) {
                const double along = dot(p - a, normal_);
                gain = dot(p - a, p - a) - along * along;
            } else {
                const Eigen::Vector3d& b = candidates_[1].point;
                const double area = dot(cross(b - a, p - a), normal_);
                if (kept == 2) {
                    gain = std::abs(area);
                } else {
                    const Eigen::Vector3d& c = candidates_[2].point;
                    const double side = dot(cross(b - a, c - a), normal_) < 0.0 ? -1.0 : 1.0;
                    gain = std::max({-side * area, -side * dot(cross(c - b, p - b), normal_),
                                     -side * dot(cross(a - c, p - c), normal_)});
                }
            }
            if (gain > best) {
                best = gain;
                which = i;
            }
        }
        if (which == 0) break;
        if (kept == 1) {
            same_place = 1e-12 * best;
            if (best < 1e-24) break;
        } else if (best < same_place) {
            break;
        }
        std::swap(candidates_[kept], candidates_[which]);
        ++kept;
    }
    count_ = kept;
}

void Manifold::sort() {
    std::sort(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(count_),
              [](const Candidate& a, const Candidate& b) { return a.is_before(b); });
}

std::size_t Manifold::finish(std::array<PairContact, 4>& contacts_out) {
    reduce();
    sort();
    for (std::size_t i = 0; i < count_; ++i) {
        const Candidate& from = candidates_[i];
        contacts_out[i] = {from.point,
                           normal_,
                           from.depth,
                           {from.features[1], from.features[2]},
                           {from.features[4], from.features[5]},
                           from.features[0],
                           from.features[3]};
    }
    return count_;
}

}  // namespace terrane::internal
