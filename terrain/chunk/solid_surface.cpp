// SPDX-License-Identifier: MIT
//
// Sources: S. Woop, C. Benthin, I. Wald. Watertight ray/triangle intersection. JCGT 2(1), 2013.
// Deviations: rays hit triangles on both sides. The products of an edge are bit-identical for both of its triangles, so
//             that a ray cannot pass between them.
#include "base/aabb_tree.h"

#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/solid_surface.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace terrane {
namespace {

/// Margin around boxes, metres, so that rounding does not exclude triangles.
constexpr double kBoxMargin = 1e-9;
/// Relative rounding error of a triangle's height.
constexpr double kHeightSlack = 1e-14;

/// A ray, sheared so that it is parallel to one axis.
class ShearedRay {
public:
    ShearedRay(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement) : from_(from) {
        displacement.cwiseAbs().maxCoeff(&along_);
        first_ = (along_ + 1) % 3;
        second_ = (along_ + 2) % 3;
        shear_first_ = displacement[first_] / displacement[along_];
        shear_second_ = displacement[second_] / displacement[along_];
        scale_ = 1.0 / displacement[along_];
    }

    /// Parameter at which the ray hits a triangle, 1 at the end of the displacement; infinity if the ray misses.
    double meet(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                const Eigen::Vector3d& c) const {
        const Point p = sheared(a), q = sheared(b), r = sheared(c);
        const double of_a = r.u * q.v - r.v * q.u;
        const double of_b = p.u * r.v - p.v * r.u;
        const double of_c = q.u * p.v - q.v * p.u;
        const bool is_front = of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0;
        const bool is_back = of_a <= 0.0 && of_b <= 0.0 && of_c <= 0.0;
        const double sum = of_a + of_b + of_c;
        if (!(is_front || is_back) || sum == 0.0) return internal::kInfinity;  // a miss
        return (of_a * p.w + of_b * q.w + of_c * r.w) / sum * scale_;
    }

private:
    struct Point {
        double u, v, w;
    };
    Point sheared(const Eigen::Vector3d& point) const {
        const Eigen::Vector3d to = point - from_;
        return {to[first_] - shear_first_ * to[along_], to[second_] - shear_second_ * to[along_],
                to[along_]};
    }

    Eigen::Vector3d from_;
    Eigen::Index along_ = 2, first_ = 0, second_ = 1;
    double shear_first_, shear_second_, scale_;
};

}  // namespace

/// A bounding volume tree whose leaves are groups of four consecutive triangles. Consecutive triangles of a contour are
/// adjacent, so the box of a group is little larger than the boxes of its triangles. The boxes of a group's triangles
/// are tested together.
struct SolidSurface::Tree {
    static constexpr std::uint32_t kGroup = 4;
    static constexpr int kGroupBits = 2;
    static_assert(kGroup == 1u << kGroupBits);

    /// Boxes of a group's triangles relative to origin_world, rounded outward; boxes beyond the last triangle are
    /// empty.
    struct GroupBoxes {
        std::array<std::array<float, kGroup>, 3> low, high;
        std::uint32_t first = 0;  ///< first triangle of the group

