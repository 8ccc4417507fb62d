// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "shapes/hull/face_merge.h"

#include <algorithm>
#include <cstddef>

namespace terrane::internal {
namespace {

// A point in a loop.
struct Node {
    std::uint32_t point;
    std::uint32_t face;
    std::uint32_t before;
    std::uint32_t after;
};

class CollinearPointFilter {
public:
    CollinearPointFilter(const std::vector<LatticePoint>& points, double tolerance,
                         const std::vector<HullFace>& faces)
        : points_(points), tolerance_(tolerance), first_(points.size() + 1, 0) {
        for (const HullFace& face : faces) {
            sizes_.push_back(face.loop.size());
            for (const std::uint32_t point : face.loop) ++first_[point + 1];
        }
        for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
        nodes_of_.resize(first_.back());
        std::vector<std::uint32_t> filled(first_.begin(), first_.end() - 1);
        for (std::uint32_t face = 0; face < faces.size(); ++face) {
            const std::vector<std::uint32_t>& loop = faces[face].loop;
            const auto begin = static_cast<std::uint32_t>(nodes_.size());
            const auto count = static_cast<std::uint32_t>(loop.size());
            for (std::uint32_t i = 0; i < count; ++i) {
                nodes_of_[filled[loop[i]]++] = begin + i;
                nodes_.push_back(
                    {loop[i], face, begin + (i + count - 1) % count, begin + (i + 1) % count});
            }
        }
        dropped_.resize(points.size(), 0);
    }

    bool run_round() {
        bool any = false;
        std::vector<char> stays(points_.size(), 0);
        for (std::uint32_t point = 0; point < points_.size(); ++point) {
            if (dropped_[point] != 0 || stays[point] != 0 || !can_drop(point)) continue;
            any = true;
            dropped_[point] = 1;
            for (std::uint32_t i = first_[point]; i < first_[point + 1]; ++i) {
                const Node& node = nodes_[nodes_of_[i]];
                --sizes_[node.face];
                stays[nodes_[node.before].point] = 1;
                nodes_[node.before].after = node.after;
                nodes_[node.after].before = node.before;
            }
        }
        return any;
    }

    bool is_dropped(std::uint32_t point) const { return dropped_[point] != 0; }

private:
    bool can_drop(std::uint32_t point) const {
        if (first_[point + 1] - first_[point] != 2) return false;
        const Node& a = nodes_[nodes_of_[first_[point]]];
        const Node& b = nodes_[nodes_of_[first_[point] + 1]];
        const std::uint32_t from = nodes_[a.before].point;
        const std::uint32_t to = nodes_[a.after].point;
        if (nodes_[b.before].point != to || nodes_[b.after].point != from) return false;
        if (sizes_[a.face] <= 3 || sizes_[b.face] <= 3) return false;
        const Eigen::Vector3d chord = difference(points_[from], points_[to]);
        const Eigen::Vector3d along = difference(points_[from], points_[point]);
        const double share = std::clamp(dot(chord, along) / dot(chord, chord), 0.0, 1.0);
        return length(along - share * chord) <= 0.5 * tolerance_;
    }

    const std::vector<LatticePoint>& points_;
    double tolerance_;
    std::vector<Node> nodes_;
    std::vector<std::uint32_t> first_;     // [points + 1] start of a point's nodes in nodes_of_
    std::vector<std::uint32_t> nodes_of_;  // nodes, point by point
    std::vector<std::size_t> sizes_;       // [faces] points of the loop
    std::vector<char> dropped_;
};

}  // namespace

void drop_collinear_points(const std::vector<LatticePoint>& points, double tolerance,
                           std::vector<HullFace>& faces) {
    CollinearPointFilter filter(points, tolerance, faces);
    while (filter.run_round()) {
    }
    for (HullFace& face : faces) {
        std::erase_if(face.loop, [&](std::uint32_t p) { return filter.is_dropped(p); });
    }
}

}  // namespace terrane::internal