        GroupBoxes() {
            for (auto& axis : low) axis.fill(std::numeric_limits<float>::max());
            for (auto& axis : high) axis.fill(std::numeric_limits<float>::lowest());
        }
        void set(std::size_t i, const Aabb& box_world, const Eigen::Vector3d& origin) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<Eigen::Index>(axis);
                low[axis][i] = rounded_down(box_world.low[a] - origin[a]);
                high[axis][i] = -rounded_down(origin[a] - box_world.high[a]);
            }
        }
        /// x rounded down, by up to two units in the last place.
        static float rounded_down(double x) {
            const auto rounded = static_cast<float>(std::clamp(x, -1e30, 1e30));
            return rounded - std::abs(rounded) * 0x1p-23f;
        }
    };

    std::vector<internal::AabbNode> nodes;  // items: indices into groups
    std::vector<GroupBoxes> groups;         // in the order of the leaves
    Eigen::Vector3d origin_world;

    /// Bit i is set if box i of a group overlaps or touches box 0 of `with`, up to rounding.
    std::uint32_t overlaps(std::uint32_t group, const GroupBoxes& with) const {
        const GroupBoxes& own = groups[group];
        std::array<std::uint32_t, kGroup> is;
        is.fill(1);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float low = with.low[axis][0], high = with.high[axis][0];
            for (std::size_t i = 0; i < kGroup; ++i) {
                is[i] &= static_cast<std::uint32_t>(own.low[axis][i] <= high) &
                         static_cast<std::uint32_t>(low <= own.high[axis][i]);
            }
        }
        return is[0] | is[1] << 1 | is[2] << 2 | is[3] << 3;
    }
};

SolidSurface::SolidSurface(SolidTriangles triangles) : triangles_(std::move(triangles)) {
    static_assert(sizeof(replaced_) * 8 == std::size_t{2} * kChunkCells * kChunkCells);
    TERRANE_ASSERT(triangles_.parts.size() == triangles_.triangles.size(),
                   "as many parts as triangles");
    for (const std::uint16_t triangle : triangles_.replaced) replaced_.set(triangle);
    bounds_ = internal::empty_box();
    const auto& v = triangles_.vertices_world;
    const std::uint32_t count = triangle_count();
    std::vector<Aabb> boxes(count),
        groups((count + Tree::kGroup - 1) / Tree::kGroup, internal::empty_box());
    for (std::uint32_t i = 0; i < count; ++i) {
        Aabb& box = boxes[i] = internal::empty_box();
        for (const std::uint32_t corner : corners(i)) internal::include(v[corner], 0.0, box);
        Aabb& group = groups[i / Tree::kGroup];
        group = {group.low.cwiseMin(box.low), group.high.cwiseMax(box.high)};
    }
    for (const Aabb& group : groups)
        bounds_ = {bounds_.low.cwiseMin(group.low), bounds_.high.cwiseMax(group.high)};
    auto tree = std::make_unique<Tree>();
    tree->nodes = internal::make_aabb_tree(groups);
    tree->groups.reserve(groups.size());
    tree->origin_world = bounds_.low;
    for (internal::AabbNode& node : tree->nodes) {
        if (node.item == internal::AabbNode::kInner) continue;
        Tree::GroupBoxes& made = tree->groups.emplace_back();
        made.first = node.item * Tree::kGroup;
        node.item = static_cast<std::uint32_t>(tree->groups.size() - 1);
        for (std::uint32_t i = made.first; i < std::min(made.first + Tree::kGroup, count); ++i)
            made.set(i - made.first, boxes[i], bounds_.low);
    }
    tree_ = std::move(tree);
}

SolidSurface::~SolidSurface() = default;

std::optional<SolidSurface::Hit> SolidSurface::ray(const Eigen::Vector3d& from_world,
                                                   const Eigen::Vector3d& displacement,
                                                   double begin, double end) const {
    if (displacement.isZero(0.0)) return std::nullopt;
    const ShearedRay ray(from_world, displacement);
    std::optional<Hit> first;
    internal::visit_leaves_up_to(
        tree_->nodes, end,
        [&](const Aabb& box) {
            return internal::segment_entry(from_world, displacement, box, kBoxMargin);
        },
        [&](std::uint32_t group) {
            const std::uint32_t from = tree_->groups[group].first;
            const std::uint32_t after = std::min(from + Tree::kGroup, triangle_count());
            for (std::uint32_t i = from; i < after; ++i) {
                const std::array<std::uint32_t, 3>& triangle = corners(i);
                const auto& v = triangles_.vertices_world;
                const double t = ray.meet(v[triangle[0]], v[triangle[1]], v[triangle[2]]);
                const double last = first ? first->t : end;
                const bool is_first =
                    t >= begin && t <= last && (!first || t < first->t || i < first->triangle);
                if (is_first) first = Hit{t, i};
            }
            return first ? first->t : end;
        });
    return first;
}

std::optional<SolidSurface::Hit> SolidSurface::highest(double x, double y, double at_most) const {
    const double highest = std::min(at_most, bounds_.high.z());
    if (!(highest >= bounds_.low.z())) return std::nullopt;
    // the ray starts slightly higher, to hit a surface at this height, and is a metre longer, so that its length is > 0
    const double top = highest + kHeightSlack * (1.0 + std::abs(highest));
    const double length = top - bounds_.low.z() + 1.0;
    std::optional<Hit> hit = ray({x, y, top}, {0.0, 0.0, -length}, 0.0, 1.0);
    if (hit) hit->t = std::min(top - hit->t * length, at_most);
    return hit;
}

std::size_t SolidSurface::find_overlaps(const Aabb& box_world, std::uint32_t& cursor,
                                        std::span<std::uint32_t> out) const {
    std::size_t count = 0;
    const std::span<const internal::AabbNode> nodes = tree_->nodes;
    if (nodes.empty()) return count;
    Tree::GroupBoxes box;
    box.set(0, box_world, tree_->origin_world);
    // the cursor encodes a node and the next triangle of its group
    std::uint32_t at = cursor >> Tree::kGroupBits, in_group = cursor % Tree::kGroup;
    while (at < nodes.size() && count < out.size()) {
        const internal::AabbNode& node = nodes[at];
        const bool is_near = internal::overlap(node.bounds, box_world, 0.0);
        if (is_near && node.item != internal::AabbNode::kInner) {
            std::uint32_t found = tree_->overlaps(node.item, box) >> in_group << in_group;
            for (; found != 0 && count < out.size(); found &= found - 1) {
                in_group = static_cast<std::uint32_t>(std::countr_zero(found));
                out[count++] = tree_->groups[node.item].first + in_group++;
            }
            if (found != 0) break;
            in_group = 0;
        }
        at = is_near ? at + 1 : node.end;
    }
    cursor = at << Tree::kGroupBits | in_group;
    return count;
}

Eigen::Vector3d SolidSurface::normal(std::uint32_t triangle) const {
    const auto& [a, b, c] = corners(triangle);
    const auto& v = triangles_.vertices_world;
    const Eigen::Vector3d across = (v[b] - v[a]).cross(v[c] - v[a]);
    const double size = across.norm();
    return size > 0.0 ? Eigen::Vector3d(across / size) : Eigen::Vector3d::UnitZ();
}

std::size_t SolidSurface::bytes() const {
    using Corners = std::array<std::uint32_t, 3>;
    std::size_t drawn = triangles_.levels.capacity() * sizeof(SolidLevel);
    for (const SolidLevel& level : triangles_.levels) {
        drawn += level.triangles.capacity() * sizeof(Corners);
    }
    for (const auto& cap : triangles_.caps) drawn += cap.capacity() * sizeof(Corners);
    return sizeof(*this) + drawn + triangles_.vertices_world.capacity() * sizeof(Eigen::Vector3d) +
           triangles_.triangles.capacity() * sizeof(std::array<std::uint32_t, 3>) +
           triangles_.kept_neighbours.capacity() * sizeof(std::array<std::uint32_t, 3>) +
           triangles_.parts.capacity() + triangles_.replaced.capacity() * sizeof(std::uint16_t) +
           triangles_.error_boxes.capacity() * sizeof(SolidErrorBox) +
           triangles_.error_box_of.capacity() * sizeof(std::uint32_t) +
           tree_->nodes.capacity() * sizeof(internal::AabbNode) +
           tree_->groups.capacity() * sizeof(Tree::GroupBoxes);
}

}  // namespace terrane
